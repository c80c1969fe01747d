// The driver's part for a person at the arm: its torque off, and a pose that it cannot measure.
#include "doppel/devices/drivers/detail/release_watch.h"
#include "doppel/devices/drivers/detail/servo_group.h"
#include "doppel/devices/drivers/pose_record.h"
#include "doppel/devices/drivers/servo_hardware.h"

namespace doppel {

Status ServoHardware::relax() {
  if (group_ == nullptr) return Status::refused("it is not connected");
  if (group_->believes())
    return Status::refused(
        "its servos report no positions; without pulses their positions are unknown, so that they are moved "
        "by commands");
  release_->joint.reset();  // it is not caught later, when a person has a hand there
  if (Status off = group_->relax(); !off) return off;
  state_ = DriverState::connected;
  return {};
}

Status ServoHardware::confirm_pose(std::span<const std::pair<std::string, double>> positions) {
  if (group_ == nullptr) return Status::refused("it is not connected");
  if (!group_->believes()) return HardwareComponent::confirm_pose(positions);
  try {
    check_pose(setup_, positions);
    group_->take_pose(positions);
  } catch (const InputError& problem) {
    const Diagnostic& first = problem.diagnostics().front();
    return Status::refused(first.fix.empty() ? first.message : first.message + "; " + first.fix);
  }
  unconfirmed_ = !group_->knows_pose();
  if (group_->read(readings_) == readings_.size()) begin_guards();
  return {};
}

std::string ServoHardware::awaits() const {
  if (!unconfirmed_) return {};
  return "the pose of the arm, which a person confirms on the page (Hardware), or with: doppel hardware "
         "confirm";
}

}  // namespace doppel
