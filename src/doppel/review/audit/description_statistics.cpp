#include "doppel/review/audit/description_statistics.h"

#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <functional>
#include <set>
#include <sstream>

#include "doppel/base/core/text.h"
#include "doppel/description/urdf/urdf_reader.h"

namespace doppel {
namespace {

constexpr double kTriangleSlack = 1e-9, kUnitSlack = 1e-3, kNoLength = 1e-9;

std::optional<double> number_of(const XmlNode* node, const char* name) {
  const XmlAttribute* a = node == nullptr ? nullptr : node->find(name);
  return a == nullptr ? std::nullopt : parse_number(a->value);
}

std::string name_of(const XmlNode& node) {
  return UrdfReader::optional(node, "name");
}

void each(const XmlNode& node, const std::function<void(const XmlNode&)>& visit) {
  for (const XmlNode& child : node.children) {
    if (child.kind != XmlNode::Kind::element) continue;
    visit(child);
    each(child, visit);
  }
}

void count_tensor(const XmlNode* inertia, DescriptionStatistics& out) {
  std::array<double, 6> c{};
  constexpr std::array kNames{"ixx", "ixy", "ixz", "iyy", "iyz", "izz"};
  for (std::size_t i = 0; i < 6; ++i) {
    const auto value = number_of(inertia, kNames[i]);
    if (!value) {
      ++out.inertia_not_numeric;
      return;
    }
    c[i] = *value;
  }
  if (c == std::array<double, 6>{}) {
    ++out.zero_inertia;
    return;
  }
  if (c == std::array<double, 6>{1, 0, 0, 1, 0, 1}) ++out.identity_inertia;
  Eigen::Matrix3d I;
  I << c[0], c[1], c[2], c[1], c[3], c[4], c[2], c[4], c[5];
  const Eigen::Vector3d m =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(I, Eigen::EigenvaluesOnly).eigenvalues();
  if (m[0] <= 0) ++out.inertia_not_positive_definite;
  if (m[2] > (m[0] + m[1]) * (1 + kTriangleSlack)) ++out.inertia_triangle_violation;
}

void count_link(const XmlNode& link, DescriptionStatistics& out) {
  ++out.links;
  for (const XmlNode& child : link.children) {
    if (child.is("visual")) ++out.visuals;
    if (child.is("collision")) ++out.collisions;
  }
  const XmlNode* inertial = link.first("inertial");
  if (inertial == nullptr) {
    ++out.links_without_inertial;
    return;
  }
  ++out.links_with_inertial;
  if (const auto mass = number_of(inertial->first("mass"), "value")) {
    out.total_mass += *mass;
    if (*mass == 0) ++out.zero_mass;
    if (*mass < 0) ++out.negative_mass;
  } else {
    ++out.inertial_without_mass;
  }
  if (const XmlNode* inertia = inertial->first("inertia")) count_tensor(inertia, out);
}

void count_limit(const XmlNode* limit, bool needs, DescriptionStatistics& out) {
  if (limit == nullptr) {
    if (needs) ++out.movable_joints_without_limit;
    return;
  }
  const double lower = number_of(limit, "lower").value_or(0), upper = number_of(limit, "upper").value_or(0);
  if (needs && lower == 0 && upper == 0) ++out.limits_both_zero;
  if (lower > upper) ++out.limits_lower_above_upper;
  const auto effort = number_of(limit, "effort"), velocity = number_of(limit, "velocity");
  if (!effort || !velocity) ++out.limit_without_effort_or_velocity;
  if (velocity && *velocity >= 100) ++out.velocity_100_or_more;
  if (effort && *effort >= 100) ++out.effort_100_or_more;
  if (velocity && *velocity == 0) ++out.velocity_zero;
  if (effort && *effort == 0) ++out.effort_zero;
}

void count_axis(const XmlNode* axis, DescriptionStatistics& out) {
  const XmlAttribute* xyz = axis == nullptr ? nullptr : axis->find("xyz");
  if (xyz == nullptr) return;
  std::istringstream words(xyz->value);
  std::string word;
  double square = 0;
  while (words >> word) {
    const double x = parse_number(word).value_or(0);
    square += x * x;
  }
  const double length = std::sqrt(square);
  if (length < kNoLength)
    ++out.axis_zero;
  else if (std::abs(length - 1) > kUnitSlack)
    ++out.axis_not_unit;
}

void count_joint(const XmlNode& joint, DescriptionStatistics& out) {
  ++out.joints;
  const std::string type = UrdfReader::optional(joint, "type");
  ++out.joints_by_type[type];
  const bool limited = type == "revolute" || type == "prismatic";
  const bool movable = limited || type == "continuous" || type == "planar";
  if (movable) {
    count_limit(joint.first("limit"), limited, out);
    count_axis(joint.first("axis"), out);
  }
  if (joint.first("mimic") != nullptr) ++out.mimic_joints;
}

void count_tree(const XmlNode& root, DescriptionStatistics& out) {
  std::multiset<std::string> links, joints, children;
  std::set<std::string> ends;
  for (const XmlNode& node : root.children) {
    if (node.is("link")) links.insert(name_of(node));
    if (!node.is("joint")) continue;
    joints.insert(name_of(node));
    for (const char* tag : {"parent", "child"}) {
      const XmlNode* end = node.first(tag);
      if (end == nullptr) continue;
      ends.insert(UrdfReader::optional(*end, "link"));
      if (tag[0] == 'c') children.insert(UrdfReader::optional(*end, "link"));
    }
  }
  const auto repeated = [](const std::multiset<std::string>& names) {
    std::size_t count = 0;
    for (auto i = names.begin(); i != names.end(); i = names.upper_bound(*i))
      count += names.count(*i) > 1 ? 1 : 0;
    return count;
  };
  out.duplicate_link_names = repeated(links);
  out.duplicate_joint_names = repeated(joints);
  out.links_with_two_parents = repeated(children);
  for (const std::string& end : ends) out.joint_links_undefined += links.contains(end) ? 0 : 1;
  std::set<std::string> reported;
  for (const XmlNode& node : root.children) {
    if (!node.is("link") || children.contains(name_of(node)) || !reported.insert(name_of(node)).second)
      continue;
    out.root_links.push_back(name_of(node));
  }
}

void count_meshes(const XmlNode& root, DescriptionStatistics& out) {
  std::set<std::string> names;
  for (const XmlNode& link : root.children) {
    if (!link.is("link")) continue;
    each(link, [&](const XmlNode& node) {
      const XmlAttribute* file = node.name == "mesh" ? node.find("filename") : nullptr;
      if (file == nullptr) return;
      ++out.mesh_references;
      names.insert(file->value);
    });
  }
  out.meshes_unique = names.size();
  for (const std::string& name : names) {
    const std::size_t colon = name.find("://");
    ++out.mesh_schemes[colon == std::string::npos ? name.starts_with('/') ? "absolute" : "relative"
                                                  : name.substr(0, colon)];
  }
}

void count_materials(const XmlNode& root, DescriptionStatistics& out) {
  std::set<std::string> defined, used;
  const auto take = [&](const XmlNode& node, bool visual) {
    if (!node.is("material")) return;
    const std::string name = name_of(node);
    const bool says = node.first("color") != nullptr || node.first("texture") != nullptr;
    if (says) defined.insert(name);
    if (visual && !says && !name.empty()) used.insert(name);
  };
  for (const XmlNode& child : root.children) {
    take(child, false);
    if (!child.is("link")) continue;
    for (const XmlNode& visual : child.children) {
      if (!visual.is("visual")) continue;
      for (const XmlNode& m : visual.children) take(m, true);
    }
  }
  for (const std::string& name : used) out.materials_undefined += defined.contains(name) ? 0 : 1;
}

}  // namespace

DescriptionStatistics count_statistics(const XmlNode& root) {
  DescriptionStatistics out;
  for (const XmlNode& node : root.children) {
    if (node.kind != XmlNode::Kind::element) continue;
    if (node.name == "link")
      count_link(node, out);
    else if (node.name == "joint")
      count_joint(node, out);
    else if (node.name == "transmission")
      ++out.transmissions;
    else if (node.name == "ros2_control")
      ++out.ros2_control_tags;
    else if (node.name == "gazebo")
      ++out.gazebo_tags;
    else if (node.name != "material")
      ++out.other_top_level_tags[node.name];
  }
  count_tree(root, out);
  count_meshes(root, out);
  count_materials(root, out);
  return out;
}

}  // namespace doppel
