// Joints that follow others.
#include <algorithm>
#include <array>
#include <cmath>

#include "doppel/base/core/text.h"
#include "doppel/base/math/pose.h"
#include "doppel/review/audit/detail/description_facts.h"
#include "doppel/review/audit/detail/rules.h"

namespace doppel::audit_rules {
namespace {

bool has_range(const Joint& joint) {
  return joint.limits && joint.limits->has_position && joint.limits->lower <= joint.limits->upper &&
         (joint.type == JointType::revolute || joint.type == JointType::prismatic);
}

void check_follower_range(const Joint& joint, const Joint& leader, Findings& out) {
  if (!has_range(joint) || !has_range(leader)) return;
  const Mimic& mimic = *joint.mimic;
  const double a = mimic.multiplier * leader.limits->lower + mimic.offset;
  const double b = mimic.multiplier * leader.limits->upper + mimic.offset;
  const double lower = std::min(a, b), upper = std::max(a, b);
  const double beyond = std::max(joint.limits->lower - lower, upper - joint.limits->upper);
  // Rounding of written digits in both ranges is tolerated.
  if (beyond <= 1e-5 + 1e-3 * (upper - lower)) return;
  out.add(
      "mimic.limits", subject(joint), joint.limits->source,
      fmt::format("'{}' moves it over {:g} .. {:g}, but its own limits are {:g} .. {:g}", leader.name, lower,
                  upper, joint.limits->lower, joint.limits->upper),
      fmt::format("widen its limits to {:g} .. {:g}, or narrow those of '{}'",
                  std::min(lower, joint.limits->lower), std::max(upper, joint.limits->upper), leader.name));
}

bool is_gripper_part(const std::string& name) {
  static constexpr std::array<std::string_view, 6> kParts{"finger", "gear",    "jaw",
                                                          "claw",   "knuckle", "gripper"};
  const std::string low = lowered(name);
  return std::ranges::any_of(kParts,
                             [&](std::string_view part) { return low.find(part) != std::string::npos; });
}

// A joint with a command interface has a drive of its own.
bool is_driven(const RobotDescription& robot, const std::string& name) {
  return std::ranges::any_of(robot.hardware, [&](const HardwareDescription& hardware) {
    return std::ranges::any_of(hardware.joints, [&](const HardwareJointDescription& joint) {
      return joint.name == name && !joint.command_interfaces.empty();
    });
  });
}

// The range of b is that of a times the sign, 1 or -1.
bool same_ranges(const Joint& a, const Joint& b, double sign) {
  if (!has_range(a) || !has_range(b)) return false;
  const double tolerance = 1e-3 * (a.limits->upper - a.limits->lower);
  const double lower = sign > 0 ? a.limits->lower : -a.limits->upper;
  const double upper = sign > 0 ? a.limits->upper : -a.limits->lower;
  return std::abs(b.limits->lower - lower) <= tolerance && std::abs(b.limits->upper - upper) <= tolerance;
}

// Both joints are on one link, their links are called left and right, their axes are parallel, and their
// ranges fit: the sign by which one follows the other. 0: they are no such pair.
double mirrored_sign(const Joint& a, const Joint& b) {
  if (a.parent != b.parent || a.type != b.type || a.mimic || b.mimic) return 0;
  if (!is_gripper_part(a.child) || mirrored_name(a.child) != lowered(b.child)) return 0;
  const double parallel = (rotation_from_rpy(a.origin.rpy) * a.axis.normalized())
                              .dot(rotation_from_rpy(b.origin.rpy) * b.axis.normalized());
  if (std::abs(parallel) < 0.99) return 0;
  const double sign = parallel < 0 ? 1 : -1;
  return same_ranges(a, b, sign) ? sign : 0;
}

void suggest_mimics(const AuditInput& in, Findings& out) {
  for (const Joint& a : in.robot.joints) {
    for (const Joint& b : in.robot.joints) {
      const double sign = mirrored_sign(a, b);
      if (sign == 0 || (is_driven(in.robot, a.name) && is_driven(in.robot, b.name))) continue;
      const auto follows = [&](const Joint& other) {
        return other.mimic && (other.mimic->joint == a.name || other.mimic->joint == b.name);
      };
      if (std::ranges::any_of(in.robot.joints, follows)) continue;
      const auto& [leader, follower] = is_driven(in.robot, b.name) ? std::pair(&b, &a) : std::pair(&a, &b);
      out.add("mimic.missing", subject(*follower), follower->source,
              fmt::format("it and '{}' move mirrored parts of a gripper, and neither mimics the other",
                          leader->name),
              fmt::format("if one drive moves both: doppel overlay add TARGET add_mimic \"{}\" leader=\"{}\" "
                          "multiplier={:g}",
                          follower->name, leader->name, sign));
    }
  }
}

}  // namespace

void check_mimics(const AuditInput& in, Findings& out) {
  suggest_mimics(in, out);
  for (const Joint& joint : in.robot.joints) {
    if (!joint.mimic) continue;
    const SourceLocation& where = joint.mimic->source;
    if (joint.type == JointType::fixed) {
      out.add("mimic.fixed", subject(joint), where,
              fmt::format("it is fixed, but mimics '{}'", joint.mimic->joint));
      continue;
    }
    if (joint.mimic->multiplier == 0) {
      out.add("mimic.multiplier_zero", subject(joint), where,
              fmt::format("it mimics '{}' with multiplier 0, so it does not move", joint.mimic->joint));
    }
    const Joint* leader = in.robot.find_joint(joint.mimic->joint);
    if (leader == nullptr || leader == &joint) continue;
    if (leader->mimic && leader->mimic->joint != joint.name) {
      out.add("mimic.chained", subject(joint), where,
              fmt::format("it mimics '{}', which itself mimics '{}'", leader->name, leader->mimic->joint),
              fmt::format("let it mimic '{}' directly, with multiplier {:g} and offset {:g}",
                          leader->mimic->joint, joint.mimic->multiplier * leader->mimic->multiplier,
                          joint.mimic->multiplier * leader->mimic->offset + joint.mimic->offset));
    }
    check_follower_range(joint, *leader, out);
  }
}

}  // namespace doppel::audit_rules
