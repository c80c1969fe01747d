#include "doppel/devices/drivers/servo_hardware.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "doppel/control/hardware/hardware_registry.h"
#include "doppel/control/hardware/nan.h"
#include "doppel/devices/drivers/check_record.h"
#include "doppel/devices/drivers/detail/release_watch.h"
#include "doppel/devices/drivers/detail/servo_group.h"
#include "doppel/devices/drivers/guard_report.h"
#include "doppel/devices/drivers/pose_record.h"
#include "doppel/devices/serial/file_link.h"
#include "doppel/devices/serial/serial_ports.h"

namespace doppel {
namespace {

constexpr int kStartSamples = 5;
constexpr double kStartSpread = 0.01;  // rad, of the samples before the torque goes on
constexpr Duration kRestTime = std::chrono::seconds(1), kRestPause{50'000'000};
constexpr double kBeyondLimit = 3 * 0.0174532925;  // rad, within which a joint may start
constexpr double kFirstTorque = 0.3, kTorqueStep = 0.07;
constexpr double kGivesWay = 0.01;                        // rad or m behind the goal, in the ramp
constexpr double kTorqueTime = 1.0;                       // s, from the first torque to the whole
constexpr double kTooHot = 70;                            // degrees Celsius
constexpr double kParkReached = 0.02;                     // rad
constexpr Duration kParkTime = std::chrono::seconds(20);  // on exit, at most
constexpr Duration kParkPeriod{20'000'000};

}  // namespace

std::string port_of(const ServoSetup& setup) {
  if (setup.port != "auto") return setup.port;
  // The board's own ports are there without a device, too.
  std::vector<PortInfo> ports = serial_ports();
  std::erase_if(ports, [](const PortInfo& one) { return one.usb_id.empty(); });
  std::ranges::move(emulated_ports(), std::back_inserter(ports));
  if (ports.size() == 1) return ports.front().path;
  std::vector<std::string> names;
  for (const PortInfo& one : ports) names.push_back(one.by_id.empty() ? one.path : one.by_id);
  throw InputError(
      "hardware.no_port", {},
      ports.empty() ? fmt::format("hardware '{}' has no port: no serial device is connected", setup.component)
                    : fmt::format("hardware '{}' may be behind any of these ports: {}", setup.component,
                                  fmt::join(names, ", ")),
      ports.empty() ? "connect the device; without one, see: doppel emulate"
                    : "write its port into hardware.yaml; doppel hardware scan shows what is behind each");
}

std::unique_ptr<ByteLink> open_servo_link(const ServoSetup& setup) {
  return open_link(port_of(setup), setup.rate);
}

std::string_view to_string(DriverState state) {
  switch (state) {
    case DriverState::disconnected:
      return "disconnected";
    case DriverState::connected:
      return "connected";
    case DriverState::holding:
      return "holding";
    case DriverState::active:
      return "active";
    case DriverState::degraded:
      return "degraded";
    case DriverState::fault:
      break;
  }
  return "fault";
}

ServoHardware::ServoHardware() : ServoHardware(open_servo_link) {}
ServoHardware::ServoHardware(LinkMaker open) : open_(std::move(open)) {}
ServoHardware::~ServoHardware() = default;

// -- life cycle

Status ServoHardware::on_init(const HardwareInfo& info) {
  setup_ = read_servo_setup(info.description, info.model, info.diagnostics);
  log_ = &info.log;
  for (std::size_t i = 0; i < setup_.joints.size(); ++i) {
    const JointServo& joint = setup_.joints[i];
    commands_.push_back({joint.joint, kPosition, kNaN});
    guards_.emplace_back(GuardLimits{joint.lower, joint.upper, joint.velocity, joint.gripper});
  }
  for (const HardwareJointDescription& joint : info.description.joints) {
    const auto servo = std::ranges::find(setup_.joints, joint.name, &JointServo::joint);
    for (const HardwareInterfaceDescription& state : joint.state_interfaces) {
      static constexpr std::array<std::string_view, 6> kNames{"position", "velocity", "effort",
                                                              "current",  "voltage",  "temperature"};
      const auto name = std::ranges::find(kNames, state.name);
      StateInterface source;
      source.joint = static_cast<std::size_t>(servo - setup_.joints.begin());
      if (servo != setup_.joints.end()) source.quantity = static_cast<Quantity>(name - kNames.begin());
      state_sources_.push_back(source);
      states_.push_back({joint.name, state.name, state.initial_value.value_or(0.0)});
    }
  }
  readings_.resize(setup_.joints.size());
  goals_.resize(setup_.joints.size());
  claimed_.assign(setup_.joints.size(), false);
  release_ = std::make_unique<JointReleases>(setup_.joints.size());
  joint_events_ = std::vector<std::atomic<unsigned>>(setup_.joints.size());
  reported_ = std::make_unique<LatestCopy>(std::vector<double>(kReported * setup_.joints.size(), kNaN));
  return {};
}

Status ServoHardware::on_configure() {
  try {
    link_ = open_(setup_);
  } catch (const InputError& problem) {
    const Diagnostic& first = problem.diagnostics().front();
    return Status::refused(first.fix.empty() ? first.message : first.message + "; " + first.fix);
  }
  group_ = setup_.protocol == ServoProtocol::servo_line ? make_line_group(setup_, *link_)
                                                        : make_register_group(setup_, *link_);
  if (Status found = group_->connect(); !found) {
    close();
    return found;
  }
  if (!await_readings()) {
    close();
    return Status::refused("not every servo reports its position");
  }
  begin_guards();
  unconfirmed_ = !group_->knows_pose();
  state_ = DriverState::connected;
  log_->note(setup_.component, fmt::format("{} on {}, {} servos", to_string(setup_.protocol), link_->name(),
                                           setup_.joints.size()));
  return {};
}

// From the joints' present positions on.
void ServoHardware::begin_guards() {
  whole_ = link_->now();
  take_readings();
  for (std::size_t i = 0; i < guards_.size(); ++i)
    guards_[i].begin(setup_.joints[i].joint_position(readings_[i].position), whole_);
}

Status ServoHardware::check_start(std::size_t joint) const {
  const JointServo& servo = setup_.joints[joint];
  const double q = servo.joint_position(readings_[joint].position);
  if (!servo.enabled || (q >= servo.lower - kBeyondLimit && q <= servo.upper + kBeyondLimit)) return {};
  return Status::refused(fmt::format(
      "'{}' is at {:.3f} rad, outside of its limits {:.3f} to {:.3f}; doppel hardware recover "
      "--joint \"{}\" drives it back slowly; or move it inside by hand, with its torque off, or check "
      "its zero",
      servo.joint, q, servo.lower, servo.upper, servo.joint));
}

// A quarter of the speed until a person has seen every joint turn the right way.
void ServoHardware::choose_gentleness() {
  gentle_ = setup_.gentle == GentleMode::always;
  if (setup_.gentle != GentleMode::until_checked) return;
  if (setup_.protocol == ServoProtocol::servo_line) {
    gentle_ = true;
    return log_->warning(
        setup_.component,
        "gentle: a quarter of the speed; once the arm moves as the page shows it, write gentle: "
        "never into hardware.yaml");
  }
  const CheckRecord record = read_check_record(check_record_file(setup_.component, link_->name()));
  const std::vector<std::string> missing = unconfirmed_joints(record, setup_);
  std::string next;
  if (!is_checked(record, setup_)) next = "doppel hardware check has not passed";
  if (!missing.empty())
    next += fmt::format("{}no person has confirmed '{}' with doppel hardware nudge --joint \"{}\"",
                        next.empty() ? "" : ", and ", fmt::join(missing, "', '"), missing.front());
  gentle_ = !next.empty();
  if (gentle_) log_->warning(setup_.component, "gentle: a quarter of the speed, because " + next);
}

// A single answer may be late or lost. False: a servo stays silent.
bool ServoHardware::await_readings() {
  const Time end = link_->now() + kRestTime;
  while (group_->read(readings_) < readings_.size()) {
    if (link_->is_lost() || link_->now() >= end) return false;
    link_->wait_until(link_->now() + kRestPause);
  }
  return true;
}

// A single answer may be late or lost, and an arm that was just let go of comes to rest.
Status ServoHardware::await_rest() {
  const Time end = link_->now() + kRestTime;
  for (;;) {
    Status sampled = sample_at_rest();
    if (sampled || link_->is_lost() || link_->now() >= end) return sampled;
    link_->wait_until(link_->now() + kRestPause);
  }
}

// Several whole samples that agree: a damaged one must not become a goal.
Status ServoHardware::sample_at_rest() {
  std::vector<double> low, high;
  for (int sample = 0; sample < kStartSamples; ++sample) {
    if (group_->read(readings_) < readings_.size())
      return Status::refused("a servo does not answer; no torque was turned on");
    for (std::size_t i = 0; i < readings_.size(); ++i) {
      const double q = readings_[i].position;
      if (sample == 0) {
        low.push_back(q);
        high.push_back(q);
      }
      low[i] = std::min(low[i], q);
      high[i] = std::max(high[i], q);
      if (high[i] - low[i] > kStartSpread)
        return Status::refused(
            fmt::format("'{}' moves, or its answers differ by {:.3f} rad; no torque was turned on",
                        setup_.joints[i].joint, high[i] - low[i]));
    }
  }
  return {};
}

Status ServoHardware::on_activate() {
  if (link_ == nullptr) return Status::refused("it is not connected");
  if (Status same = await_rest(); !same) return same;
  for (std::size_t i = 0; i < readings_.size(); ++i) {
    if (Status inside = check_start(i); !inside) return inside;
  }
  // An arm that is held already would fall with less torque than it has.
  torque_ = torque_set_ = group_->has_torque() ? 1 : kFirstTorque;
  if (Status started = group_->start(torque_); !started) return started;
  choose_gentleness();
  whole_ = link_->now();
  for (std::size_t i = 0; i < guards_.size(); ++i) {
    guards_[i].begin(setup_.joints[i].joint_position(readings_[i].position), whole_);
    guards_[i].set_gentle(gentle_);
  }
  lost_ = 0;
  stopped_ = parking_ = parked_ = false;
  release_->joint.reset();
  release_->waits.assign(release_->waits.size(), false);
  state_ = DriverState::holding;
  hold_all();
  return {};
}

Status ServoHardware::on_deactivate() {
  catch_released();
  claimed_.assign(claimed_.size(), false);
  hold_all();
  if (setup_.at_deactivation == AtDeactivation::relax) {
    release_->joint.reset();  // it is not caught later, when a person has a hand there
    const Status off = group_->relax();
    state_ = DriverState::connected;
    return off;
  }
  parking_ = setup_.at_deactivation == AtDeactivation::park;
  if (!send_goals()) return Status::refused("the link is lost");
  state_ = DriverState::holding;
  return {};
}

Status ServoHardware::on_cleanup() {
  close();
  return {};
}

Status ServoHardware::on_shutdown() {
  if (link_ != nullptr && !link_->is_lost()) {
    const bool holds = state_ == DriverState::holding || state_ == DriverState::active;
    if (setup_.park_on_exit && holds && !stopped_) park_and_wait();
    if (!parked_) static_cast<void>(on_deactivate());
  }
  close();
  return {};
}

// In the thread that shuts down, without a loop around it. A person who does not want to wait
// interrupts again.
void ServoHardware::park_and_wait() {
  catch_released();
  claimed_.assign(claimed_.size(), false);
  hold_all();
  parking_ = true;
  state_ = DriverState::holding;
  log_->note(setup_.component, "the arm parks");
  const Time end = link_->now() + kParkTime;
  while (parking_ && link_->now() < end && !link_->is_lost()) {
    static_cast<void>(group_->read(readings_));
    take_readings();
    catch_released();
    follow_park(kParkPeriod);
    link_->wait_until(link_->now() + kParkPeriod);
  }
  parked_ = !parking_;
  if (!parked_)
    return log_->warning(
        setup_.component,
        fmt::format("the park pose was not reached within {:g} s; the joints hold where they are",
                    to_seconds(kParkTime)));
  if (setup_.protocol == ServoProtocol::servo_line) record_parked_pose();
}

// The next start needs no person: the arm rests in this pose without power, too.
void ServoHardware::record_parked_pose() const {
  PoseRecord record;
  record.parked = true;
  for (std::size_t i = 0; i < guards_.size(); ++i)
    record.positions.emplace_back(setup_.joints[i].joint, guards_[i].sent_goal());
  try {
    write_pose_record(pose_record_file(setup_.component, setup_.port), record);
  } catch (const InputError& problem) {
    log_->warning(setup_.component, fmt::format("the parked pose cannot be recorded: {}", problem.what()));
  }
}

// The torque stays on: an arm that falls is worse than one that stands.
Status ServoHardware::on_error() {
  claimed_.assign(claimed_.size(), false);
  if (link_ != nullptr && !link_->is_lost()) {
    catch_released();
    hold_all();
    static_cast<void>(send_goals());
  }
  release_->joint.reset();
  close();
  return {};
}

void ServoHardware::close() {
  group_.reset();
  link_.reset();
  parking_ = unconfirmed_ = false;
  if (state_ != DriverState::fault) state_ = DriverState::disconnected;
}

void ServoHardware::perform_switch(std::span<const std::string> start, std::span<const std::string> stop) {
  for (std::size_t i = 0; i < commands_.size(); ++i) {
    const std::string name = commands_[i].full_name();
    const bool starts = std::ranges::find(start, name) != start.end();
    const bool stops = std::ranges::find(stop, name) != stop.end();
    if (starts || stops) claimed_[i] = starts;
    if (starts) release_->waits[i] = false;
    if (stops && !starts) guards_[i].hold();
  }
}

void ServoHardware::on_stop() {
  stopped_ = true;
  parking_ = false;
  catch_released();
  hold_all();
  if (group_ != nullptr) static_cast<void>(send_goals());
}

void ServoHardware::on_stop_reset() {
  stopped_ = false;
  hold_all();
}

// -- the cycle

void ServoHardware::hold_all() {
  for (JointGuard& guard : guards_) guard.hold();
}

bool ServoHardware::send_goals() {
  for (std::size_t i = 0; i < goals_.size(); ++i)
    goals_[i] = {release_->joint == i ? kNaN : setup_.joints[i].shaft(guards_[i].sent_goal()), 0};
  return group_->write(goals_);
}

void ServoHardware::take_readings() {
  for (std::size_t i = 0; i < readings_.size(); ++i) {
    const JointServo& servo = setup_.joints[i];
    const ServoReading& reading = readings_[i];
    if (reading.fresh) {
      const double rate = servo.direction / servo.scale;
      guards_[i].take(servo.joint_position(reading.position), rate * reading.velocity, reading.load,
                      reading.when);
      release_->positions[i].take(servo.joint_position(reading.position), reading.when);
    }
    guards_[i].take_temperature(reading.temperature);
  }
}

void ServoHardware::note_loss() {
  ++lost_;
  if (lost_ != setup_.max_lost_replies) return;
  hold_all();
  if (state_ != DriverState::active && state_ != DriverState::holding) return;
  state_ = DriverState::degraded;
  events_ |= kDegraded;
}

HardwareReturn ServoHardware::fail(std::string_view why) {
  const std::size_t size = std::min(why.size(), why_.size() - 1);
  std::memcpy(why_.data(), why.data(), size);
  why_[size] = '\0';
  state_ = DriverState::fault;
  return HardwareReturn::error;
}

HardwareReturn ServoHardware::read(Time when, Duration period, std::span<double> states) {
  const std::size_t fresh = group_->read(readings_);
  const Time now = link_->now();
  release_->read_when = when;
  release_->read_at = now;
  cycles_.fetch_add(1, std::memory_order_relaxed);
  lost_answers_.store(group_->counts().lost, std::memory_order_relaxed);
  damaged_.store(group_->counts().bad_checks, std::memory_order_relaxed);
  take_readings();
  if (fresh == readings_.size()) {
    whole_ = now;
    lost_ = 0;
    if (state_ == DriverState::degraded) {
      state_ = DriverState::active;
      events_ |= kRecovered;
    }
  } else {
    note_loss();
  }
  watch_release();
  fill_states(states);
  publish_report();
  if (to_seconds(now - whole_) > setup_.fault_after && state_ != DriverState::connected)
    return fail(link_->is_lost()            ? "the port is gone: the cable, or the adapter's power"
                : group_->refusal().empty() ? "servos have not answered for too long"
                                            : group_->refusal());
  if (watch_heat()) return fail("a servo is at 70 degrees Celsius or more");
  if (parking_) follow_park(period);
  return HardwareReturn::ok;
}

// True: a servo is too hot to go on, and there is no pose to park in.
bool ServoHardware::watch_heat() {
  const bool hot =
      std::ranges::any_of(readings_, [](const ServoReading& one) { return one.temperature >= kTooHot; });
  if (!hot || state_ == DriverState::connected) return false;
  if (setup_.park.empty()) return true;
  if (!parking_) events_ |= kParked;
  parking_ = true;
  return false;
}

void ServoHardware::follow_park(Duration period) {
  bool there_yet = true;
  for (const auto& [name, position] : setup_.park) {
    const auto servo = std::ranges::find(setup_.joints, name, &JointServo::joint);
    if (servo == setup_.joints.end() || !servo->enabled) continue;
    JointGuard& guard = guards_[static_cast<std::size_t>(servo - setup_.joints.begin())];
    guard.set_gentle(true);
    static_cast<void>(guard.goal(position, period));
    there_yet = there_yet && std::abs(guard.position() - position) < kParkReached;
  }
  static_cast<void>(send_goals());
  if (there_yet && state_ != DriverState::active) parking_ = false;
}

bool ServoHardware::gives_way(std::size_t joint) const {
  return setup_.joints[joint].enabled &&
         std::abs(guards_[joint].position() - guards_[joint].sent_goal()) > kGivesWay;
}

// From 30 % to the whole torque, in steps that the servos confirm. A joint that gives way under its load ends
// the ramp: a falling arm is worse than a strong one, whose goal is where it was.
void ServoHardware::advance_torque(Duration period) {
  if (torque_set_ >= 1 || lost_ > 0) return;
  torque_ = std::min(1.0, torque_ + (1 - kFirstTorque) * to_seconds(period) / kTorqueTime);
  for (std::size_t i = 0; i < guards_.size(); ++i) {
    if (gives_way(i)) torque_ = 1;
  }
  if (torque_ - torque_set_ < kTorqueStep && torque_ < 1) return;
  if (group_->set_torque(torque_)) torque_set_ = torque_;
}

HardwareReturn ServoHardware::write(Time /*now*/, Duration period, std::span<const double> commands) {
  if (stopped_) return HardwareReturn::ok;
  advance_torque(period);
  bool commanded = false;
  for (std::size_t i = 0; i < guards_.size(); ++i) {
    const bool follows =
        claimed_[i] && state_ != DriverState::degraded && !parking_ && setup_.joints[i].enabled;
    const double command = follows ? followed(i, commands[i]) : kNaN;
    commanded = commanded || std::isfinite(command);
    if (!parking_) static_cast<void>(guards_[i].goal(command, period));
    if (release_->joint == i) guards_[i].hold();
    release_->goals[i].take(guards_[i].sent_goal(), link_->now());
    if (const unsigned events = guards_[i].take_events(); events != 0) joint_events_[i] |= events;
    if (!setup_.joints[i].enabled) guards_[i].hold();
  }
  if (commanded && state_ == DriverState::holding) state_ = DriverState::active;
  // A link that is lost is an error only when answers have been missing for long enough: it may come back.
  static_cast<void>(send_goals());
  return HardwareReturn::ok;
}

void ServoHardware::fill_states(std::span<double> states) const {
  for (std::size_t i = 0; i < states.size(); ++i) {
    const StateInterface& source = state_sources_[i];
    if (source.quantity == Quantity::other) continue;
    const JointServo& servo = setup_.joints[source.joint];
    const ServoReading& reading = readings_[source.joint];
    const double direction = servo.direction;
    const auto put = [&](double value) {
      if (std::isfinite(value)) states[i] = value;
    };
    switch (source.quantity) {
      case Quantity::position:
        put(guards_[source.joint].position());
        break;
      case Quantity::velocity:
        put(direction * reading.velocity / servo.scale);
        break;
      case Quantity::effort:
        put(servo.model != nullptr ? direction * reading.load * servo.model->stall_torque * servo.scale
                                   : kNaN);
        break;
      case Quantity::current:
        put(reading.current);
        break;
      case Quantity::voltage:
        put(reading.voltage);
        break;
      case Quantity::temperature:
        put(reading.temperature);
        break;
      case Quantity::other:
        break;
    }
  }
}

// -- for people

void ServoHardware::attend() {
  for (std::size_t i = 0; i < joint_events_.size(); ++i)
    log_guard_events(joint_events_[i].exchange(0), setup_.component, setup_.joints[i].joint, *log_);
  log_catch();
  const unsigned events = events_.exchange(0);
  if ((events & kDegraded) != 0)
    log_->warning(setup_.component,
                  fmt::format("servos do not answer in {} cycles; all joints hold", setup_.max_lost_replies));
  if ((events & kRecovered) != 0) log_->note(setup_.component, "all servos answer again");
  if ((events & kParked) != 0)
    log_->warning(setup_.component, "a servo is at 70 degrees Celsius or more; the arm parks");
}

std::string ServoHardware::fault() const {
  return why_.data();
}

void register_servo_hardware(HardwareRegistry& registry) {
  for (const ServoPlugin& plugin : servo_plugins()) {
    registry.add(std::string(plugin.name), HardwareKind::real,
                 [] { return std::make_unique<ServoHardware>(); });
  }
}

}  // namespace doppel
