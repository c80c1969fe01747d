#include "doppel/review/identification/test/drawn_servo.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

namespace doppel {
namespace {

using Quantity = ServoQuantity;

constexpr double kStep = 2e-5;    // s
constexpr double kPeriod = 0.01;  // s, of commands and samples
constexpr std::size_t kCount = 5400;
constexpr int kDrawnHarmonics = 5;
constexpr double kLiftTime = 4, kLiftedAt = 1.5, kFreeAt = 2.5, kHeldTime = 0.4;  // s, in a lift and release
constexpr double kMaxFallTime = 1.0, kMaxFall = 0.5, kMaxFallSpeed = 0.6;  // s, rad, of the speed limit

class Random {
 public:
  explicit Random(std::uint64_t seed) : bits_(seed) {}
  double even(double low, double high) {
    return low + (high - low) * static_cast<double>(bits_() >> 11U) * 0x1p-53;
  }
  double log_even(double low, double high) { return low * std::exp(even(0, std::log(high / low))); }

 private:
  std::mt19937_64 bits_;
};

std::vector<double> commands(Random& random) {
  constexpr double kOmega = 2 * std::numbers::pi * 0.2, kAmplitude = 0.9;
  std::array<double, kDrawnHarmonics> a{}, b{};
  for (int k = 0; k < kDrawnHarmonics; ++k) {
    a[static_cast<std::size_t>(k)] = random.even(-1, 1) / (k + 1);
    b[static_cast<std::size_t>(k)] = random.even(-1, 1) / (k + 1);
  }
  const auto series = [&](double t) {
    double sum = 0;
    for (int k = 0; k < kDrawnHarmonics; ++k) {
      const double angle = (k + 1) * kOmega * t;
      sum += a[static_cast<std::size_t>(k)] * std::sin(angle) +
             b[static_cast<std::size_t>(k)] * (std::cos(angle) - 1);
    }
    return sum;
  };
  double largest = 0;
  constexpr double kLength = 5;  // s, the period of the slowest harmonic
  for (int i = 0; i < static_cast<int>(kLength / kPeriod); ++i)
    largest = std::max(largest, std::abs(series(i * kPeriod)));
  constexpr std::array kLevels{0.5, -0.3, 0.9, 0.0, 0.2, -0.7, 0.6, 0.0};
  std::vector<double> out;
  for (std::size_t i = 0; i <= kCount; ++i) {
    const double t = static_cast<double>(i) * kPeriod;
    if (t < 30) {
      out.push_back(kAmplitude / largest * std::min({1.0, t / 2, (30 - t) / 2}) * series(t));
    } else if (t < 42) {
      out.push_back(kLevels[std::min(static_cast<std::size_t>((t - 30) / 1.5), kLevels.size() - 1)]);
    } else {
      const double u = std::fmod(t - 42, 6) / 6;
      out.push_back(0.6 * (u < 0.25 ? 4 * u : (u < 0.75 ? 2 - 4 * u : 4 * u - 4)));
    }
  }
  return out;
}

std::vector<double> small_steps() {
  constexpr double kSmallStep = 0.05, kDwell = 1.5;
  std::vector<double> out(kCount + 1, 0.0);
  for (std::size_t i = 0; i < kCount; ++i) {
    const auto count = static_cast<std::size_t>(static_cast<double>(i) * kPeriod / kDwell);
    out[i] = count % 2 == 0 ? -kSmallStep : kSmallStep;
  }
  return out;
}

// The law of physics/contract/servo.h, written as it is described there.
class Servo {
 public:
  Servo(const DrawnServo& servo, double command) : servo_(servo), target_(command), reference_(command) {
    load_ = servo.gravity * std::sin(command + servo.phase);
    q = command - load_ / of(Quantity::stiffness);
  }

  // A target of the command; after a rest the reference moves to it at the velocity limit.
  void aim(double target) {
    if (target == target_) return;
    const bool streams = since_ <= 0.05 + 1e-6;
    spread_time_ = streams ? since_ : 0.0;
    if (streams) {
      spread_ = std::abs(target - reference_) / since_;
    } else {
      share_ = 0.5;
    }
    target_ = target;
    since_ = 0;
  }

  void release() { on_ = false; }
  // The position is the goal.
  void catch_joint(double position) {
    on_ = true;
    target_ = position;
    reference_ = q;
    share_ = 0.5;
    since_ = 1;
    spread_time_ = 0;
  }
  [[nodiscard]] bool is_on() const { return on_; }

