#include "doppel/twin/base_choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <numbers>
#include <optional>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "doppel/core/text.h"
#include "doppel/description/mesh.h"
#include "doppel/description/simulator_plugins.h"
#include "doppel/physics/collision_shape.h"
#include "doppel/twin/detail/root_link.h"

namespace doppel {
namespace {

// Names of parts that only legs have: anywhere in a name, and as whole words.
constexpr std::array<std::string_view, 11> kLegParts{"knee",      "ankle",    "thigh",   "shank",
                                                     "tibia",     "femur",    "foot",    "upper_leg",
                                                     "lower_leg", "upperleg", "lowerleg"};
constexpr std::array<std::string_view, 8> kLegWords{"calf", "shin",   "haa", "hfe",
                                                    "kfe",  "tarsus", "leg", "legs"};
constexpr std::string_view kNoFoot = "footprint";
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

// The joint above each link.
using Parents = std::unordered_map<std::string_view, const Joint*>;

Parents parents_of(const RobotDescription& robot) {
  Parents out;
  for (const Joint& joint : robot.joints) out.emplace(joint.child, &joint);
  return out;
}

// The joints from this one up to the root.
std::vector<const Joint*> way_to_root(const Parents& parents, const Joint& joint) {
  std::vector<const Joint*> out{&joint};
  while (out.size() <= parents.size()) {
    const auto up = parents.find(out.back()->parent);
    if (up == parents.end()) break;
    out.push_back(up->second);
  }
  return out;
}

// Whether a wheel on this joint would roll on the ground: its axis is horizontal with all joints at zero.
bool lies(const Parents& parents, const Joint& joint) {
  Eigen::Vector3d axis = joint.axis.normalized();
  for (const Joint* at : way_to_root(parents, joint)) axis = at->origin.pose().linear() * axis;
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

// The radius of a wheel: a round shape about the axis of the joint that carries it, from which no other shape of
// the links that are fixed to it protrudes, as the foot does from a round knee.
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

std::vector<std::string> wheels_of(const RobotDescription& robot, const Parents& parents) {
  std::vector<std::string> by_name, by_shape;
  std::optional<double> first_radius;
  for (const Joint& joint : robot.joints) {
    if (!turns_for_ever(joint)) continue;
    if (lowered(joint.name + ' ' + joint.child).find("wheel") != std::string::npos)
      by_name.push_back(joint.name);
    const bool leaf = std::none_of(robot.joints.begin(), robot.joints.end(), [&](const Joint& other) {
      return other.parent == joint.child && moves(other);
    });
    const auto radius = leaf && lies(parents, joint) ? wheel_radius(robot, joint) : std::nullopt;
    if (!radius) continue;
    if (!first_radius) first_radius = radius;
    if (std::abs(*radius - *first_radius) <= kSameRadius * *first_radius) by_shape.push_back(joint.name);
  }
  return by_name.size() >= 2 ? by_name : by_shape.size() >= 2 ? by_shape : std::vector<std::string>{};
}

bool is_leg_part(const std::string& name) {
  const std::string text = lowered(name);
  const bool part = std::any_of(kLegParts.begin(), kLegParts.end(),
                                [&](std::string_view one) { return text.find(one) != std::string::npos; });
  const std::vector<std::string> words = words_of_name(name);
  const bool word = std::any_of(words.begin(), words.end(), [](const std::string& one) {
    return std::find(kLegWords.begin(), kLegWords.end(), one) != kLegWords.end();
  });
  return (part || word) && text.find(kNoFoot) == std::string::npos;
}

bool has_word(const std::string& name, std::string_view word) {
  const std::vector<std::string> words = words_of_name(name);
  return std::find(words.begin(), words.end(), word) != words.end();
}

// "lower" is part of a leg behind a hip, and of an arm behind a shoulder.
bool is_lower_leg(const Joint& joint, const std::vector<const Joint*>& way) {
  const auto any = [](const Joint& of, std::string_view word) {
    return has_word(of.name, word) || has_word(of.child, word);
  };
  return any(joint, "lower") &&
         std::any_of(way.begin(), way.end(), [&](const Joint* at) { return any(*at, "hip"); });
}

// Links named as parts of a leg, behind two or more moving joints, which excludes the feet of a stand.
std::vector<std::string> legs_of(const RobotDescription& robot, const Parents& parents) {
  std::vector<std::string> out;
  for (const Joint& joint : robot.joints) {
    const bool named = is_leg_part(joint.name);
    const auto way = way_to_root(parents, joint);
    if (!named && !is_leg_part(joint.child) && !is_lower_leg(joint, way)) continue;
    const auto moving = std::count_if(way.begin(), way.end(), [](const Joint* at) { return moves(*at); });
    if (moving >= 2) out.push_back(named ? joint.name : joint.child);
  }
  return out;
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

std::vector<std::string> words_of_name(const std::string& name) {
  std::vector<std::string> out;
  std::string word;
  const auto end = [&] {
    if (!word.empty()) out.push_back(lowered(word));
    word.clear();
  };
  const auto upper = [&](std::size_t i) {
    return i < name.size() && std::isupper(static_cast<unsigned char>(name[i])) != 0;
  };
  const auto lower = [&](std::size_t i) {
    return i < name.size() && std::islower(static_cast<unsigned char>(name[i])) != 0;
  };
  for (std::size_t i = 0; i < name.size(); ++i) {
    if (!upper(i) && !lower(i)) {
      end();
      continue;
    }
    const bool begins = upper(i) && i > 0 && (lower(i - 1) || (upper(i - 1) && lower(i + 1)));
    if (begins) end();
    word += name[i];
  }
  end();
  return out;
}

BaseChoice choose_base(const RobotDescription& robot) {
  const Parents parents = parents_of(robot);
  if (root_link_of(robot) == "world") return {BaseKind::fixed, "its root is the link 'world'"};
  std::string reason;
  const auto footprint = std::find_if(robot.links.begin(), robot.links.end(),
                                      [](const Link& link) { return link.name.ends_with("base_footprint"); });
  if (footprint != robot.links.end()) {
    reason = fmt::format("it has a link '{}'", footprint->name);
  } else if (const std::string plugin = mobile_plugin(robot); !plugin.empty()) {
    reason = fmt::format("its plugin '{}' drives a mobile base", plugin);
  } else if (const auto wheels = wheels_of(robot, parents); !wheels.empty()) {
    reason = fmt::format("it has wheels ({})", shown(wheels));
  } else if (const auto legs = legs_of(robot, parents); !legs.empty()) {
    reason = fmt::format("it has legs ({})", shown(legs));
  } else {
    return {BaseKind::fixed, "the description has no signs of wheels or legs"};
  }
  if (const std::string missing = missing_shapes(robot); !missing.empty())
    return {BaseKind::fixed, missing + ", so it cannot stand on the ground"};
  return {BaseKind::floating, reason};
}

}  // namespace doppel
