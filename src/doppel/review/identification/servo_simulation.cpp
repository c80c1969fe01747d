#include "doppel/review/identification/detail/servo_simulation.h"

#include <algorithm>
#include <cmath>

namespace doppel::identification_detail {
namespace {

constexpr double kMaxStep = 1e-3;         // s
constexpr double kFineStep = 1.25e-4;     // s, after a jump of the command, where the limits act
constexpr double kTransient = 0.5;        // s, after a jump
constexpr double kJump = 1.3;             // of the fastest measured speed
constexpr double kShareOfStep = 0.5;      // physics/contract/drive.cpp
constexpr double kShareLoss = 0.05;       // of K / D
constexpr double kStreamGap = 0.05;       // s
constexpr double kPlayTransition = 0.02;  // of the effort limit, over which the play changes its side
constexpr double kSameSpeed = 1e-6;       // relative
constexpr double kSameTime = 1e-6;        // s

double value_of(const ServoValues& values, ServoQuantity quantity) {
  return values[static_cast<std::size_t>(quantity)];
}

}  // namespace

struct ServoSimulation::State {
  double q = 0, v = 0;
  double reference = 0, middle = 0, velocity = 0, share = kShareOfStep;  // middle: of the step
  double goal = 0;                                                       // the command's next sample
  double spread = 0, spread_end = 0;      // rad/s while a stream's target is approached, until this time
  double tau = 0, shift = 0;              // effort, and the output's shift
  double at_velocity = 0, at_effort = 0;  // s
  double largest = 0;                     // N m or N
  double follows = -1e300;                // s, of the first command behind a release that it follows
};

// The ends of the steps. Steps are short for a while after each jump of the command; that depends on the
// record alone, so that the prediction is a smooth function of the parameters.
void ServoSimulation::divide_time() {
  const std::vector<double>& t = record_.time;
  const std::vector<double>& u = record_.command_time;
  double fastest = 0;
  constexpr std::size_t kSpan = 8;  // samples
  for (std::size_t i = 0; i + kSpan < t.size(); ++i) {
    const double way = std::abs(record_.position[i + kSpan] - record_.position[i]);
    fastest = std::max(fastest, way / (t[i + kSpan] - t[i]));
  }
  double fine_until = t.front();
  std::size_t k = 0;
  auto span = record_.released.begin();
  for (double now = t.front(); now < t.back();) {
    while (span != record_.released.end() && span->end <= now + kSameTime) {
      fine_until = std::max(fine_until, span->end + kTransient);
      ++span;
    }
    const bool left = span != record_.released.end();
    const bool off = left && span->begin <= now + kSameTime;
    const double edge = !left ? t.back() : off ? span->end : span->begin;
    for (; k + 1 < u.size() && u[k] < now + kMaxStep; ++k) {
      const double speed = std::abs(record_.command[k + 1] - record_.command[k]) / (u[k + 1] - u[k]);
      if (speed > kJump * fastest) fine_until = u[k] + kTransient;
    }
    now = std::min({now + (now < fine_until ? kFineStep : kMaxStep), edge, t.back()});
    ends_.push_back(now);
    released_.push_back(off ? static_cast<int>(span - record_.released.begin()) : -1);
  }
}

// The time over which the way to each sample of the command is spread: that since the last change, as of an
// interpolating drive. After a rest it is 0: the reference moves at the velocity limit (Drive::set_target).
void ServoSimulation::find_spreads() {
  const std::vector<double>& t = record_.command_time;
  const std::vector<double>& u = record_.command;
  spreads_.assign(t.size(), 0.0);
  double last = t.front() - 2 * kStreamGap;
  for (std::size_t k = 0; k + 1 < t.size(); ++k) {
    if (u[k + 1] == u[k]) continue;
    const double since = t[k + 1] - last;
    spreads_[k] = since > kStreamGap + kSameTime ? 0.0 : since;
    last = t[k + 1];
  }
}

ServoSimulation::ServoSimulation(const JointRecord& record) : record_(record) {
  divide_time();
  find_spreads();
  const std::vector<double>& t = record.time;
  load_.resize(ends_.size());
  inertia_.resize(ends_.size());
  std::size_t k = 0;
  double begin = t.front();
  for (std::size_t i = 0; i < ends_.size(); ++i) {
    const double time = 0.5 * (begin + ends_[i]);
    begin = ends_[i];
    while (k + 2 < t.size() && t[k + 1] < time) ++k;
    const double w = (time - t[k]) / (t[k + 1] - t[k]);
    load_[i] = record.load[k] + w * (record.load[k + 1] - record.load[k]);
    inertia_[i] = record.inertia[k] + w * (record.inertia[k + 1] - record.inertia[k]);
  }
}

// The command's interval that begins at this time.
void ServoSimulation::aim(State& s) const {
  const double target = record_.command[command_ + 1];
  if (target == s.goal) return;
  s.goal = target;
  const double time = spreads_[command_];
  s.spread_end = record_.command_time[command_] + time;
  if (time > 0) {
    s.spread = std::abs(target - s.reference) / time;
  } else {
    s.share = kShareOfStep;
  }
}

// The law of Drive::advance_position.
void ServoSimulation::advance_part(const ServoValues& values, State& s, double now, double time) const {
  const double fastest = value_of(values, ServoQuantity::velocity);
  const bool spreads = now + kSameTime < s.spread_end;
  const double speed = spreads ? std::min(s.spread, fastest) : fastest;
  if (spreads) {
    const double rate =
        value_of(values, ServoQuantity::stiffness) * time / value_of(values, ServoQuantity::damping);
    const double growth = rate * (fastest - speed);
    if (s.spread > fastest * (1.0 + kSameSpeed)) {
      s.share = std::max(s.share - kShareLoss * rate, kShareOfStep);
    } else {
      s.share = speed * (1.0 - s.share) > growth ? s.share + growth / speed : 1.0;
    }
  }
  const double way = std::clamp(s.goal - s.reference, -speed * time, speed * time);
  if (speed == fastest && way != 0) s.at_velocity += std::abs(way) / fastest;
  // It moves, and then stands where it arrives within the part.
  const double moving = speed > 0 ? std::abs(way) / speed : 0.0;
  s.middle += s.reference * time + way * (time - 0.5 * moving);
  s.velocity += s.share * way;
  s.reference += way;
}

// The torque begins with the reference at the joint, and the place of the catch as its target.
void ServoSimulation::catch_joint(State& s, const ReleasedSpan& span) const {
  s.reference = s.q;
  s.goal = span.caught;
  s.spread = s.spread_end = 0;
  s.share = kShareOfStep;
  s.follows = span.follows;
}

// The mean of the reference and of its velocity over the step. A step of the command begins inside of a step
// of the simulation, which is divided there.
void ServoSimulation::advance_reference(const ServoValues& values, State& s, double begin, double end) {
  const std::vector<double>& t = record_.command_time;
  const double furthest =
      value_of(values, ServoQuantity::effort) / value_of(values, ServoQuantity::stiffness);
  s.reference = std::clamp(s.reference, s.q - furthest, s.q + furthest);
  s.middle = s.velocity = 0;
  double now = begin;
  while (now < end) {
    if (now >= t.front()) {
      while (command_ + 2 < t.size() && t[command_ + 1] <= now) ++command_;
      if (now < t[command_ + 1] && now >= s.follows) aim(s);
    }
    const double corner = now < t.front() ? t.front() : t[command_ + 1];
    const double next = corner > now ? std::min(corner, end) : end;
    if (next - now > 1e-9) advance_part(values, s, now, next - now);
    now = next;
  }
  s.middle /= end - begin;
  s.velocity /= end - begin;
  // The limit moves with the joint.
  const double half = s.q + 0.5 * step_ * s.v, whole = s.q + step_ * s.v;
  s.middle = std::clamp(s.middle, half - furthest, half + furthest);
  s.reference = std::clamp(s.reference, whole - furthest, whole + furthest);
}

// Implicit midpoint rule; Coulomb friction acts on the velocity of the step's middle.
void ServoSimulation::step(const ServoValues& values, State& s, std::size_t i) const {
  const double stiffness = value_of(values, ServoQuantity::stiffness);
  const double damping = value_of(values, ServoQuantity::damping);
  const double effort = value_of(values, ServoQuantity::effort);
  const double inertia = value_of(values, ServoQuantity::armature) + inertia_[i];
  const double passive = 2.0 * inertia / step_ + value_of(values, ServoQuantity::viscous);
  const double momentum = 2.0 * inertia / step_ * s.v - load_[i];
  double friction = value_of(values, ServoQuantity::friction) +
                    value_of(values, ServoQuantity::load_factor) * std::abs(s.tau);
  if (const double extra = value_of(values, ServoQuantity::breakaway); extra > 0) {
    const double x = s.v / value_of(values, ServoQuantity::stribeck);
    friction += x * x < 40 ? extra * std::exp(-x * x) : 0.0;
  }
  const bool on = released_[i] < 0;
  const double spring = on ? stiffness * (s.middle - s.q) + damping * s.velocity : 0.0;
  const auto slowed = [friction](double force) {
    return std::copysign(std::max(std::abs(force) - friction, 0.0), force);
  };
  const double drag = on ? damping + 0.5 * stiffness * step_ : 0.0;
  double middle = slowed(momentum + spring) / (passive + drag);
  s.tau = spring - drag * middle;
  if (std::abs(s.tau) > effort) {
    s.tau = std::copysign(effort, s.tau);
    middle = slowed(momentum + s.tau) / passive;
    s.at_effort += step_;
  }
  s.largest = std::max(s.largest, std::abs(s.tau));
  s.q += step_ * middle;
  const double after = middle == 0.0 ? 0.0 : 2.0 * middle - s.v;
  const double acceleration = (after - s.v) / step_;
  s.v = after;
  if (!on) catch_joint(s, record_.released[static_cast<std::size_t>(released_[i])]);
  if (const double play = value_of(values, ServoQuantity::backlash); play > 0) {
    const double carried = load_[i] + inertia_[i] * acceleration;
    s.shift = -0.5 * play * std::clamp(carried / (kPlayTransition * effort), -1.0, 1.0);
  }
}

void ServoSimulation::run(const ServoValues& values, std::vector<double>& out) {
  const std::vector<double>& t = record_.time;
  const double delay = value_of(values, ServoQuantity::delay);
  const double stiffness = value_of(values, ServoQuantity::stiffness);
  command_ = 0;
  State s;
  s.goal = record_.command.front();
  s.reference = s.goal;
  s.q = record_.position.front();
  s.tau = std::clamp(stiffness * (s.reference - s.q), -value_of(values, ServoQuantity::effort),
                     value_of(values, ServoQuantity::effort));
  out[0] = s.q;
  std::size_t k = 1;
  double before = s.q, begin = t.front();
  for (std::size_t i = 0; i < ends_.size(); ++i) {
    const double end = ends_[i];
    step_ = end - begin;
    advance_reference(values, s, begin - delay, end - delay);
    begin = end;
    step(values, s, i);
    const double now = s.q + s.shift;
    for (; k < t.size() && t[k] <= end; ++k) out[k] = now + (t[k] - end) / step_ * (now - before);
    before = now;
  }
  for (; k < t.size(); ++k) out[k] = before;
  velocity_share_ = s.at_velocity / (t.back() - t.front());
  effort_share_ = s.at_effort / (t.back() - t.front());
  largest_effort_ = s.largest;
}

}  // namespace doppel::identification_detail
