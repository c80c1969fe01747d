#include "doppel/devices/commissioning/nudge.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/names.h"

namespace doppel {
namespace {

constexpr Duration kPeriod{20'000'000};
constexpr double kMoved = 0.015;  // rad: some ten ticks
constexpr double kFollows = 1.0 / 3;

class Nudge {
 public:
  Nudge(ServoBus& bus, const ServoSetup& setup, const JointServo& servo, const NudgeOptions& options)
      : bus_(bus), setup_(setup), servo_(servo), options_(options), readings_(setup.joints.size()) {
    for (const JointServo& one : setup.joints) servos_.push_back({one.id, one.model});
    index_ = static_cast<std::size_t>(&servo - setup.joints.data());
  }

  NudgeResult run() {
    bus_.begin_cycle(servos_, false);
    read();
    for (const ServoReading& one : readings_) begin_.push_back(one.position);
    const double q = servo_.joint_position(begin_[index_]);
    if (q < servo_.lower - kMoved || q > servo_.upper + kMoved)
      throw InputError("hardware.outside", servo_.source,
                       fmt::format("'{}' is at {:.3f} rad, outside of its limits {:.3f} to {:.3f}",
                                   servo_.joint, q, servo_.lower, servo_.upper),
                       "move it inside by hand");
    const double way = q < (servo_.lower + servo_.upper) / 2 ? options_.angle : -options_.angle;
    torque_on();
    move(q, q + way);
    NudgeResult out;
    out.moved = std::copysign(1.0, way) * (position(index_) - q);
    for (std::size_t i = 0; i < readings_.size(); ++i) {
      const double moved = position(i) - setup_.joints[i].joint_position(begin_[i]);
      if (i != index_ && std::abs(moved) > kMoved) out.others.push_back({setup_.joints[i].joint, moved});
    }
    if (!ended_) move(q + way, q);
    out.returned = position(index_) - q;
    out.peak_load = peak_;
    out.ended = ended_;
    torque_back();
    return out;
  }

 private:
  [[noreturn]] void refuse() const {
    throw InputError("hardware.no_answer", servo_.source,
                     fmt::format("'{}' (id {}) does not answer", servo_.joint, servo_.id),
                     "its cable and supply; doppel hardware check");
  }
  [[nodiscard]] double position(std::size_t joint) const {
    return setup_.joints[joint].joint_position(readings_[joint].position);
  }
  void read() {
    constexpr int kTries = 3;
    for (int i = 0; i < kTries; ++i) {
      if (bus_.read_all(readings_) == readings_.size()) return;
    }
    if (!readings_[index_].fresh) refuse();
  }
  [[nodiscard]] const ServoRegister& which(ServoRole role) const { return *servo_.model->find(role); }
  void write(ServoRole role, std::int64_t value) {
    if (!bus_.write(servo_.id, which(role), value)) refuse();
  }
  void torque_on() {
    was_on_ = bus_.read(servo_.id, which(ServoRole::torque_enable)).value_or(0) != 0;
    limit_ = bus_.read(servo_.id, which(ServoRole::torque_limit)).value_or(servo_.model->whole_torque);
    write_goal(servo_.joint_position(begin_[index_]));
    write(ServoRole::torque_limit,
          std::llround(options_.torque * static_cast<double>(servo_.model->whole_torque)));
    write(ServoRole::torque_enable, 1);
  }
  void torque_back() {
    write(ServoRole::torque_limit, limit_);
    if (!was_on_) write(ServoRole::torque_enable, 0);
  }
  void write_goal(double q) {
    write(ServoRole::goal_position, std::llround(servo_.model->ticks(servo_.shaft(q))));
  }
  // In small steps, at rest at both ends.
  void move(double start, double goal) {
    const auto steps = static_cast<int>(std::ceil(options_.seconds / to_seconds(kPeriod)));
    for (int i = 1; i <= steps && !ended_; ++i) {
      const double s = static_cast<double>(i) / steps;
      write_goal(start + s * s * (3 - 2 * s) * (goal - start));
      bus_.link().wait_until(bus_.link().now() + kPeriod);
      read();
      peak_ = std::max(peak_, std::abs(readings_[index_].load));
      ended_ = options_.ends && options_.ends();
    }
    constexpr int kSettle = 10;
    for (int i = 0; i < kSettle; ++i) bus_.link().wait_until(bus_.link().now() + kPeriod);
    read();
  }

  ServoBus& bus_;
  const ServoSetup& setup_;
  const JointServo& servo_;
  const NudgeOptions& options_;
  std::vector<BusServo> servos_;
  std::vector<ServoReading> readings_;
  std::vector<double> begin_;  // shafts
  std::size_t index_ = 0;
  bool was_on_ = false, ended_ = false;
  std::int64_t limit_ = 0;
  double peak_ = 0;
};

}  // namespace

bool NudgeResult::followed(double angle) const {
  return std::abs(moved - std::abs(angle)) <= kFollows * std::abs(angle);
}

NudgeResult nudge(ServoBus& bus, const ServoSetup& setup, const std::string& joint,
                  const NudgeOptions& options) {
  const auto servo = std::ranges::find(setup.joints, joint, &JointServo::joint);
  if (servo == setup.joints.end()) {
    std::vector<std::string> names;
    for (const JointServo& one : setup.joints) names.push_back(one.joint);
    throw InputError("hardware.unknown_joint", {},
                     fmt::format("no servo drives '{}'{}", joint, did_you_mean(joint, names)));
  }
  return Nudge(bus, setup, *servo, options).run();
}

}  // namespace doppel