  void step() {
    const double stiffness = of(Quantity::stiffness), damping = of(Quantity::damping);
    const double effort = of(Quantity::effort), ahead = effort / stiffness;
    reference_ = std::clamp(reference_, q - ahead, q + ahead);
    const bool spreads = since_ < spread_time_ - 1e-9;
    const double fastest = of(Quantity::velocity), speed = spreads ? std::min(spread_, fastest) : fastest;
    if (spreads) set_share(speed);
    const double rate = std::clamp((target_ - reference_) / kStep, -speed, speed);
    reference_ += rate * kStep;
    since_ += kStep;
    const double drive =
        std::clamp(stiffness * (reference_ - q) + damping * (share_ * rate - v), -effort, effort);
    const double tau = on_ ? drive : 0.0;
    const double load = servo_.gravity * std::sin(q + servo_.phase);
    double friction = of(Quantity::friction) + of(Quantity::load_factor) * std::abs(tau);
    if (of(Quantity::breakaway) > 0)
      friction += of(Quantity::breakaway) * std::exp(-std::pow(v / of(Quantity::stribeck), 2));
    const double inertia = servo_.inertia + of(Quantity::armature);
    const double next = v + kStep * (tau - load - of(Quantity::viscous) * v) / inertia;
    const double lost = kStep * friction / inertia;
    v = std::abs(next) > lost ? next - std::copysign(lost, next) : 0.0;
    q += kStep * v;
  }

  double q = 0, v = 0;

 private:
  [[nodiscard]] double of(Quantity quantity) const {
    return servo_.values[static_cast<std::size_t>(quantity)];
  }

  void set_share(double speed) {
    const double rate = of(Quantity::stiffness) * kStep / of(Quantity::damping);
    const double growth = rate * (of(Quantity::velocity) - speed);
    if (spread_ > of(Quantity::velocity) * (1 + 1e-6)) {
      share_ = std::max(share_ - 0.05 * rate, 0.5);
    } else {
      share_ = speed * (1 - share_) > growth ? share_ + growth / speed : 1.0;
    }
  }

  const DrawnServo& servo_;
  double target_, reference_, share_ = 0.5, since_ = 1, load_ = 0;  // since_: s, the target's age
  bool on_ = true;
  double spread_ = 0, spread_time_ = 0;  // rad/s while a stream's target is approached, and for how long
};

constexpr auto kLiftCount = static_cast<std::size_t>(kLiftTime / kPeriod + 0.5);
constexpr auto kStepsPerPeriod = static_cast<std::size_t>(kPeriod / kStep + 0.5);

// Behind the motion, period by period: the commands of the lift, the release and the catch.
class LiftAndRelease {
 public:
  // The position with the larger moment of gravity.
  static double lift_of(const DrawnServo& servo) {
    constexpr double kLift = 0.9;
    return std::abs(std::sin(servo.phase + kLift)) > std::abs(std::sin(servo.phase - kLift)) ? kLift : -kLift;
  }
  LiftAndRelease(const DrawnServo& servo, double lift)
      : lift_(lift), fastest_(kMaxFallSpeed * servo.values[static_cast<std::size_t>(Quantity::velocity)]) {}

  [[nodiscard]] bool follows(std::size_t sample, const Servo& motion) const {
    return motion.is_on() && sample >= follows_;
  }
  void act(std::size_t period, Servo& motion, JointRecord& record) {
    if (period < kCount) return;
    const std::size_t in_lift = (period - kCount) % kLiftCount, begin = period - in_lift;
    const double now = static_cast<double>(period) * kPeriod;
    if (in_lift == 0) ramp(record.command, begin, record.command[begin]);
    if (in_lift == static_cast<std::size_t>(kFreeAt / kPeriod)) {
      motion.release();
      record.released.push_back({now, now + kMaxFallTime, 0, 0});
    }
    if (motion.is_on()) return;
    ReleasedSpan& span = record.released.back();
    if (now < span.end - 1e-9 && std::abs(motion.q - lift_) < kMaxFall && std::abs(motion.v) < fastest_)
      return;
    const double caught = std::round(motion.q / kTick4096) * kTick4096;
    motion.catch_joint(caught);
    span.end = now;
    span.caught = caught;
    // The next lift begins there; before, the servo does not follow.
    const std::size_t next = begin + kLiftCount;
    span.follows = static_cast<double>(next) * kPeriod;
    std::fill(record.command.begin() + static_cast<std::ptrdiff_t>(next), record.command.end(), caught);
    follows_ = next;
  }

