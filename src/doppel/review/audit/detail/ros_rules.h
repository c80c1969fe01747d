#pragma once
// Shared by the rules about ROS: the existing plugins and controllers, and small queries of a
// description. Lists: ros2_controllers, gz_ros2_control (Jazzy), and the names that earlier releases used.

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/description/gazebo/simulator_plugins.h"
#include "doppel/description/srdf/srdf.h"
#include "doppel/review/audit/detail/package_files.h"
#include "doppel/review/audit/detail/rules.h"

namespace doppel::audit_rules {

using Names = std::vector<std::string>;

// <gazebo><plugin filename="..."> of ros2_control, with its class.
struct GazeboControlPlugin {
  std::string_view file, class_name, present_file, present_class;
};
std::span<const GazeboControlPlugin> gazebo_control_plugins();
// The plugin with this file name, with or without "lib" and ".so".
const GazeboControlPlugin* find_gazebo_control_plugin(std::string_view file);
std::string library_name(std::string_view file);  // "libgz_x-system.so" -> "gz_x-system"

bool moves(const Joint& joint);        // not fixed
bool driven_kind(const Joint& joint);  // revolute, continuous or prismatic
Names joint_names(const RobotDescription& robot);
Names link_names(const RobotDescription& robot);
std::string quoted_list(const Names& names, std::size_t at_most = 6);  // "'a', 'b' and 3 more"
bool contains(const Names& names, std::string_view name);
// The <ros2_control> elements below <robot>, in the order of RobotDescription::hardware.
std::vector<const XmlNode*> hardware_nodes(const AuditInput& in);
bool offers_commands(const HardwareJointDescription& joint);

void check_hardware(const AuditInput& in, Findings& out);   // rules_hardware.cpp
void check_gazebo(const AuditInput& in, Findings& out);     // rules_gazebo.cpp
void check_arguments(const AuditInput& in, Findings& out);  // rules_arguments.cpp
// rules_srdf_covers.cpp
void check_srdf_covers(const AuditInput& input, const SrdfDescription& srdf, Findings& out);
// rules_launch.cpp
void check_launch(const AuditInput& in, const PackageManifest& manifest, Findings& out);

}  // namespace doppel::audit_rules
