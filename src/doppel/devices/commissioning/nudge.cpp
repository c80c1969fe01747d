#include "doppel/devices/commissioning/nudge.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "doppel/base/core/diagnostic.h"
#include "doppel/devices/commissioning/detail/slow_joint.h"

namespace doppel {
namespace {

constexpr double kMoved = 0.015;  // rad: some ten ticks
constexpr double kFollows = 1.0 / 3;

[[noreturn]] void refuse_outside(const JointServo& servo, double q) {
  throw InputError(
      "hardware.outside", servo.source,
      fmt::format("'{}' is at {:.3f} rad, outside of its limits {:.3f} to {:.3f}", servo.joint, q,
                  servo.lower, servo.upper),
      fmt::format("doppel hardware recover --joint \"{}\", or move it inside by hand", servo.joint));
}

// A joint that is not seen is not one that stands still.
void refuse_silent(const std::vector<const JointServo*>& silent, const JointServo& servo) {
  if (silent.empty()) return;
  std::vector<std::string> names;
  for (const JointServo* const one : silent)
    names.push_back(fmt::format("'{}' (id {})", one->joint, one->id));
  throw InputError("hardware.no_answer", silent.front()->source,
                   fmt::format("{} {} not answer, and may move with '{}'", fmt::join(names, ", "),
                               names.size() == 1 ? "does" : "do", servo.joint),
                   "its cable and supply; doppel hardware check");
}

// A servo that falls silent on its way may hear what it does not answer.
void move_or_release(SlowJoint& slow, double start, double goal, double seconds) {
  try {
    slow.move(start, goal, seconds);
  } catch (const InputError&) {
    try {
      slow.torque_back();
    } catch (const InputError&) {
      // The first error names the servo already.
    }
    throw;
  }
}

}  // namespace

bool NudgeResult::followed(double angle) const {
  return std::abs(moved - std::abs(angle)) <= kFollows * std::abs(angle);
}

NudgeResult nudge(ServoBus& bus, const ServoSetup& setup, const std::string& joint,
                  const NudgeOptions& options) {
  const JointServo& servo = servo_named(setup, joint);
  SlowJoint slow(bus, setup, servo, options.torque, options.ends);
  slow.read();
  refuse_silent(slow.silent(), servo);
  std::vector<double> begin;
  for (std::size_t i = 0; i < setup.joints.size(); ++i) begin.push_back(slow.position(i));
  const double q = slow.position();
  if (q < servo.lower - kMoved || q > servo.upper + kMoved) refuse_outside(servo, q);
  NudgeResult out;
  out.way = q < (servo.lower + servo.upper) / 2 ? options.angle : -options.angle;
  if (!slow.torque_on(q)) refuse_outside(servo, q);
  move_or_release(slow, q, q + out.way, options.seconds);
  out.moved = std::copysign(1.0, out.way) * (slow.position() - q);
  const std::vector<const JointServo*> silent = slow.silent();
  for (std::size_t i = 0; i < begin.size(); ++i) {
    const double moved = slow.position(i) - begin[i];
    if (&setup.joints[i] != &servo && std::abs(moved) > kMoved)
      out.others.push_back({setup.joints[i].joint, moved});
  }
  if (!slow.ended()) move_or_release(slow, q + out.way, q, options.seconds);
  out.returned = slow.position() - q;
  out.peak_load = slow.peak_load();
  out.ended = slow.ended();
  slow.torque_back();
  // A motion that a person has ended says nothing of the others anyway.
  if (!out.ended) refuse_silent(silent, servo);
  return out;
}

}  // namespace doppel
