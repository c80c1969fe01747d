// The robot's place in its world: the root of the tree and the ground.
#include <algorithm>
#include <cmath>
#include <map>

#include "doppel/base/core/text.h"
#include "doppel/description/meshes/mesh_report.h"
#include "doppel/description/urdf/legs.h"
#include "doppel/review/audit/detail/ros_rules.h"
#include "doppel/robot/kinematics/kinematics.h"

namespace doppel::audit_rules {
namespace {

constexpr double kBelow = 0.005;  // m, into the ground
constexpr double kAbove = 0.05;   // m, over it

const Link* root_of(const RobotDescription& robot) {
  const Link* root = nullptr;
  for (const Link& link : robot.links) {
    const bool is_child = std::any_of(robot.joints.begin(), robot.joints.end(),
                                      [&](const Joint& joint) { return joint.child == link.name; });
    if (is_child) continue;
    if (root != nullptr) return nullptr;
    root = &link;
  }
  return root;
}

// Mobile and floating robots are not fixed to a place.
bool stands_freely(const RobotDescription& robot, const Link& root) {
  const std::string& name = root.name;
  if (name.find("footprint") != std::string::npos || name == "odom" || name == "map" || name == "dummy")
    return true;
  std::size_t wheels = 0;
  for (const Joint& joint : robot.joints) {
    if (joint.type == JointType::floating || joint.type == JointType::planar) return true;
    const std::string words = lowered(joint.name + " " + joint.child);
    for (const char* word : {"wheel", "caster", "propeller", "rotor", "track"}) {
      if (words.find(word) != std::string::npos) ++wheels;
    }
  }
  return wheels > 0 || !legs_of(robot).empty();
}

void check_root(const AuditInput& in, const Link& root, Findings& out) {
  const std::string subject = fmt::format("link '{}'", root.name);
  if (root.name == "world") return;
  if (root.inertial && root.inertial->mass > 0) {
    out.add(
        "world.root_inertia", subject, root.inertial->source,
        fmt::format("the root link '{}' has an inertia, which KDL (robot_state_publisher, MoveIt) ignores",
                    root.name),
        "add a parent link without inertia, such as 'world' or 'base_footprint', with a fixed joint");
  }
  const bool moving = std::any_of(in.robot.joints.begin(), in.robot.joints.end(), driven_kind);
  if (!moving || stands_freely(in.robot, root)) return;
  out.add("world.no_world_link", subject, root.source,
          fmt::format("the root is '{}', and it is not fixed to a link 'world'", root.name),
          "add a link 'world' with a fixed joint to it, if the robot is bolted down");
}

// Some descriptions include their surroundings.
bool is_ground(const std::string& name) {
  return name.find("ground") != std::string::npos || name.find("floor") != std::string::npos;
}

// The lowest point of the bodies that are fixed to `world`, in its frame.
struct Lowest {
  double z = kInfinity;
  std::string link;
};

void lower(const Geometry& geometry, const Pose& X_WL, const Origin& origin, const std::string& link,
           Lowest& lowest) {
  const auto shape = report_shape(geometry);
  if (!shape) return;
  const Pose X_WS = X_WL * origin.pose();
  const auto take = [&](const Eigen::Vector3d& point) {
    const double z = (X_WS * point).z();
    if (z < lowest.z) lowest = {z, link};
  };
  for (const Eigen::Vector3d& point : shape->hull) take(point);
}

void check_ground(const AuditInput& in, Findings& out) {
  const Model& model = *in.model;
  if (model.links.empty() || model.links.front().name != "world") return;
  Data data(model);
  forward_kinematics(model, data, model.neutral());
  std::vector<bool> still(model.links.size(), false);
  still[0] = true;
  Lowest base;
  for (std::size_t i = 1; i < model.links.size(); ++i) {
    const ModelJoint& joint = model.joints[static_cast<std::size_t>(model.links[i].joint)];
    still[i] = joint.type == JointType::fixed && still[static_cast<std::size_t>(joint.parent_link)];
    const Link* link = still[i] ? in.robot.find_link(model.links[i].name) : nullptr;
    if (link == nullptr || is_ground(link->name)) continue;
    for (const Collision& c : link->collisions) lower(c.geometry, data.X_WL[i], c.origin, link->name, base);
    if (link->collisions.empty()) {
      for (const Visual& v : link->visuals) lower(v.geometry, data.X_WL[i], v.origin, link->name, base);
    }
  }
  if (base.z == kInfinity || (base.z > -kBelow && base.z < kAbove)) return;
  const Link* link = in.robot.find_link(base.link);
  if (base.z < 0) {
    out.add("world.below_ground", fmt::format("link '{}'", base.link), link->source,
            fmt::format("the base extends {:.1f} mm below z = 0 of 'world'", -1000 * base.z),
            "raise the joint to 'world', or spawn the robot higher");
  } else {
    out.add("world.above_ground", fmt::format("link '{}'", base.link), link->source,
            fmt::format("the lowest point of the base is {:.0f} mm above z = 0 of 'world'", 1000 * base.z),
            "lower the joint to 'world', unless the robot is mounted on something that is not described");
  }
}

}  // namespace

void check_world(const AuditInput& in, Findings& out) {
  const Link* root = root_of(in.robot);
  if (root == nullptr) return;
  check_root(in, *root, out);
  if (in.model != nullptr) check_ground(in, out);
}

}  // namespace doppel::audit_rules
