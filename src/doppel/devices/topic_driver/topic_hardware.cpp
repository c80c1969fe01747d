#include "doppel/devices/topic_driver/topic_hardware.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numbers>

#include "doppel/control/hardware/nan.h"
#include "doppel/devices/drivers/guard_report.h"

namespace doppel {
namespace {

constexpr int kStartSamples = 5;
constexpr double kStartSpread = 0.01;              // rad or m, of the states before an activation
constexpr double kBeyondLimit = 3 * 0.0174532925;  // rad or m, within which a joint may start
constexpr double kDrift = 1e-3;                    // by which two clocks may drift apart
constexpr double kMinPatience = 0.05;              // s without a state before the joints hold
constexpr Duration kSilence = std::chrono::seconds(5);
constexpr std::array<std::string_view, 3> kFields{kPosition, kVelocity, kEffort};

std::string node_name(const std::string& name_space, const std::string& component) {
  std::string out = name_space + "/topic_hardware_";
  for (const char c : component) out += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
  return out;
}

double value_of(const std::vector<double>& values, std::size_t row) {
  return row < values.size() ? values[row] : kNaN;
}

}  // namespace

TopicHardware::Joint::Joint(const TopicJoint& one)
    : guard({one.lower, one.upper, one.velocity, one.gripper}),
      position(kNaN),
      velocity(kNaN),
      effort(kNaN),
      before(kNaN) {}

TopicHardware::TopicHardware(Bus& bus, std::string name_space)
    : bus_(bus), name_space_(std::move(name_space)) {}

// -- life cycle

Status TopicHardware::on_init(const HardwareInfo& info) {
  setup_ = read_topic_setup(info.description, info.model, info.diagnostics);
  log_ = &info.log;
  for (const TopicJoint& one : setup_.joints) {
    Joint& joint = joints_.emplace_back(one);
    if (!one.commanded) continue;
    joint.guard = JointGuard({one.lower, one.upper, one.velocity, one.gripper, setup_.ahead});
    joint.guard.set_gentle(setup_.gentle);
    joint.command = commands_.size();
    commands_.push_back({one.name, kPosition, kNaN});
    message_.name.push_back(one.name);
  }
  message_.position.assign(message_.name.size(), kNaN);
  published_ = message_.position;
  for (std::size_t i = 0; i < info.description.joints.size(); ++i) {
    const HardwareJointDescription& joint = info.description.joints[i];
    for (const HardwareInterfaceDescription& state : joint.state_interfaces) {
      const auto field = std::ranges::find(kFields, state.name);
      state_sources_.push_back({i, static_cast<std::size_t>(field - kFields.begin())});
      states_.push_back({joint.name, state.name, state.initial_value.value_or(kNaN)});
    }
  }
  return {};
}

Status TopicHardware::on_configure() {
  node_ = std::make_unique<Node>(bus_, node_name(name_space_, setup_.component));
  topic_ = node_->advertise<JointState>(setup_.commands, {.depth = 1});
  node_->subscribe<JointState>(
      setup_.states, [this](const JointState& message) { receive(message); }, Qos::sensor_data());
  forget_samples();
  state_ = DriverState::connected;
  configured_ = bus_.now();
  return {};
}

void TopicHardware::forget_samples() {
  for (Joint& joint : joints_) {
    joint.position = joint.velocity = joint.effort = joint.before = kNaN;
    joint.stamp = joint.seen = Time{};
    joint.fresh = joint.whole = false;
  }
  shortest_.reset();
  newest_stamp_ = Time{};
  older_ = {};
  echo_.clear();
  seen_graph_ = 0;
  equal_ = 0;
  known_events_ = 0;
  warned_of_silence_ = false;
}

std::string TopicHardware::missing_joints() const {
  std::vector<std::string_view> missing;
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    if (setup_.joints[i].commanded && !std::isfinite(joints_[i].position))
      missing.push_back(setup_.joints[i].name);
  }
  return missing.empty() ? "" : fmt::format("'{}'", fmt::join(missing, "', '"));
}

