#include "doppel/review/conversion/joint_limits.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/base/math/decimals.h"
#include "doppel/base/yaml/yaml_text.h"

namespace doppel {
namespace {

constexpr int kDigits = 4;

// Readers of ROS 2 parameters take a number without a point as an integer, and reject it.
std::string yaml_number(double value) {
  std::string text = decimal(value);
  const std::size_t exponent = text.find('e');
  if (text.find('.') == std::string::npos) text.insert(std::min(exponent, text.size()), ".0");
  return text;
}

// Not more than the value, in kDigits digits.
double rounded_down(double value) {
  const double power = std::floor(std::log10(value)) - (kDigits - 1);
  const double steps = std::floor(value / std::pow(10.0, power));
  return std::stod(fmt::format("{:.0f}e{:.0f}", steps, power));
}

// The lowest of what the drive gives and of what the description allows. Infinite: no limit.
double allowed_acceleration(const JointAcceleration& found, const Joint* described) {
  double out = found.limit;
  if (described == nullptr || !described->limits) return out;
  for (const auto& written : {described->limits->acceleration, described->limits->deceleration}) {
    if (written && *written > 0) out = std::min(out, *written);
  }
  return out;
}

std::string holding(const ModelJoint& joint, const JointAcceleration& found) {
  const char* const unit = joint.type == JointType::prismatic ? "N" : "N m";
  return fmt::format("its effort limit of {:.4g} {} does not hold its weight, up to {:.4g} {}", joint.effort,
                     unit, found.gravity, unit);
}

std::string reason_of(const ModelJoint& joint, const JointAcceleration& found, const Model& model) {
  switch (found.kind) {
    case AccelerationKind::follows:
      return fmt::format("follows {}, which has no limit",
                         model.joints[static_cast<std::size_t>(joint.mimic_leader)].name);
    case AccelerationKind::no_effort:
      return "no effort limit";
    case AccelerationKind::cannot_hold:
      return holding(joint, found);
    case AccelerationKind::no_inertia:
      return "it moves no mass";
    case AccelerationKind::derived:
    case AccelerationKind::no_drive:
      break;
  }
  return "";
}

std::string limit_lines(const char* what, double limit, const std::string& comment = "") {
  const bool limited = std::isfinite(limit);
  return fmt::format("    has_{0}_limits: {1}{2}\n    max_{0}: {3}\n", what, limited,
                     limited || comment.empty() ? "" : "  # " + comment, yaml_number(limited ? limit : 0));
}

}  // namespace

std::string to_joint_limits(const RobotDescription& robot, const Model& model,
                            const AccelerationLimits& limits, Diagnostics& diagnostics) {
  std::string out = fmt::format(
      "# {}: rad and m, s. Accelerations that the effort limits leave after "
      "gravity and inertia,\n# for all joints at once.\njoint_limits:{}\n",
      yaml_text(robot.name), model.driven_joint_names().empty() ? " {}" : "");
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const ModelJoint& joint = model.joints[i];
    const JointAcceleration& found = limits.joints.at(i);
    if (!joint.scalar()) continue;
    const auto described = std::ranges::find(robot.joints, joint.name, &Joint::name);
    const Joint* const source = described == robot.joints.end() ? nullptr : &*described;
    const double acceleration = allowed_acceleration(found, source);
    out +=
        fmt::format("  {}:\n", yaml_text(joint.name)) + limit_lines("velocity", joint.velocity) +
        limit_lines("acceleration", std::isfinite(acceleration) ? rounded_down(acceleration) : acceleration,
                    reason_of(joint, found, model));
    if (source != nullptr && source->limits && source->limits->jerk && *source->limits->jerk > 0)
      out += limit_lines("jerk", *source->limits->jerk);
    if (found.kind != AccelerationKind::cannot_hold) continue;
    diagnostics.warning(
        "convert.cannot_hold", source == nullptr ? SourceLocation{} : source->source,
        fmt::format("joint '{}' gets no acceleration limit: {}", joint.name, holding(joint, found)),
        "correct the effort limit, or the masses behind the joint: doppel mass");
  }
  return out;
}

}  // namespace doppel
