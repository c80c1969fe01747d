#include "doppel/twin/drawable.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

namespace doppel {
namespace {

// The parser's errors that a picture can do without, and what it shows instead.
constexpr std::array<std::pair<std::string_view, std::string_view>, 7> kForgiven{{
    {"urdf.axis_zero", "it is drawn standing still"},
    {"urdf.geometry", "a shape that cannot be drawn is left out"},
    {"urdf.inertial", "a picture needs no weight"},
    {"urdf.joint_type", "it is drawn as fixed"},
    {"urdf.limits_crossed", "they are taken the other way round"},
    {"urdf.mimic_loop", "it moves on its own here"},
    {"urdf.mimic_unknown", "it moves on its own here"},
}};

bool turns_or_slides(const Joint& joint) {
  return joint.type == JointType::revolute || joint.type == JointType::continuous ||
         joint.type == JointType::prismatic;
}

void forgive(const Diagnostics& found, Diagnostics& told) {
  std::vector<Diagnostic> refused;
  for (Diagnostic diagnostic : found.all()) {
    const auto named = [&](const auto& forgiven) { return forgiven.first == diagnostic.rule; };
    const auto* forgiven = std::find_if(kForgiven.begin(), kForgiven.end(), named);
    if (diagnostic.severity == Severity::error && forgiven == kForgiven.end()) {
      refused.push_back(std::move(diagnostic));
      continue;
    }
    if (diagnostic.severity == Severity::error) {
      diagnostic.severity = Severity::warning;
      diagnostic.message += fmt::format("; {}", forgiven->second);
    }
    told.add(std::move(diagnostic));
  }
  if (!refused.empty()) throw InputError(std::move(refused));
}

bool mimics_in_a_loop(const RobotDescription& robot, const Joint& joint) {
  const Joint* at = &joint;
  for (std::size_t steps = 0; at != nullptr && at->mimic; ++steps) {
    if (steps > robot.joints.size()) return true;
    at = robot.find_joint(at->mimic->joint);
  }
  return false;
}

// Joints that follow nothing that could lead them move on their own.
void free_followers(RobotDescription& robot, Diagnostics& told) {
  std::vector<Joint*> alone;
  for (Joint& joint : robot.joints) {
    if (!joint.mimic) continue;
    const Joint* leader = robot.find_joint(joint.mimic->joint);
    if (leader == nullptr || mimics_in_a_loop(robot, joint)) {
      alone.push_back(&joint);  // the parser has told so
    } else if (!turns_or_slides(joint) || !turns_or_slides(*leader)) {
      alone.push_back(&joint);
      told.warning(
          "model.mimic_not_scalar", joint.mimic->source,
          fmt::format("joint '{}' mimics '{}', but only revolute, continuous and prismatic joints can "
                      "mimic or be mimicked; here it does not",
                      joint.name, leader->name));
    }
  }
  for (Joint* joint : alone) joint->mimic.reset();
}

}  // namespace

void make_drawable(RobotDescription& robot, const Diagnostics& found, Diagnostics& told) {
  forgive(found, told);
  for (Joint& joint : robot.joints) {
    const bool has_axis = turns_or_slides(joint) || joint.type == JointType::planar;
    if (has_axis && joint.axis.norm() < 1e-9) joint.type = JointType::fixed;
    if (joint.limits && joint.limits->lower > joint.limits->upper)
      std::swap(joint.limits->lower, joint.limits->upper);
  }
  free_followers(robot, told);
}

}  // namespace doppel