Status TopicHardware::readiness() const {
  if (node_ == nullptr) return Status::refused("it is not configured");
  if (messages_ == 0) return Status::refused(fmt::format("no state has arrived on '{}' yet", setup_.states));
  if (const std::string missing = missing_joints(); !missing.empty())
    return Status::refused(fmt::format("the states on '{}' have no position of {}", setup_.states, missing));
  if (equal_ < kStartSamples)
    return Status::refused(
        fmt::format("{} of {} states on '{}' at one pose have arrived: a joint moves, or "
                    "its states differ by more than {:g} rad",
                    equal_, kStartSamples, setup_.states, kStartSpread));
  if (to_seconds(now_ - whole_) > std::max(3 * interval_, 0.05))
    return Status::refused(
        fmt::format("the last state on '{}' is {:.2f} s old", setup_.states, to_seconds(now_ - whole_)));
  if (2 * interval_ > setup_.fault_after)
    return Status::refused(
        fmt::format("a state on '{}' arrives every {:.2f} s only, and fault_after is "
                    "{:g} s; let its node publish more often",
                    setup_.states, interval_, setup_.fault_after));
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    if (Status inside = check_start(setup_.joints[i], joints_[i].position); !inside) return inside;
  }
  return {};
}

Status TopicHardware::check_start(const TopicJoint& joint, double q) const {
  if (!joint.commanded || (q >= joint.lower - kBeyondLimit && q <= joint.upper + kBeyondLimit)) return {};
  return Status::refused(
      fmt::format("'{}' is at {:.3f} rad, outside of its limits {:.3f} to {:.3f}; move it "
                  "inside, or correct the zero of its node",
                  joint.name, q, joint.lower, joint.upper));
}

Status TopicHardware::on_activate() {
  refused_ = true;
  if (Status ready = readiness(); !ready) return ready;
  refused_ = false;
  for (Joint& joint : joints_) {
    joint.guard.begin(joint.position, joint.seen);
    joint.claimed = false;
    joint.events = 0;
  }
  std::ranges::fill(published_, kNaN);
  stopped_ = false;
  state_ = DriverState::holding;
  return {};
}

std::string TopicHardware::awaits() const {
  if (!refused_ || state_ != DriverState::connected || readiness()) return {};
  return fmt::format("the first states on '{}'", setup_.states);
}

Status TopicHardware::on_deactivate() {
  for (Joint& joint : joints_) joint.claimed = false;
  hold_all();
  publish_goals(now_);
  state_ = DriverState::connected;
  equal_ = 0;
  return {};
}

Status TopicHardware::on_cleanup() {
  node_.reset();
  topic_ = {};
  state_ = DriverState::disconnected;
  return {};
}

Status TopicHardware::on_shutdown() {
  if (state_ == DriverState::holding || state_ == DriverState::active) static_cast<void>(on_deactivate());
  return on_cleanup();
}

// The last goals were the last known positions. Nothing more is published: the arm may be elsewhere now.
Status TopicHardware::on_error() {
  for (Joint& joint : joints_) joint.claimed = false;
  const bool failed = state_ == DriverState::fault;
  static_cast<void>(on_cleanup());
  if (failed) state_ = DriverState::fault;
  return {};
}

void TopicHardware::perform_switch(std::span<const std::string> start, std::span<const std::string> stop) {
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    if (!setup_.joints[i].commanded) continue;
    const std::string name = commands_[joints_[i].command].full_name();
    const bool starts = std::ranges::find(start, name) != start.end();
    const bool stops = std::ranges::find(stop, name) != stop.end();
    if (starts || stops) joints_[i].claimed = starts;
    if (stops && !starts) joints_[i].guard.hold();
  }
}

void TopicHardware::on_stop() {
  stopped_ = true;
  hold_all();
  if (state_ != DriverState::connected && node_ != nullptr) publish_goals(now_);
}

void TopicHardware::on_stop_reset() {
  stopped_ = false;
  hold_all();
}

// -- states, between ticks

