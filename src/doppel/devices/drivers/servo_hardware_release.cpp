// The driver's part for a short release of one joint's torque (JointRelease): the others hold, the cycle
// watches the joint, and it is caught by the steps of an activation: goal = position, then the torque.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/control/hardware/nan.h"
#include "doppel/devices/drivers/detail/release_watch.h"
#include "doppel/devices/drivers/detail/servo_group.h"
#include "doppel/devices/drivers/servo_hardware.h"

namespace doppel {
namespace {

constexpr unsigned kCatchReasons = 8;

// The first joint whose goal a controller moves, but for the released one.
std::optional<std::size_t> moved_joint(const ServoSetup& setup, const JointReleases& releases, Time now) {
  for (std::size_t i = 0; i < releases.goals.size(); ++i) {
    if (releases.joint != i && setup.joints[i].enabled && !releases.goals[i].is_at_rest(now)) return i;
  }
  return std::nullopt;
}

const char* text_of(CatchReason reason) {
  switch (reason) {
    case CatchReason::time:
      return "its time was over";
    case CatchReason::interval:
      return "it has left its interval";
    case CatchReason::speed:
      return "it was at the speed at which it is caught";
    case CatchReason::silence:
      return "its answers were missing";
    case CatchReason::stop:
    case CatchReason::none:
      break;
  }
  return "the arm was stopped, or another joint moved";
}

}  // namespace

Status ServoHardware::check_release(const JointRelease& release, std::size_t joint) const {
  const JointServo& servo = setup_.joints[joint];
  const auto refused = [&](std::string_view why) {
    return Status::refused(fmt::format("'{}' is not released: {}", servo.joint, why));
  };
  if (group_->believes())
    return refused("its servo reports no positions, so that it could not be caught where it is");
  if (!servo.enabled) return refused("it is not enabled, and has no torque");
  const DriverState now = state();
  if ((now != DriverState::active && now != DriverState::holding) || stopped_ || parking_ || lost_ > 0)
    return refused(fmt::format("the arm is {}", stopped_   ? "stopped"
                                                : parking_ ? "parking"
                                                           : to_string(now)));
  if (gentle_)
    return refused(
        "the arm is gentle, and its joints are not confirmed; doppel hardware check and doppel hardware "
        "nudge come first");
  if (torque_set_ < 1) return refused("the torque still rises after the activation");
  if (release_->joint) return refused(fmt::format("'{}' is released", setup_.joints[*release_->joint].joint));
  if (!(release.duration > 0 && release.duration <= kMaxRelease))
    return refused(
        fmt::format("its duration is {:g} s, and may be at most {:g} s", release.duration, kMaxRelease));
  const double q = guards_[joint].position();
  if (!(release.lower < q && q < release.upper && release.speed > 0))
    return refused(fmt::format("it is at {:.4g}, not within {:.4g} to {:.4g}, or its speed is not positive",
                               q, release.lower, release.upper));
  const Time when = link_->now();
  if (const auto moved = moved_joint(setup_, *release_, when))
    return refused(fmt::format("'{}' is moved by a controller", setup_.joints[*moved].joint));
  if (!release_->positions[joint].is_at_rest(when)) return refused("it is not at rest");
  return {};
}

Status ServoHardware::release_joint(const JointRelease& release) {
  const auto servo = std::ranges::find(setup_.joints, release.joint, &JointServo::joint);
  if (servo == setup_.joints.end())
    return Status::refused(
        fmt::format("'{}' has no servo with the name '{}'", setup_.component, release.joint));
  if (group_ == nullptr) return Status::refused("it is not connected");
  const auto joint = static_cast<std::size_t>(servo - setup_.joints.begin());
  if (Status safe = check_release(release, joint); !safe) return safe;
  JointRelease bounds = release;
  bounds.lower = std::max(bounds.lower, servo->lower);
  bounds.upper = std::min(bounds.upper, servo->upper);
  bounds.speed = std::min(bounds.speed, servo->velocity);
  if (!(bounds.lower < bounds.upper)) return Status::refused("its interval is outside of the joint's limits");
  Status off = group_->release(joint);
  // Without a confirmation the torque may be off.
  release_->joint = joint;
  release_->watch.begin(bounds, guards_[joint].position(), link_->now());
  release_->torque_off[joint] = loop_time();
  release_->torque_on[joint] = Time{};
  if (!off) {
    release_->watch.stop();
    catch_released();
  }
  publish_report();
  return off;
}

// The loop's time of now: the link's clock has another zero.
Time ServoHardware::loop_time() const {
  return release_->read_when + (link_->now() - release_->read_at);
}

void ServoHardware::watch_release() {
  if (!release_->joint) return;
  const JointServo& servo = setup_.joints[*release_->joint];
  const ServoReading& reading = readings_[*release_->joint];
  const bool others_move = moved_joint(setup_, *release_, link_->now()).has_value();
  if (parking_ || others_move || state_ == DriverState::degraded) release_->watch.stop();
  const double rate = servo.direction / servo.scale;
  const CatchReason reason = release_->watch.take(reading.fresh, servo.joint_position(reading.position),
                                                  rate * reading.velocity, link_->now());
  if (reason != CatchReason::none) catch_released();
}

// Not confirmed: it is tried again in the next cycle.
void ServoHardware::catch_released() {
  if (!release_->joint || group_ == nullptr) return;
  release_->watch.stop();
  const std::size_t joint = *release_->joint;
  const std::optional<double> shaft = group_->catch_joint(joint);
  if (!shaft) return;
  guards_[joint].begin(setup_.joints[joint].joint_position(*shaft), link_->now());
  release_->torque_on[joint] = loop_time();
  release_->joint.reset();
  release_->waits[joint] = true;
  caught_ = static_cast<unsigned>(joint) * kCatchReasons + static_cast<unsigned>(release_->watch.reason());
}

// The command of controllers for a joint; NaN: nothing that it follows.
double ServoHardware::followed(std::size_t joint, double command) {
  if (release_->joint == joint) return kNaN;
  if (release_->waits[joint] && std::abs(command - guards_[joint].sent_goal()) <= kRejoin)
    release_->waits[joint] = false;
  return release_->waits[joint] ? kNaN : command;
}

void ServoHardware::log_catch() {
  const unsigned caught = caught_.exchange(0);
  if (caught == 0) return;
  const std::size_t joint = caught / kCatchReasons;
  log_->note(
      setup_.component,
      fmt::format("'{}' is held again, because {}; it follows commands again from the first one that is "
                  "within {:g} of where it is",
                  setup_.joints[joint].joint, text_of(static_cast<CatchReason>(caught % kCatchReasons)),
                  kRejoin));
}

}  // namespace doppel
