#include "doppel/devices/commissioning/detail/slow_joint.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/base/core/diagnostic.h"

namespace doppel {
namespace {

constexpr Duration kSlowPeriod{20'000'000};

}  // namespace

SlowJoint::SlowJoint(ServoBus& bus, const ServoSetup& setup, const JointServo& servo, double torque,
                     const std::function<bool()>& ends)
    : bus_(bus),
      setup_(setup),
      servo_(servo),
      torque_(torque),
      ends_(ends),
      readings_(setup.joints.size()),
      answered_(setup.joints.size()) {
  for (const JointServo& one : setup.joints) servos_.push_back({one.id, one.model});
  index_ = static_cast<std::size_t>(&servo - setup.joints.data());
  bus_.begin_cycle(servos_, false);
}

void SlowJoint::refuse() const {
  throw InputError("hardware.no_answer", servo_.source,
                   fmt::format("'{}' (id {}) does not answer", servo_.joint, servo_.id),
                   "its cable and supply; doppel hardware check");
}

double SlowJoint::position(std::size_t joint) const {
  return setup_.joints[joint].joint_position(readings_[joint].position);
}

void SlowJoint::read() {
  constexpr int kTries = 3;
  answered_.assign(readings_.size(), false);
  for (int i = 0; i < kTries; ++i) {
    const bool whole = bus_.read_all(readings_) == readings_.size();
    for (std::size_t joint = 0; joint < readings_.size(); ++joint)
      answered_[joint] = answered_[joint] || readings_[joint].fresh;
    if (whole) return;
  }
  if (!answered_[index_]) refuse();
}

std::vector<const JointServo*> SlowJoint::silent() const {
  std::vector<const JointServo*> out;
  for (std::size_t joint = 0; joint < answered_.size(); ++joint) {
    if (!answered_[joint]) out.push_back(&setup_.joints[joint]);
  }
  return out;
}

std::int64_t SlowJoint::read(ServoRole role) {
  const auto out = bus_.read(servo_.id, which(role));
  if (!out) refuse();
  return *out;
}

void SlowJoint::write(ServoRole role, std::int64_t value) {
  if (!bus_.write(servo_.id, which(role), value)) refuse();
}

bool SlowJoint::write_goal(double q) {
  return bus_.write(servo_.id, which(ServoRole::goal_position),
                    std::llround(servo_.model->ticks(servo_.shaft(q))));
}

bool SlowJoint::torque_on(double q) {
  was_on_ = read(ServoRole::torque_enable) != 0;
  limit_ = read(ServoRole::torque_limit);
  if (!write_goal(q)) return false;
  write(ServoRole::torque_limit, std::llround(torque_ * static_cast<double>(servo_.model->whole_torque)));
  if (bus_.write(servo_.id, which(ServoRole::torque_enable), 1)) return true;
  // The torque may be on, with a confirmation that is lost: nothing would switch it off later.
  if (!was_on_) static_cast<void>(bus_.write(servo_.id, which(ServoRole::torque_enable), 0));
  refuse();
}

// The torque goes off first, and without a confirmation of the limit, too: a joint that was free does not
// stay held.
void SlowJoint::torque_back() {
  const bool is_off = was_on_ || bus_.write(servo_.id, which(ServoRole::torque_enable), 0);
  const bool is_limited = bus_.write(servo_.id, which(ServoRole::torque_limit), limit_);
  if (!is_off || !is_limited) refuse();
}

void SlowJoint::set_speed(double speed) {
  const double ticks = std::abs(speed * servo_.scale) / servo_.model->velocity_unit;
  write(ServoRole::goal_velocity, speed > 0 ? std::max(1LL, std::llround(ticks)) : 0);
}

void SlowJoint::move(double start, double goal, double seconds) {
  const auto steps = static_cast<int>(std::ceil(seconds / to_seconds(kSlowPeriod)));
  for (int i = 1; i <= steps && !ended_; ++i) {
    const double s = static_cast<double>(i) / steps;
    // Beyond its own limits a servo accepts no goal, and stays on its way to the last one.
    static_cast<void>(write_goal(start + s * s * (3 - 2 * s) * (goal - start)));
    bus_.link().wait_until(bus_.link().now() + kSlowPeriod);
    read();
    peak_ = std::max(peak_, std::abs(readings_[index_].load));
    ended_ = ends_ && ends_();
  }
  constexpr int kSettle = 10;
  for (int i = 0; i < kSettle; ++i) bus_.link().wait_until(bus_.link().now() + kSlowPeriod);
  read();
}

}  // namespace doppel