void TopicHardware::receive(const JointState& message) {
  ++messages_;
  const Time stamp = from_msg(message.header.stamp);
  if (stamp == Time{}) {
    events_ |= kNoStamp;
  } else {
    if (is_set_back(stamp)) follow_clock(stamp);
    if (is_late(stamp)) {
      ++late_;
      events_ |= kLate;
      return;
    }
  }
  for (std::size_t row = 0; row < message.name.size(); ++row) {
    // Most nodes send the joints in one order.
    std::size_t i = row;
    if (i >= joints_.size() || setup_.joints[i].name != message.name[row]) {
      const auto found = std::ranges::find(setup_.joints, message.name[row], &TopicJoint::name);
      if (found == setup_.joints.end()) continue;
      i = static_cast<std::size_t>(found - setup_.joints.begin());
    }
    Joint& joint = joints_[i];
    if (stamp != Time{} && stamp <= joint.stamp) {
      ++disordered_;
      events_ |= kOutOfOrder;
      continue;
    }
    joint.stamp = stamp;
    take(joint, message, row);
  }
}

// Late messages are newer than those before them, or come at once when they catch up.
bool TopicHardware::is_set_back(Time stamp) {
  if (stamp > newest_stamp_) {
    newest_stamp_ = stamp;
    older_.count = 0;
    return false;
  }
  const Time now = bus_.now();
  if (older_.count == 0 || stamp < older_.last) older_ = {.first = stamp, .seen = now};
  older_.last = stamp;
  ++older_.count;
  const double passed = to_seconds(now - older_.seen), by_stamp = to_seconds(stamp - older_.first);
  if (passed < setup_.max_delay) return false;
  if (std::abs(by_stamp - passed) <= setup_.max_delay / 2) return older_.count >= kStartSamples;
  // The first one was late itself, or they were held back: the clock is judged by this one and later ones.
  older_ = {.count = 1, .first = stamp, .last = stamp, .seen = now};
  return false;
}

void TopicHardware::follow_clock(Time stamp) {
  for (Joint& joint : joints_) joint.stamp = Time{};
  shortest_.reset();
  newest_stamp_ = stamp;
  older_ = {};
  events_ |= kSetBack;
}

// The two clocks may drift apart, so that the fastest message is forgotten slowly.
bool TopicHardware::is_late(Time stamp) {
  const Time now = bus_.now();
  const Duration delay = now - stamp;
  if (shortest_) *shortest_ += from_seconds(kDrift * std::max(to_seconds(now - shortest_when_), 0.0));
  shortest_when_ = now;
  if (!shortest_ || delay < *shortest_) shortest_ = delay;
  return to_seconds(delay - *shortest_) > setup_.max_delay;
}

void TopicHardware::take(Joint& joint, const JointState& message, std::size_t row) {
  const double position = value_of(message.position, row);
  if (!std::isfinite(position)) return;
  // From 0 as the sum begins, or by the shorter way from the last one.
  const double before = std::isfinite(joint.position) ? joint.position : 0;
  joint.position =
      setup_.unwraps ? before + std::remainder(position - before, 2 * std::numbers::pi) : position;
  joint.velocity = value_of(message.velocity, row);
  joint.effort = value_of(message.effort, row);
  joint.fresh = joint.whole = true;
}

// -- the cycle

// A state of all joints, which may have come in several messages.
void TopicHardware::take_whole(Time now) {
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    if (setup_.joints[i].commanded && !joints_[i].whole) return;
  }
  for (Joint& joint : joints_) joint.whole = false;
  if (state_ == DriverState::connected) count_equal(now);
  whole_ = now;
  if (state_ != DriverState::degraded) return;
  state_ = DriverState::active;
  events_ |= kRecovered;
}

void TopicHardware::count_equal(Time now) {
  bool equal = equal_ > 0 && to_seconds(now - whole_) <= setup_.fault_after;
  for (Joint& joint : joints_) {
    if (!equal) joint.least = joint.most = joint.position;
    joint.least = std::min(joint.least, joint.position);
    joint.most = std::max(joint.most, joint.position);
    if (!(joint.most - joint.least > kStartSpread)) continue;
    equal = false;
    break;
  }
  if (!equal) {
    equal_ = 0;
    first_equal_ = now;
    for (Joint& joint : joints_) joint.least = joint.most = joint.position;
  }
  ++equal_;
  if (equal_ > 1) interval_ = to_seconds(now - first_equal_) / (equal_ - 1);
}

