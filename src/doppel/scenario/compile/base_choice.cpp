#include "doppel/scenario/compile/base_choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "doppel/base/core/text.h"
#include "doppel/description/gazebo/root_link.h"
#include "doppel/description/gazebo/simulator_plugins.h"
#include "doppel/description/meshes/mesh.h"
#include "doppel/description/urdf/legs.h"
#include "doppel/robot/collision/collision_shape.h"

namespace doppel {
namespace {

constexpr std::size_t kMaxNamesInReason = 3;
constexpr double kSameRadius = 0.01;                  // relative
constexpr double kAlongAxis = 0.99;                   // cosine between a wheel's axis and its joint's
constexpr double kOffCentre = 0.02;                   // of the radius, of a wheel from its axis
constexpr double kLying = 0.5;                        // largest vertical component of a wheel's axis
constexpr double kFewTurns = 4.0 * std::numbers::pi;  // rad: a joint with a larger range is a wheel

bool moves(const Joint& joint) {
  return joint.type == JointType::revolute || joint.type == JointType::continuous ||
         joint.type == JointType::prismatic;
}

bool turns_for_ever(const Joint& joint) {
  if (joint.type == JointType::continuous) return true;
  return joint.type == JointType::revolute &&
         (!joint.limits || joint.limits->upper - joint.limits->lower > kFewTurns);
}

// True if a wheel on this joint would roll on the ground: its axis is horizontal with all joints at zero.
bool lies(const JointPaths& paths, const Joint& joint) {
  Eigen::Vector3d axis = joint.axis.normalized();
  for (const Joint* at : paths.to_root(joint)) axis = at->origin.pose().linear() * axis;
  return std::abs(axis.z()) < kLying;
}

std::string shown(const std::vector<std::string>& names) {
  std::string out;
  for (std::size_t i = 0; i < std::min(names.size(), kMaxNamesInReason); ++i)
    out += fmt::format("{}'{}'", i == 0 ? "" : ", ", names[i]);
  return out + (names.size() > kMaxNamesInReason ? ", ..." : "");
}

std::string mobile_plugin(const RobotDescription& robot) {
  for (const GazeboExtension& extension : robot.gazebo) {
    for (const GazeboPlugin& plugin : extension.plugins) {
      if (drives_base(plugin.filename, plugin.name))
        return plugin.filename.empty() ? plugin.name : plugin.filename;
    }
  }
  return "";
}

// m, from the joint's axis to the origin of a shape of the link that it carries.
double off_axis(const Eigen::Vector3d& axis, const Pose& X_JS) {
  return axis.cross(X_JS.translation()).norm();
}

// The radius of a shape that is round about the joint's axis (unit, in the link's frame).
std::optional<double> round_about(const Geometry& geometry, const Pose& X_JS, const Eigen::Vector3d& axis) {
  std::optional<double> radius;
  if (const auto* ball = std::get_if<Sphere>(&geometry)) radius = ball->radius;
  const auto* cylinder = std::get_if<Cylinder>(&geometry);
  if (cylinder != nullptr && cylinder->length <= 2.0 * cylinder->radius &&
      std::abs(X_JS.linear().col(2).dot(axis)) >= kAlongAxis)
    radius = cylinder->radius;
  if (radius && off_axis(axis, X_JS) > kOffCentre * *radius) radius.reset();
  return radius;
}

// The radius of a wheel: a round shape about the axis of the joint that carries it, from which no other shape
// of the links that are fixed to it protrudes, as the foot does from a round knee.
std::optional<double> wheel_radius(const RobotDescription& robot, const Joint& joint) {
  if (!(joint.axis.norm() > 0)) return std::nullopt;
  const Eigen::Vector3d axis = joint.axis.normalized();
  std::optional<double> radius;
  double furthest = 0;
  std::vector<std::pair<const Link*, Pose>> rigid{{robot.find_link(joint.child), Pose::Identity()}};
  for (std::size_t i = 0; i < rigid.size() && rigid.size() <= robot.links.size(); ++i) {
    const auto [link, X_JL] = rigid[i];
    if (link == nullptr) continue;
    for (const Collision& collision : link->collisions) {
      const Pose X_JS = X_JL * collision.origin.pose();
      const auto found = round_about(collision.geometry, X_JS, axis);
      if (found) radius = std::max(radius.value_or(0.0), *found);
      furthest = std::max(furthest, off_axis(axis, X_JS));
    }
    for (const Joint& other : robot.joints) {
      if (other.parent == link->name && other.type == JointType::fixed)
        rigid.emplace_back(robot.find_link(other.child), X_JL * other.origin.pose());
    }
  }
  return radius && furthest < *radius ? radius : std::nullopt;
}

std::vector<std::string> wheels_of(const RobotDescription& robot) {
  const JointPaths paths(robot);
  std::vector<std::string> by_name, by_shape;
  std::optional<double> first_radius;
  for (const Joint& joint : robot.joints) {
    if (!turns_for_ever(joint)) continue;
    if (lowered(joint.name + ' ' + joint.child).find("wheel") != std::string::npos)
      by_name.push_back(joint.name);
    const bool leaf = std::none_of(robot.joints.begin(), robot.joints.end(), [&](const Joint& other) {
      return other.parent == joint.child && moves(other);
    });
    const auto radius = leaf && lies(paths, joint) ? wheel_radius(robot, joint) : std::nullopt;
    if (!radius) continue;
    if (!first_radius) first_radius = radius;
    if (std::abs(*radius - *first_radius) <= kSameRadius * *first_radius) by_shape.push_back(joint.name);
  }
  return by_name.size() >= 2 ? by_name : by_shape.size() >= 2 ? by_shape : std::vector<std::string>{};
}

// Why none of the robot's shapes can touch the ground; "": some can.
std::string missing_shapes(const RobotDescription& robot) {
  bool written = false, meshes = false;
  for (const Link& link : robot.links) {
    for (const Collision& collision : link.collisions) {
      written = true;
      const auto* mesh = std::get_if<MeshGeometry>(&collision.geometry);
      meshes = meshes || mesh != nullptr;
      if (mesh == nullptr ? has_size(collision.geometry) : !mesh->path.empty() && is_fetched(mesh->path))
        return "";
    }
  }
  if (!written) return "it has no <collision>";
  return meshes ? "none of its collision meshes is found" : "none of its collision shapes has a size";
}

}  // namespace

BaseChoice choose_base(const RobotDescription& robot) {
  if (root_link_of(robot) == "world") return {BaseKind::fixed, "its root is the link 'world'"};
  std::string reason;
  const auto footprint = std::find_if(robot.links.begin(), robot.links.end(),
                                      [](const Link& link) { return link.name.ends_with("base_footprint"); });
  if (footprint != robot.links.end()) {
    reason = fmt::format("it has a link '{}'", footprint->name);
  } else if (const std::string plugin = mobile_plugin(robot); !plugin.empty()) {
    reason = fmt::format("its plugin '{}' drives a mobile base", plugin);
  } else if (const auto wheels = wheels_of(robot); !wheels.empty()) {
    reason = fmt::format("it has wheels ({})", shown(wheels));
  } else if (const auto legs = legs_of(robot); !legs.empty()) {
    reason = fmt::format("it has legs ({})", shown(legs));
  } else {
    return {BaseKind::fixed, "the description has no signs of wheels or legs"};
  }
  if (const std::string missing = missing_shapes(robot); !missing.empty())
    return {BaseKind::fixed, missing + ", so it cannot stand on the ground"};
  return {BaseKind::floating, reason};
}

}  // namespace doppel
