#include "doppel/devices/emulated_robot/emulated_port.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "doppel/base/core/guarded_thread.h"
#include "doppel/devices/emulated_robot/detail/hand_sweep.h"

namespace doppel {
namespace {

constexpr Duration kPoll{2'000'000};  // until the thread looks whether it is to end

}  // namespace

EmulatedPort::EmulatedPort(Instance robot, const EmulationOptions& options)
    : robot_(robot), options_(options) {
  if (!options.faults.empty()) faults_.emplace(options.faults);
}

EmulatedPort::~EmulatedPort() {
  stop_serving();
}

Status EmulatedPort::on_init(const HardwareInfo& info) {
  setup_ = read_servo_setup(info.description, info.model, info.diagnostics);
  log_ = &info.log;
  devices_ = emulated_devices(setup_, options_.seed);
  motors_ = std::make_unique<EngineMotors>(setup_, robot_, options_.servos.has_value());
  if (faults_) static_cast<void>(read_fault_file(options_.faults, Time{}));  // its errors are bad input
  hand_.assign(setup_.joints.size(), kNaN);
  if (options_.hand == HandMotion::sweep) sweep_ = std::make_unique<HandSweep>(setup_.joints);
  if (!options_.trace.empty()) {
    trace_.open(options_.trace);
    if (!trace_)
      throw InputError("emulate.trace", {}, fmt::format("{} cannot be written", options_.trace.string()),
                       "choose another file for --trace");
  }
  for (const HardwareJointDescription& joint : info.description.joints) {
    const auto servo = std::ranges::find(setup_.joints, joint.name, &JointServo::joint);
    if (options_.hand == HandMotion::guide && servo != setup_.joints.end()) {
      commands_.push_back({joint.name, kPosition, kNaN});
      guided_.push_back(static_cast<std::size_t>(servo - setup_.joints.begin()));
    }
    for (const HardwareInterfaceDescription& state : joint.state_interfaces) {
      Source source;
      source.joint = info.model.find_joint(joint.name);
      if (state.name == kPosition) source.quantity = Quantity::position;
      if (state.name == kVelocity) source.quantity = Quantity::velocity;
      if (state.name == kEffort) source.quantity = Quantity::effort;
      if (source.joint < 0) source.quantity = Quantity::other;
      sources_.push_back(source);
      states_.push_back({joint.name, state.name, state.initial_value.value_or(0.0)});
    }
  }
  return {};
}

Status EmulatedPort::on_configure() {
  ends_ = false;
  terminal_ = std::make_unique<PseudoTerminal>();
  start_ = terminal_->now();
  if (faults_) {
    faults_.emplace(options_.faults);
    if (auto first = faults_->read_if_changed(start_)) devices_->set_faults(std::move(*first));
  }
  {
    const std::lock_guard held(mutex_);
    if (options_.hand != HandMotion::none) motors_->guide(hand_);
    motors_->step(*devices_, robot_, terminal_->now(), robot_.engine().world().settings().step);
  }
  server_ = guarded_thread(
      [this] { serve(); },
      [this](const std::string& why) { log_->error(setup_.component, "the emulated bus: " + why); });
  note_ = std::make_unique<EmulatedPortNote>(terminal_->name(), setup_.component + ", emulated");
  log_->note(setup_.component, fmt::format("{} at {} bit/s, {} servos, behind {}", to_string(setup_.protocol),
                                           setup_.rate, setup_.joints.size(), terminal_->name()));
  return {};
}

Status EmulatedPort::on_cleanup() {
  stop_serving();
  note_.reset();
  terminal_.reset();
  return {};
}

void EmulatedPort::stop_serving() {
  ends_ = true;
  if (server_.joinable()) server_.join();
}

// Bytes of the host go to the devices as they come, and those of the devices to the host when they have
// arrived.
void EmulatedPort::serve() {
  std::array<std::uint8_t, 512> bytes{};
  while (!ends_) {
    std::optional<Time> next;
    {
      const std::lock_guard held(mutex_);
      next = devices_->next_arrival();
    }
    const Time now = terminal_->now();
    const std::size_t count = terminal_->read(bytes, std::min(now + kPoll, next.value_or(now + kPoll)));
    std::size_t sent = 0;
    std::array<std::uint8_t, 512> answer{};
    {
      const std::lock_guard held(mutex_);
      const int rate = terminal_->rate() > 0 ? terminal_->rate() : setup_.rate;
      if (count > 0) devices_->receive(std::span(bytes).first(count), now, rate);
      sent = devices_->take(answer, terminal_->now());
    }
    trace('>', std::span(bytes).first(count), now);
    trace('<', std::span(answer).first(sent), now);
    if (sent > 0) static_cast<void>(terminal_->write(std::span(answer).first(sent)));
  }
}

// A line for each piece: seconds, the direction (> from the host, < to it), the bytes.
void EmulatedPort::trace(char direction, std::span<const std::uint8_t> bytes, Time when) {
  if (!trace_.is_open() || bytes.empty()) return;
  trace_ << fmt::format("{:.6f} {} {:02X}\n", to_seconds(when - start_), direction, fmt::join(bytes, " "));
  if (trace_.flush()) return;
  trace_.close();
  log_->error(setup_.component, fmt::format("{} cannot be written; the trace ends", options_.trace.string()));
}

HardwareReturn EmulatedPort::write(Time /*now*/, Duration /*period*/, std::span<const double> commands) {
  for (std::size_t i = 0; i < guided_.size(); ++i) hand_[guided_[i]] = commands[i];
  return HardwareReturn::ok;
}

void EmulatedPort::attend() {
  if (!faults_ || terminal_ == nullptr) return;
  auto fresh = read_again(*faults_, terminal_->now(), *log_, setup_.component);
  if (!fresh) return;
  const std::lock_guard held(mutex_);
  devices_->set_faults(std::move(*fresh));
}

HardwareReturn EmulatedPort::read(Time /*now*/, Duration /*period*/, std::span<double> states) {
  const Model& model = robot_.model();
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (sources_[i].quantity == Quantity::other) continue;
    const auto joint = static_cast<std::size_t>(sources_[i].joint);
    switch (sources_[i].quantity) {
      case Quantity::position:
        states[i] = robot_.q()[static_cast<std::size_t>(model.joints[joint].q)];
        break;
      case Quantity::velocity:
        states[i] = robot_.v()[static_cast<std::size_t>(model.joints[joint].v)];
        break;
      default:
        states[i] = robot_.drive_effort()[joint];
    }
  }
  return HardwareReturn::ok;
}

void EmulatedPort::before_step() {
  if (terminal_ == nullptr) return;
  const Time now = terminal_->now();
  if (sweep_ != nullptr) sweep_->positions(to_seconds(now - start_), hand_);
  const std::lock_guard held(mutex_);
  if (options_.hand != HandMotion::none) motors_->guide(hand_);
  motors_->step(*devices_, robot_, now, robot_.engine().world().settings().step);
}

void EmulatedPort::rebind(Instance robot) {
  robot_ = robot;
  if (motors_ != nullptr) motors_->rebind(robot);
}

void register_emulated_ports(HardwareRegistry& registry, Instance robot, const EmulationOptions& options) {
  for (const ServoPlugin& plugin : servo_plugins())
    registry.replace(std::string(plugin.name), HardwareKind::emulated,
                     [robot, options] { return std::make_unique<EmulatedPort>(robot, options); });
}

}  // namespace doppel