double TopicHardware::load(std::size_t joint) const {
  const double effort = setup_.joints[joint].effort;
  return std::isfinite(effort) && effort > 0 ? joints_[joint].effort / effort : kNaN;
}

double TopicHardware::speed_since(const Joint& joint, Time now) {
  const double dt = to_seconds(now - joint.seen);
  return std::isfinite(joint.before) && dt > 0 ? (joint.position - joint.before) / dt : 0;
}

HardwareReturn TopicHardware::read(Time now, Duration /*period*/, std::span<double> states) {
  now_ = now;
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    Joint& joint = joints_[i];
    if (!joint.fresh) continue;
    joint.fresh = false;
    // Many nodes send positions alone.
    if (!std::isfinite(joint.velocity)) joint.velocity = speed_since(joint, now);
    joint.before = joint.position;
    joint.seen = now;
    if (setup_.joints[i].commanded) joint.guard.take(joint.position, joint.velocity, load(i), now);
  }
  take_whole(now);
  fill_states(states);
  if (state_ == DriverState::connected) return HardwareReturn::ok;
  note_silence(now);
  if (echo_.empty() && to_seconds(now - whole_) <= setup_.fault_after) return HardwareReturn::ok;
  state_ = DriverState::fault;
  return HardwareReturn::error;
}

void TopicHardware::note_silence(Time now) {
  const double longest_silence =
      std::min(std::max(setup_.max_lost_replies * interval_, kMinPatience), setup_.fault_after);
  if (state_ == DriverState::degraded || to_seconds(now - whole_) <= longest_silence) return;
  hold_all();
  ++lost_;
  state_ = DriverState::degraded;
  events_ |= kDegraded;
}

HardwareReturn TopicHardware::write(Time now, Duration period, std::span<const double> commands) {
  if (stopped_) return HardwareReturn::ok;
  bool commanded = false;
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    if (!setup_.joints[i].commanded) continue;
    Joint& joint = joints_[i];
    const bool follows = joint.claimed && state_ != DriverState::degraded;
    const double command = follows ? commands[joint.command] : kNaN;
    commanded = commanded || std::isfinite(command);
    static_cast<void>(joint.guard.goal(command, period));
    joint.events |= joint.guard.take_events();
  }
  if (commanded && state_ == DriverState::holding) state_ = DriverState::active;
  publish_goals(now);
  return HardwareReturn::ok;
}

void TopicHardware::hold_all() {
  for (Joint& joint : joints_) joint.guard.hold();
}

// Nothing is published while the joints are where they shall be, and the node has got that.
void TopicHardware::publish_goals(Time now) {
  bool news = false;
  for (std::size_t i = 0, row = 0; i < joints_.size(); ++i) {
    if (!setup_.joints[i].commanded) continue;
    const JointGuard& guard = joints_[i].guard;
    const double goal = guard.sent_goal();
    news = news || !(std::abs(goal - guard.position()) <= setup_.threshold) ||
           !(std::abs(goal - published_[row]) <= setup_.threshold);
    message_.position[row++] = goal;
  }
  if (!news) return;
  std::ranges::copy(message_.position, published_.begin());
  message_.header.stamp = to_time_msg(bus_.stamp(now));
  topic_.publish(message_, now);
}

void TopicHardware::fill_states(std::span<double> states) const {
  for (std::size_t i = 0; i < states.size(); ++i) {
    const Joint& joint = joints_[state_sources_[i].joint];
    const bool guarded = setup_.joints[state_sources_[i].joint].commanded && state_ != DriverState::connected;
    const std::array values{guarded ? joint.guard.position() : joint.position, joint.velocity, joint.effort};
    if (const double value = values[state_sources_[i].field]; std::isfinite(value)) states[i] = value;
  }
}

