#include "doppel/devices/commissioning/recovery.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/base/core/diagnostic.h"
#include "doppel/devices/commissioning/detail/slow_joint.h"

namespace doppel {
namespace {

constexpr double kInside = 2 * 0.0174532925;  // rad, behind the limit
constexpr double kWithin = 0.005;             // rad: a few ticks
constexpr double kSlowestStep = 1.5;          // of the mean speed of a move that is at rest at both ends

Recovery way_back(const JointServo& servo, double q) {
  const double margin = std::min(kInside, (servo.upper - servo.lower) / 4);
  Recovery out;
  out.start = out.end = out.goal = q;
  out.is_inside = q >= servo.lower - kWithin && q <= servo.upper + kWithin;
  if (!out.is_inside) out.goal = std::clamp(q, servo.lower + margin, servo.upper - margin);
  return out;
}

}  // namespace

Recovery plan_recovery(ServoBus& bus, const ServoSetup& setup, const std::string& joint) {
  const JointServo& servo = servo_named(setup, joint);
  const std::function<bool()> never;
  SlowJoint slow(bus, setup, servo, 0, never);
  slow.read();
  return way_back(servo, slow.position());
}

Recovery recover(ServoBus& bus, const ServoSetup& setup, const std::string& joint,
                 const RecoveryOptions& options) {
  const JointServo& servo = servo_named(setup, joint);
  SlowJoint slow(bus, setup, servo, options.torque, options.ends);
  slow.read();
  Recovery out = way_back(servo, slow.position());
  if (out.is_inside) return out;
  // A servo whose own limits exclude the place where it is goes to the nearest goal that it accepts, so
  // that the speed is bounded before the torque is on.
  slow.set_speed(options.speed);
  if (!slow.torque_on(out.start) && !slow.torque_on(out.goal))
    throw InputError("hardware.no_recovery", servo.source,
                     fmt::format("'{}' (id {}) accepts neither its position nor its limit as a goal",
                                 servo.joint, servo.id),
                     "doppel hardware check; or move it inside by hand");
  slow.move(out.start, out.goal, kSlowestStep * std::abs(out.goal - out.start) / options.speed);
  out.end = slow.position();
  out.ended = slow.ended();
  out.is_inside = way_back(servo, out.end).is_inside;
  slow.set_speed(0);
  return out;
}

}  // namespace doppel
