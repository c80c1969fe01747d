#include "doppel/control/manager/detail/joint_limiter.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <utility>

#include "doppel/control/hardware/nan.h"

namespace doppel {
namespace {

constexpr double kSlack =
    1e-6;  // rad, m, ...: rounding in the controllers' YAML is clamped to the limit, but not reported
constexpr Duration kEpisodeTimeout = std::chrono::seconds(1);  // without intervention: the episode is over
constexpr Duration kReportDelay =
    std::chrono::milliseconds(250);  // so that the report includes the largest value

bool beyond(double asked, double limit) {
  return std::abs(asked) > limit + kSlack * std::max(1.0, limit);
}

struct Bounds {
  double lower = -kInfinity, upper = kInfinity;
};

// The range of positions: the limits, or the soft ones inside them.
Bounds range_of(const ModelJoint& joint, const SoftLimits* soft) {
  if (soft == nullptr || !soft->bounds_position()) return {joint.lower, joint.upper};
  return {soft->lower, soft->upper};
}

// The range of velocities at a position.
Bounds soft_velocities(const ModelJoint& joint, const SoftLimits& soft, double position) {
  if (!soft.bounds_position() || soft.k_position <= 0) return {-joint.velocity, joint.velocity};
  return {std::clamp(-soft.k_position * (position - soft.lower), -joint.velocity, joint.velocity),
          std::clamp(-soft.k_position * (position - soft.upper), -joint.velocity, joint.velocity)};
}

}  // namespace

const ModelJoint* JointLimiter::find_joint(const std::string& name) const {
  const int joint = model_->find_joint(name);
  if (joint < 0 || !model_->joints[static_cast<std::size_t>(joint)].scalar()) return nullptr;
  return &model_->joints[static_cast<std::size_t>(joint)];
}

void JointLimiter::model_changed(const Model& model) {
  model_ = &model;
  for (Entry& entry : entries_) entry.joint = find_joint(entry.joint_name);
}

const SoftLimits* JointLimiter::find_soft(const std::string& name) const {
  const auto found = std::ranges::find(soft_, name, &SoftLimits::joint);
  return found == soft_.end() ? nullptr : &*found;
}

void JointLimiter::set_soft_limits(std::vector<SoftLimits> limits) {
  soft_ = std::move(limits);
  for (Entry& entry : entries_) {
    entry.soft = find_soft(entry.joint_name);
    entry.episodes[kSoftRange] = {};  // its report would name the former limits
  }
}

void JointLimiter::add(ResourceTable& table, std::size_t command) {
  const InterfaceDescription& description = table.command_description(command);
  Entry entry;
  entry.full_name = description.full_name();
  entry.asked = &table.asked(command);
  entry.applied = &table.applied(command);
  if (description.name == kPosition) entry.quantity = Quantity::position;
  if (description.name == kVelocity) entry.quantity = Quantity::velocity;
  if (description.name == kEffort) entry.quantity = Quantity::effort;
  entry.joint_name = description.prefix;
  entry.joint = find_joint(entry.joint_name);
  if (const auto state = table.find_state(description.prefix + "/" + kPosition))
    entry.position = &table.state(*state);
  if (const auto state = table.find_state(description.prefix + "/" + kVelocity))
    entry.velocity = &table.state(*state);
  entry.soft = find_soft(entry.joint_name);
  entry.last_asked = entry.last_applied = kNaN;
  entries_.push_back(std::move(entry));
}

void JointLimiter::forget(std::size_t command) {
  entries_[command].last_asked = entries_[command].last_applied = kNaN;
}

void JointLimiter::save(Saved& out) const {
  out.assign(entries_.begin(), entries_.end());
}

void JointLimiter::restore(const Saved& saved) {
  for (std::size_t i = 0; i < std::min(saved.size(), entries_.size()); ++i)
    static_cast<Run&>(entries_[i]) = saved[i];
}

void JointLimiter::claim(std::size_t command, const std::string& controller, int ticks) {
  Entry& entry = entries_[command];
  entry.controller = controller;
  entry.claimed = true;
  entry.ticks = ticks;
  // A controller that takes over continues from the command that was applied last, so that the rate limit
  // also holds for its first command; without a command yet, the joint's position is the start.
  if (!std::isfinite(*entry.asked)) entry.last_applied = kNaN;
  entry.last_asked = entry.last_applied;
  if (!std::isfinite(entry.last_applied)) *entry.applied = kNaN;
}

void JointLimiter::release(std::size_t command, Time now, Duration tick) {
  Entry& entry = entries_[command];
  if (!entry.claimed) return;
  apply(entry, now, to_seconds(tick));
  entry.claimed = false;
}

void JointLimiter::apply(Time now, Duration tick) {
  const double dt = to_seconds(tick);
  for (Entry& entry : entries_) {
    if (entry.claimed) apply(entry, now, dt);
  }
}

void JointLimiter::apply(Entry& entry, Time now, double dt) const {
  double value = *entry.asked;
  if (!std::isfinite(value)) {
    // NaN before the first command is usual and means no command; later it is a fault of the controller,
    // and the last valid command stays in effect.
    const bool none_yet = std::isnan(value) && !std::isfinite(entry.last_applied);
    if (!none_yet) note(entry.episodes[kNotFinite], value, now);
    *entry.applied = entry.last_applied;
    return;
  }
  const double asked = value;
  if (enforce_ && entry.joint != nullptr) {
    switch (entry.quantity) {
      case Quantity::position:
        value = limit_position(entry, asked, now, dt);
        break;
      case Quantity::velocity:
        value = limit_velocity(entry, asked, now, dt);
        break;
      case Quantity::effort:
        value = limit_effort(entry, asked, now);
        break;
      case Quantity::other:
        break;
    }
  }
  entry.last_asked = asked;
  entry.last_applied = value;
  *entry.applied = value;
}

double JointLimiter::limit_position(Entry& entry, double asked, Time now, double dt) {
  const ModelJoint& joint = *entry.joint;
  const Bounds range = range_of(joint, entry.soft);
  const double inside = std::clamp(asked, range.lower, range.upper);
  const double hard = std::clamp(asked, joint.lower, joint.upper);
  // A trajectory begins where the joint is; under load that is a little outside of a limit on which it rests.
  const double measured = entry.position != nullptr ? *entry.position : inside;
  const bool joint_is_there = asked > inside ? asked <= measured + kSlack : asked >= measured - kSlack;
  if (std::abs(hard - asked) > kSlack && !joint_is_there) note(entry.episodes[kRange], asked, now);
  if (std::abs(inside - hard) > kSlack) note(entry.episodes[kSoftRange], asked, now);
  double from = std::isfinite(entry.last_applied) ? entry.last_applied
                : entry.position != nullptr       ? *entry.position
                                                  : inside;
  double before = std::isfinite(entry.last_asked) ? entry.last_asked : from;
  if (joint.type == JointType::continuous) {  // whole turns are the same position: the shortest way is taken
    from = inside - std::remainder(inside - from, 2.0 * std::numbers::pi);
    before = asked - std::remainder(asked - before, 2.0 * std::numbers::pi);
  }
  double speed = joint.velocity;
  if (entry.soft != nullptr && entry.soft->bounds_position() && entry.soft->k_position > 0) {
    const double distance = inside > from ? entry.soft->upper - from : from - entry.soft->lower;
    // At the soft limit itself the way is over; a joint outside returns at its velocity limit.
    if (distance > 0) speed = std::min(speed, entry.soft->k_position * distance);
  }
  const double max_change = speed * dt;
  if (!std::isfinite(max_change) || std::abs(inside - from) <= max_change) return inside;
  // The commanded velocity is the change of the command over its controller's period; in later ticks the
  // joint only catches up with the command, which is no violation.
  const double rate = std::abs(asked - before) / (entry.ticks * dt);
  Episode& episode = entry.episodes[kRate];
  if (beyond(rate, joint.velocity) ||
      (episode.open && now - episode.last <= 2 * from_seconds(entry.ticks * dt))) {
    note(episode, rate, now);
  }
  return from + std::copysign(max_change, inside - from);
}

double JointLimiter::limit_velocity(Entry& entry, double asked, Time now, double dt) {
  const double value = limit_magnitude(entry, asked, entry.joint->velocity, now);
  if (entry.position == nullptr) return value;
  const Bounds range = range_of(*entry.joint, entry.soft);
  // The velocity that reaches the end of the range in one tick is the largest one; outside of the range
  // only the way back is permitted.
  double lowest = std::min(0.0, (range.lower - *entry.position) / dt);
  double highest = std::max(0.0, (range.upper - *entry.position) / dt);
  if (entry.soft != nullptr) {
    const Bounds soft = soft_velocities(*entry.joint, *entry.soft, *entry.position);
    lowest = std::max(lowest, std::min(0.0, soft.lower));
    highest = std::min(highest, std::max(0.0, soft.upper));
  }
  const double held = std::clamp(value, lowest, highest);
  if (std::abs(held - value) > kSlack) note(entry.episodes[kPastLimit], value, now);
  return held;
}

double JointLimiter::limit_effort(Entry& entry, double asked, Time now) {
  const double value = limit_magnitude(entry, asked, entry.joint->effort, now);
  if (entry.soft == nullptr || entry.soft->k_velocity <= 0 || entry.velocity == nullptr ||
      entry.position == nullptr)
    return value;
  // The soft limit of an effort is that of ros_control's joint_limits_interface: the effort is bounded by
  // k_velocity times the distance to the permitted velocities, so that it brakes a joint that is too fast.
  const double v = *entry.velocity, limit = entry.joint->effort;
  const Bounds allowed = soft_velocities(*entry.joint, *entry.soft, *entry.position);
  const double lower = std::clamp(-entry.soft->k_velocity * (v - allowed.lower), -limit, limit);
  const double upper = std::clamp(-entry.soft->k_velocity * (v - allowed.upper), -limit, limit);
  const double held = std::clamp(value, lower, upper);
  if (std::abs(held - value) > kSlack) note(entry.episodes[kSoftRange], value, now);
  return held;
}

double JointLimiter::limit_magnitude(Entry& entry, double asked, double limit, Time now) {
  if (beyond(asked, limit)) note(entry.episodes[kMagnitude], asked, now);
  return std::clamp(asked, -limit, limit);
}

void JointLimiter::note(Episode& episode, double asked, Time now) {
  // An episode is a span of commands beyond a limit. It is one warning with its largest value, instead of
  // one in each tick.
  if (!episode.open) {
    episode = {};
    episode.open = true;
    episode.began = now;
    episode.asked = asked;
  }
  if (std::abs(asked) > std::abs(episode.asked)) episode.asked = asked;
  episode.last = now;
}

std::string JointLimiter::sentence(const Entry& entry, Kind kind) {
  const std::string& full = entry.full_name;
  if (kind == kNotFinite) {
    return fmt::format(
        "a command on '{}' is not a finite number; rejected, the last valid command stays in effect", full);
  }
  const ModelJoint& joint = *entry.joint;
  const bool linear = joint.type == JointType::prismatic;
  const char* length = linear ? "m" : "rad";
  const double asked = entry.episodes[kind].asked;
  switch (kind) {
    case kRange:
      return fmt::format(
          "{}: command {:.4g} {} is outside the limits {:.4g} to {:.4g} {}; clamped to the limit", joint.name,
          asked, length, joint.lower, joint.upper, length);
    case kSoftRange:
      if (entry.quantity == Quantity::effort)
        return fmt::format(
            "{}: command {:.4g} {} is reduced by the k_velocity of its <safety_controller>, which brakes the "
            "joint at its velocity limit and soft limits",
            joint.name, asked, linear ? "N" : "N m");
      return fmt::format(
          "{}: command {:.4g} {} is outside the soft limits {:.4g} to {:.4g} {} of its <safety_controller>; "
          "clamped to the soft limit",
          joint.name, asked, length, entry.soft->lower, entry.soft->upper, length);
    case kRate:
      return fmt::format(
          "{}: the position command requires {:.4g} {}/s, above the velocity limit {:.4g} {}/s; the joint "
          "moves "
          "to it at the limit",
          joint.name, asked, length, joint.velocity, length);
    case kPastLimit: {
      const Bounds range = range_of(joint, entry.soft);
      return fmt::format("{}: command {:.4g} {}/s at the end of the range {:.4g} to {:.4g} {}; held there",
                         joint.name, asked, length, range.lower, range.upper, length);
    }
    default:
      break;
  }
  const bool effort = entry.quantity == Quantity::effort;
  const std::string unit = effort ? (linear ? "N" : "N m") : fmt::format("{}/s", length);
  return fmt::format("{}: command {:.4g} {} is above the limit {:.4g} {}; clamped to the limit", joint.name,
                     asked, unit, effort ? joint.effort : joint.velocity, unit);
}

void JointLimiter::report(Time now, const Log& log) {
  for (Entry& entry : entries_) {
    for (std::size_t kind = 0; kind < kKinds; ++kind) {
      Episode& episode = entry.episodes[kind];
      if (!episode.open) continue;
      const bool rewound = now < episode.last;  // the simulation was reset
      const bool over = rewound || now - episode.last > kEpisodeTimeout;
      if (!episode.reported && (over || kind == kNotFinite || now - episode.began >= kReportDelay)) {
        log.warning(entry.controller, sentence(entry, static_cast<Kind>(kind)));
        episode.reported = true;
      }
      if (over) episode.open = false;
    }
  }
}

}  // namespace doppel