// -- for people

void TopicHardware::attend() {
  for (std::size_t i = 0; i < joints_.size(); ++i)
    log_guard_events(std::exchange(joints_[i].events, 0), setup_.component, setup_.joints[i].name, *log_);
  find_echo();
  const unsigned events = std::exchange(events_, 0), fresh = events & ~known_events_;
  known_events_ |= events & (kLate | kOutOfOrder | kNoStamp);
  const auto warn = [&](unsigned event, const std::string& text) {
    if ((fresh & event) != 0) log_->warning(setup_.component, text);
  };
  warn(kDegraded, fmt::format("no whole state on '{}' for {} of its intervals; all joints hold",
                              setup_.states, setup_.max_lost_replies));
  if ((fresh & kRecovered) != 0) log_->note(setup_.component, "the states of all joints arrive again");
  warn(kLate, fmt::format("states on '{}' arrive {:g} s later than others did; they are dropped",
                          setup_.states, setup_.max_delay));
  warn(kSetBack, fmt::format("the clock of the node that publishes '{}' was set back; its states count again",
                             setup_.states));
  warn(kOutOfOrder, fmt::format("states on '{}' are not newer than those before them, by their stamps; they "
                                "are dropped",
                                setup_.states));
  if ((fresh & kNoStamp) != 0)
    log_->note(setup_.component, fmt::format("the states on '{}' have no stamps: late ones cannot be told "
                                             "from fresh ones",
                                             setup_.states));
  if (state_ != DriverState::connected || warned_of_silence_ || bus_.now() - configured_ < kSilence) return;
  if (const Status ready = readiness(); !ready) {
    warned_of_silence_ = true;
    log_->warning(setup_.component, ready.why() + "; doppel topic list shows what is published");
  }
}

// States of this program's own broadcaster would be fresh for ever, whatever the arm does.
void TopicHardware::find_echo() {
  if (node_ == nullptr || bus_.graph_version() == seen_graph_) return;
  seen_graph_ = bus_.graph_version();
  const std::string name = bus_.names().resolve(NameKind::topic, setup_.states, node_->name());
  for (const TopicInfo& topic : bus_.topics()) {
    if (topic.name != name) continue;
    const auto local = std::ranges::find(topic.publishers, "", &EndpointInfo::edge);
    if (local != topic.publishers.end()) echo_ = local->node;
  }
}

std::string TopicHardware::fault() const {
  if (!echo_.empty())
    return fmt::format(
        "'{}' of this program publishes on '{}', where the states of the arm are read; choose "
        "another joint_states_topic",
        echo_, setup_.states);
  return fmt::format("no state of all joints has arrived on '{}' for {:g} s", setup_.states,
                     setup_.fault_after);
}

bool TopicHardware::report(DeviceReport& out) {
  out.state = setup_.gentle && state_ == DriverState::active ? "gentle" : to_string(state_);
  out.port = setup_.states;
  out.cycles = messages_;
  out.lost = lost_;
  out.damaged = late_ + disordered_;
  out.joints.clear();
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    if (!setup_.joints[i].commanded) continue;
    const Joint& joint = joints_[i];
    DeviceReport::Joint& row = out.joints.emplace_back();
    row.name = setup_.joints[i].name;
    row.id = static_cast<int>(i);
    row.position = joint.position;
    row.goal = state_ == DriverState::connected ? kNaN : joint.guard.sent_goal();
    row.velocity = joint.velocity;
    row.load = load(i);
    row.current = row.voltage = row.temperature = kNaN;
    row.age = joint.seen == Time{} ? kNaN : to_seconds(now_ - joint.seen);
  }
  return true;
}

void register_topic_hardware(HardwareRegistry& registry, Bus& bus, const std::string& name_space) {
  for (const std::string_view plugin : topic_plugins())
    registry.replace(std::string(plugin), HardwareKind::real,
                     [&bus, name_space] { return std::make_unique<TopicHardware>(bus, name_space); });
}

}  // namespace doppel
