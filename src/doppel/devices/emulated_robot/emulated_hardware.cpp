#include "doppel/devices/emulated_robot/emulated_hardware.h"

#include <algorithm>

#include "doppel/control/hardware/nan.h"

namespace doppel {

EmulatedHardware::EmulatedHardware(Instance robot, const EmulationOptions& options)
    : ServoHardware([this](const ServoSetup& setup) {
        auto out = std::make_unique<EmulatedLink>(*devices_, "emulated bus", setup.rate);
        link_ = out.get();
        link_->follow(robot_.engine().time());
        return out;
      }),
      robot_(robot),
      options_(options) {
  if (!options.faults.empty()) faults_.emplace(options.faults);
}

Status EmulatedHardware::on_init(const HardwareInfo& info) {
  Status out = ServoHardware::on_init(info);
  if (!out) return out;
  log_ = &info.log;
  devices_ = emulated_devices(setup(), options_.seed);
  if (faults_) {
    if (auto first = faults_->read_if_changed(robot_.engine().time()))
      devices_->set_faults(std::move(*first));
  }
  motors_ = std::make_unique<EngineMotors>(setup(), robot_, options_.servos.has_value());
  if (options_.hand == HandMotion::guide) motors_->guide(std::vector(setup().joints.size(), kNaN));
  // The servos measure where the joints are before the first step.
  motors_->step(*devices_, robot_, robot_.engine().time(), robot_.engine().world().settings().step);
  return out;
}

// The port is open. Its clock stands still between two cycles, and an answer would come later than expected.
void EmulatedHardware::follow_time() {
  if (link_ != nullptr) link_->follow(robot_.engine().time());
}

Status EmulatedHardware::on_activate() {
  follow_time();
  return ServoHardware::on_activate();
}

Status EmulatedHardware::on_deactivate() {
  follow_time();
  return ServoHardware::on_deactivate();
}

Status EmulatedHardware::on_error() {
  follow_time();
  return ServoHardware::on_error();
}

void EmulatedHardware::on_stop() {
  follow_time();
  ServoHardware::on_stop();
}

Status EmulatedHardware::relax() {
  follow_time();
  return ServoHardware::relax();
}

Status EmulatedHardware::release_joint(const JointRelease& release) {
  follow_time();
  return ServoHardware::release_joint(release);
}

Status EmulatedHardware::confirm_pose(std::span<const std::pair<std::string, double>> positions) {
  follow_time();
  return ServoHardware::confirm_pose(positions);
}

HardwareReturn EmulatedHardware::read(Time now, Duration period, std::span<double> states) {
  follow_time();
  return ServoHardware::read(now, period, states);
}

void EmulatedHardware::attend() {
  ServoHardware::attend();
  if (!faults_ || devices_ == nullptr) return;
  if (auto fresh = read_again(*faults_, robot_.engine().time(), *log_, setup().component))
    devices_->set_faults(std::move(*fresh));
}

void EmulatedHardware::before_step() {
  motors_->step(*devices_, robot_, robot_.engine().time(), robot_.engine().world().settings().step);
}

bool EmulatedHardware::guide(std::string_view joint, double position) {
  const auto servo = std::ranges::find(setup().joints, joint, &JointServo::joint);
  if (options_.hand != HandMotion::guide || servo == setup().joints.end()) return false;
  motors_->guide(static_cast<std::size_t>(servo - setup().joints.begin()),
                 std::clamp(position, servo->lower, servo->upper));
  return true;
}

void EmulatedHardware::rebind(Instance robot) {
  robot_ = robot;
  if (motors_ != nullptr) motors_->rebind(robot);
}

void register_emulated_hardware(HardwareRegistry& registry, Instance robot, const EmulationOptions& options) {
  for (const ServoPlugin& plugin : servo_plugins())
    registry.replace(std::string(plugin.name), HardwareKind::emulated,
                     [robot, options] { return std::make_unique<EmulatedHardware>(robot, options); });
}

}  // namespace doppel
