#include "doppel/validation/motions/detail/limit_trials.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace doppel {
namespace {

constexpr double kBeyond = 0.5, kSlideBeyond = 0.1;           // rad, m: beyond a limit
constexpr double kEffortRoom = 1.001;                         // of the limit
constexpr double kNearLimit = 0.1, kSlideNearLimit = 0.01;    // rad, m: the start of a trial
constexpr double kApproach = 0.5, kShort = 0.1;               // s, of a trajectory
constexpr double kJumpRoom = 0.1;                             // of the range
constexpr double kRest = 0.15, kRefused = 0.02, kPush = 0.3;  // s
// rad/s, m/s: what is slower gets nowhere near the room of a violation in the rest of a trial.
constexpr double kResting = 2e-4, kSlideResting = 2e-5;

bool is_service(const JointWay& way) {
  return way.kind == JointWay::Kind::position_service || way.kind == JointWay::Kind::effort_service;
}

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

bool names_cause(const std::string& text) {
  return has(text, "limit") || has(text, "NaN") || has(text, "finite");
}

}  // namespace

bool Reaction::violates(bool slides) const {
  const double room = slides ? kSlideRoom : kPositionRoom;
  return diverged || !finite || beyond > room || command_beyond > room || speed > kSpeedRoom ||
         effort > kEffortRoom;
}

Reaction LimitTrialRun::run(const JointWay& way, LimitTrial trial) {
  const auto [value, seconds] = command(way, trial);
  Reaction out = carry_out(way, value, seconds, false);
  out.answered = has(machine_.answer(), about_.name);
  for (const LogLine& line : machine_.take_lines()) {
    const bool is_named = line.severity != Severity::note && has(line.text, about_.name);
    out.answered = out.answered || is_named || names_cause(line.text);
  }
  return out;
}

Reaction LimitTrialRun::run_to_violation(const JointWay& way, LimitTrial trial) {
  const auto [value, seconds] = command(way, trial);
  return carry_out(way, value, seconds, true);
}

Reaction LimitTrialRun::legal(const JointWay& way, LimitTrial trial) {
  return carry_out(way, end(trial), kApproach, false);
}

Reaction LimitTrialRun::carry_out(const JointWay& way, double value, double seconds, bool to_violation) {
  Reaction out;
  past_.clear();
  elapsed_ = quiet_since_ = 0;
  target_ = machine_.twin().robot().instance().drive_state(joint_).target;
  machine_.send(way, value, seconds);
  const bool slides = machine_.slides(joint_);
  out.diverged = !machine_.run(
      seconds_, [&] { observe(way, out); },
      [&] { return is_over(way, seconds) || (to_violation && out.violates(slides)); });
  return out;
}

bool LimitTrialRun::is_over(const JointWay& way, double command_seconds) const {
  if (is_service(way) && machine_.is_refused()) return elapsed_ >= kRefused;
  return elapsed_ >= command_seconds + kShort && elapsed_ - quiet_since_ >= kRest;
}

bool LimitTrialRun::applies(const JointWay& way, LimitTrial trial) const {
  const bool is_position = way.interface == "position";
  switch (trial) {
    case LimitTrial::above:
      return is_position && std::isfinite(about_.upper);
    case LimitTrial::below:
      return is_position && std::isfinite(about_.lower);
    case LimitTrial::fast:
      return std::isfinite(about_.velocity) && !is_service(way) &&
             (is_position || way.interface == "velocity");
    case LimitTrial::effort:
      return std::isfinite(about_.effort) && way.interface == "effort";
    case LimitTrial::jump:
      return is_position && !is_service(way) && std::isfinite(about_.lower) && std::isfinite(about_.upper);
    case LimitTrial::not_a_number:
    case LimitTrial::infinite:
      break;
  }
  return true;
}

double LimitTrialRun::start(LimitTrial trial) const {
  const double near = machine_.slides(joint_) ? kSlideNearLimit : kNearLimit;
  const double room =
      std::isfinite(about_.upper - about_.lower) ? 0.25 * (about_.upper - about_.lower) : near;
  if (trial == LimitTrial::above) return about_.upper - std::min(near, room);
  if (trial == LimitTrial::below || trial == LimitTrial::jump) return about_.lower + std::min(near, room);
  const double middle = 0.5 * (about_.lower + about_.upper);
  return std::isfinite(middle) ? middle : 0.0;
}

double LimitTrialRun::end(LimitTrial trial) const {
  if (trial == LimitTrial::above) return about_.upper;
  if (trial == LimitTrial::below) return about_.lower;
  if (trial == LimitTrial::jump) return about_.upper - kJumpRoom * (about_.upper - about_.lower);
  if (trial == LimitTrial::fast && std::isfinite(about_.upper)) return 0.5 * (start(trial) + about_.upper);
  return start(trial);
}

std::pair<double, double> LimitTrialRun::command(const JointWay& way, LimitTrial trial) const {
  const double beyond = machine_.slides(joint_) ? kSlideBeyond : kBeyond;
  switch (trial) {
    case LimitTrial::above:
      return {about_.upper + beyond, kApproach};
    case LimitTrial::below:
      return {about_.lower - beyond, kApproach};
    case LimitTrial::fast: {
      if (way.interface == "velocity") return {2 * about_.velocity, 0};
      const double present = machine_.position(joint_);
      const double room = std::isfinite(about_.upper) ? 0.5 * (about_.upper - present) : 1.0;
      return {present + room, room / (2 * about_.velocity)};
    }
    case LimitTrial::effort:
      return {2 * about_.effort, way.kind == JointWay::Kind::effort_service ? kPush : 0};
    case LimitTrial::not_a_number:
      return {std::numeric_limits<double>::quiet_NaN(), kShort};
    case LimitTrial::infinite:
      return {std::numeric_limits<double>::infinity(), kShort};
    case LimitTrial::jump:
      break;
  }
  return {about_.upper - kJumpRoom * (about_.upper - about_.lower), 0};
}

void LimitTrialRun::observe(const JointWay& way, Reaction& out) {
  const double q = machine_.position(joint_), v = machine_.speed(joint_), tau = machine_.effort(joint_);
  const DriveState drive = machine_.twin().robot().instance().drive_state(joint_);
  const double step = to_seconds(machine_.twin().step_size());
  elapsed_ += step;
  if (std::abs(v) > (machine_.slides(joint_) ? kSlideResting : kResting) || drive.target != target_)
    quiet_since_ = elapsed_;
  target_ = drive.target;
  out.finite = out.finite && std::isfinite(q) && std::isfinite(drive.target);
  if (drive.mode == DriveMode::position) {
    const double target = std::max(drive.target - about_.upper, about_.lower - drive.target);
    if (target > out.command_beyond) out.command = drive.target;
    out.command_beyond = std::max(out.command_beyond, target);
  }
  if (std::isfinite(about_.effort) && about_.effort > 0)
    out.effort = std::max(out.effort, std::abs(tau) / about_.effort);
  // How far and how fast a load from outside moves a joint is no matter of commands.
  if (way.kind == JointWay::Kind::effort_service) return;
  out.beyond = std::max({out.beyond, q - about_.upper, about_.lower - q});
  if (!std::isfinite(about_.velocity) || about_.velocity <= 0) return;
  out.momentary_speed = std::max(out.momentary_speed, std::abs(v) / about_.velocity);
  const auto steps = static_cast<std::size_t>(kSpeedWindow / step);
  past_.push_back(q);
  if (past_.size() > steps)
    out.speed =
        std::max(out.speed, std::abs(q - past_[past_.size() - 1 - steps]) / kSpeedWindow / about_.velocity);
}

}  // namespace doppel
