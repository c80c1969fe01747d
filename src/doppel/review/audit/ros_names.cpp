#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "doppel/review/audit/detail/ros_rules.h"

namespace doppel::audit_rules {
namespace {

constexpr std::string_view kGazeboFile = "gz_ros2_control-system";
constexpr std::string_view kGazeboClass = "gz_ros2_control::GazeboSimROS2ControlPlugin";
constexpr std::array kGazeboControlPlugins{
    GazeboControlPlugin{kGazeboFile, kGazeboClass, "", ""},
    GazeboControlPlugin{"ign_ros2_control-system", "ign_ros2_control::IgnitionROS2ControlPlugin", kGazeboFile,
                        kGazeboClass},
    GazeboControlPlugin{"gazebo_ros2_control", "", kGazeboFile, kGazeboClass},
    GazeboControlPlugin{"gazebo_ros_control", "", kGazeboFile, kGazeboClass}};

}  // namespace

std::span<const GazeboControlPlugin> gazebo_control_plugins() {
  return kGazeboControlPlugins;
}

std::string library_name(std::string_view file) {
  if (file.starts_with("lib")) file.remove_prefix(3);
  if (file.ends_with(".so")) file.remove_suffix(3);
  return std::string(file);
}

const GazeboControlPlugin* find_gazebo_control_plugin(std::string_view file) {
  const std::string name = library_name(file);
  const auto found = std::find_if(kGazeboControlPlugins.begin(), kGazeboControlPlugins.end(),
                                  [&](const GazeboControlPlugin& p) { return p.file == name; });
  return found == kGazeboControlPlugins.end() ? nullptr : &*found;
}

bool moves(const Joint& joint) {
  return joint.type != JointType::fixed;
}

bool driven_kind(const Joint& joint) {
  return joint.type == JointType::revolute || joint.type == JointType::continuous ||
         joint.type == JointType::prismatic;
}

Names joint_names(const RobotDescription& robot) {
  Names out;
  for (const Joint& joint : robot.joints) out.push_back(joint.name);
  return out;
}

Names link_names(const RobotDescription& robot) {
  Names out;
  for (const Link& link : robot.links) out.push_back(link.name);
  return out;
}

std::string quoted_list(const Names& names, std::size_t at_most) {
  std::string out;
  for (std::size_t i = 0; i < names.size() && i < at_most; ++i) {
    out += fmt::format("{}'{}'", i == 0 ? "" : ", ", names[i]);
  }
  if (names.size() > at_most) out += fmt::format(" and {} more", names.size() - at_most);
  return out;
}

bool contains(const Names& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

std::vector<const XmlNode*> hardware_nodes(const AuditInput& in) {
  std::vector<const XmlNode*> out;
  for (const XmlNode& child : in.expanded.root.children) {
    if (child.is("ros2_control")) out.push_back(&child);
  }
  return out;
}

bool offers_commands(const HardwareJointDescription& joint) {
  return !joint.command_interfaces.empty();
}

}  // namespace doppel::audit_rules
