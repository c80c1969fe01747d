#pragma once
// Counts of a description as written, also of a faulty one: from the XML tree, without a parser that could
// repair it. The same counts as in the manifest of the robot corpus, whose README defines each.

#include <map>
#include <string>
#include <vector>

#include "doppel/base/xml/xml.h"
#include "doppel/export.h"

namespace doppel {

struct DescriptionStatistics {
  std::size_t links = 0, joints = 0;
  std::map<std::string, std::size_t> joints_by_type;
  std::vector<std::string> root_links;  // no joint's child, in the file's order
  std::size_t duplicate_link_names = 0, duplicate_joint_names = 0, joint_links_undefined = 0,
              links_with_two_parents = 0;
  double total_mass = 0;  // kg
  std::size_t links_with_inertial = 0, links_without_inertial = 0, inertial_without_mass = 0;
  std::size_t zero_mass = 0, negative_mass = 0;
  std::size_t zero_inertia = 0, identity_inertia = 0, inertia_not_positive_definite = 0,
              inertia_triangle_violation = 0, inertia_not_numeric = 0;
  std::size_t movable_joints_without_limit = 0, limits_both_zero = 0, limits_lower_above_upper = 0,
              limit_without_effort_or_velocity = 0;
  std::size_t velocity_100_or_more = 0, effort_100_or_more = 0, velocity_zero = 0, effort_zero = 0;
  std::size_t axis_zero = 0, axis_not_unit = 0, mimic_joints = 0;
  std::size_t visuals = 0, collisions = 0, mesh_references = 0, meshes_unique = 0;
  std::map<std::string, std::size_t> mesh_schemes;  // of the distinct file names
  std::size_t materials_undefined = 0, transmissions = 0, ros2_control_tags = 0, gazebo_tags = 0;
  std::map<std::string, std::size_t> other_top_level_tags;
};

DOPPEL_API DescriptionStatistics count_statistics(const XmlNode& root);

}  // namespace doppel