 private:
  void ramp(std::vector<double>& command, std::size_t begin, double start) const {
    const auto count = static_cast<std::size_t>((kLiftedAt - kHeldTime) / kPeriod);
    const std::size_t held = begin + static_cast<std::size_t>(kHeldTime / kPeriod);
    for (std::size_t i = begin; i < command.size(); ++i) {
      const double share = i < held ? 0.0 : static_cast<double>(i - held) / static_cast<double>(count);
      command[i] = start + std::min(share, 1.0) * (lift_ - start);
    }
  }
  double lift_, fastest_;
  std::size_t follows_ = 0;  // the command's sample
};

}  // namespace

DrawnServo draw_servo(std::uint64_t seed, FrictionRung rung) {
  Random random(seed);
  DrawnServo out;
  out.seed = seed;
  out.gravity = random.log_even(0.3, 2.0);
  out.inertia = out.gravity / 9.81 * random.log_even(0.1, 0.3);
  out.phase = random.even(-1, 1);
  const auto set = [&](Quantity quantity) -> double& {
    return out.values[static_cast<std::size_t>(quantity)];
  };
  set(Quantity::delay) = random.log_even(0.005, 0.03);
  const double velocity = set(Quantity::velocity) = random.log_even(2, 6);
  const double effort = set(Quantity::effort) = out.gravity * random.even(2.5, 5);
  const double armature = set(Quantity::armature) = out.inertia * random.log_even(0.3, 1.5);
  const double frequency = random.log_even(25, 70), ratio = random.even(0.6, 1.2);
  const double inertia = armature + out.inertia;
  set(Quantity::stiffness) = inertia * frequency * frequency;
  set(Quantity::damping) = 2 * ratio * frequency * inertia;
  const double friction = effort * random.log_even(0.02, 0.08);
  const double viscous = effort / velocity * random.log_even(0.03, 0.1);
  const double breakaway = friction * random.even(0.4, 1), stribeck = random.log_even(0.05, 0.3);
  const double load_factor = random.even(0.1, 0.3);
  if (rung >= FrictionRung::coulomb) set(Quantity::friction) = friction, set(Quantity::viscous) = viscous;
  if (rung >= FrictionRung::stribeck)
    set(Quantity::breakaway) = breakaway, set(Quantity::stribeck) = stribeck;
  if (rung >= FrictionRung::load) set(Quantity::load_factor) = load_factor;
  for (std::size_t i = 0; i < kServoQuantities; ++i) out.start[i] = out.values[i] * random.log_even(0.5, 2);
  const auto guess = [&](Quantity quantity, double value) {
    double& start = out.start[static_cast<std::size_t>(quantity)];
    if (!(start > 0)) start = value;
  };
  guess(Quantity::friction, friction);
  guess(Quantity::viscous, viscous);
  guess(Quantity::breakaway, 0.3 * friction);
  guess(Quantity::stribeck, 0.1);
  guess(Quantity::load_factor, 0.05);
  guess(Quantity::backlash, 1e-3);
  return out;
}

namespace {

JointRecord recording_along(std::vector<double> command, const DrawnServo& servo, int lifts, Random& random) {
  JointRecord out;
  out.command = std::move(command);
  const double lift = LiftAndRelease::lift_of(servo);
  out.command.resize(kCount + 1 + static_cast<std::size_t>(lifts) * kLiftCount, lift);
  const std::size_t count = out.command.size() - 1;
  for (std::size_t i = 0; i <= count; ++i) out.command_time.push_back(static_cast<double>(i) * kPeriod);
  for (std::size_t i = 0; i < count; ++i)
    out.time.push_back(static_cast<double>(i) * kPeriod + (i > 0 ? random.even(-1e-3, 1e-3) : 0.0));
  Servo motion(servo, out.command.front());
  LiftAndRelease phase(servo, lift);
  const double delay = servo.values[static_cast<std::size_t>(Quantity::delay)];
  std::size_t target = 0;
  for (std::size_t step = 0; out.position.size() < count; ++step) {
    const double t = static_cast<double>(step) * kStep;
    for (std::size_t next = out.position.size(); next < count && out.time[next] <= t; ++next) {
      const double q = motion.q + motion.v * random.even(-1e-4, 1e-4);
      out.position.push_back(std::round(q / kTick4096) * kTick4096);
      out.load.push_back(servo.gravity * std::sin(out.position.back() + servo.phase));
      out.inertia.push_back(servo.inertia);
    }
    if (step % kStepsPerPeriod == 0) phase.act(step / kStepsPerPeriod, motion, out);
    // Streams reach each sample at its time, so that they begin a period before.
    for (; target < count && t - delay >= static_cast<double>(target) * kPeriod - 1e-9; ++target) {
      if (phase.follows(target, motion)) motion.aim(out.command[target + 1]);
    }
    motion.step();
  }
  return out;
}

}  // namespace

JointRecord recording_of(const DrawnServo& servo) {
  return recording_with_releases(servo, 0);
}

JointRecord recording_with_releases(const DrawnServo& servo, int lifts) {
  Random random(servo.seed + 1'000'000);
  std::vector<double> motion = commands(random);
  return recording_along(std::move(motion), servo, lifts, random);
}

JointRecord recording_of_steps(const DrawnServo& servo, int lifts) {
  Random random(servo.seed + 1'000'000);
  return recording_along(small_steps(), servo, lifts, random);
}

}  // namespace doppel
