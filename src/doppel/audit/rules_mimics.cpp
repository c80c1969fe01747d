// Joints that follow others.
#include <algorithm>
#include <cmath>

#include "doppel/audit/detail/description_facts.h"
#include "doppel/audit/detail/rules.h"

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

}  // namespace

void check_mimics(const AuditInput& in, Findings& out) {
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
