#include "doppel/control/manager/soft_limits.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

namespace doppel {
namespace {

// Why a <safety_controller> cannot be enforced; empty: it can.
std::string hindrance(const SafetyController& safety, const ModelJoint& joint, const Model& model) {
  if (!joint.scalar()) return "the joint does not have exactly one degree of freedom";
  if (joint.mimics())
    return fmt::format("the joint mimics '{}' and is not commanded",
                       model.joints[static_cast<std::size_t>(joint.mimic_leader)].name);
  const bool has_range = safety.soft_lower_limit != 0 || safety.soft_upper_limit != 0;
  if (!has_range) return "";
  if (!(safety.soft_lower_limit < safety.soft_upper_limit))
    return fmt::format("soft_lower_limit {:g} is not below soft_upper_limit {:g}", safety.soft_lower_limit,
                       safety.soft_upper_limit);
  if (joint.type == JointType::continuous) return "a continuous joint has no range";
  if (safety.soft_lower_limit >= joint.upper || safety.soft_upper_limit <= joint.lower)
    return fmt::format("the soft limits {:g} to {:g} are outside the limits {:g} to {:g}",
                       safety.soft_lower_limit, safety.soft_upper_limit, joint.lower, joint.upper);
  return "";
}

}  // namespace

std::vector<SoftLimits> soft_limits_of(const RobotDescription& robot, const Model& model,
                                       Diagnostics& diagnostics) {
  std::vector<SoftLimits> out;
  for (const Joint& joint : robot.joints) {
    const int index = model.find_joint(joint.name);
    if (!joint.safety || index < 0 || joint.type == JointType::fixed) continue;
    const SafetyController& safety = *joint.safety;
    const ModelJoint& of = model.joints[static_cast<std::size_t>(index)];
    if (const std::string why = hindrance(safety, of, model); !why.empty()) {
      diagnostics.warning("control.soft_limits", safety.source,
                          fmt::format("the <safety_controller> of '{}' has no effect: {}", joint.name, why),
                          "correct it, or remove it");
      continue;
    }
    SoftLimits soft{joint.name};
    if (safety.soft_lower_limit != 0 || safety.soft_upper_limit != 0) {
      soft.lower = std::max(safety.soft_lower_limit, of.lower);
      soft.upper = std::min(safety.soft_upper_limit, of.upper);
    }
    soft.k_position = std::max(safety.k_position, 0.0);
    soft.k_velocity = std::max(safety.k_velocity, 0.0);
    if (soft.bounds_position() || soft.k_velocity > 0) out.push_back(std::move(soft));
  }
  return out;
}

}  // namespace doppel
