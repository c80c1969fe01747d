#include "doppel/description/scaffold/arm_package.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "doppel/description/scaffold/detail/package_texts.h"

namespace doppel::scaffold {
namespace {

constexpr std::string_view kManifest = R"x(<?xml version="1.0"?>
<package format="3">
  <name>@package@</name>
  <version>0.0.0</version>
  <description>@robot@: @summary@.</description>
  <maintainer email="@email@">@author@</maintainer>
  <license>@licence@</license>

  <buildtool_depend>ament_cmake</buildtool_depend>
  <exec_depend>xacro</exec_depend>
  <exec_depend>robot_state_publisher</exec_depend>
  <exec_depend>ros2_controllers</exec_depend>

  <export>
    <build_type>ament_cmake</build_type>
  </export>
</package>
)x";

constexpr std::string_view kCMake = R"x(cmake_minimum_required(VERSION 3.8)
project(@package@)

find_package(ament_cmake REQUIRED)

install(DIRECTORY urdf config DESTINATION share/${PROJECT_NAME})

ament_package()
)x";

constexpr std::string_view kControllers = R"x(controller_manager:
  ros__parameters:
    update_rate: 200 # Hz
    joint_state_broadcaster:
      type: joint_state_broadcaster/JointStateBroadcaster
    arm_controller:
      type: joint_trajectory_controller/JointTrajectoryController
@gripper_type@
arm_controller:
  ros__parameters:
    joints: [@joints@]
    command_interfaces: [position]
    state_interfaces: [position, velocity]
@gripper@)x";

constexpr std::string_view kGripperType = R"x(    gripper_controller:
      type: joint_trajectory_controller/JointTrajectoryController
)x";

constexpr std::string_view kGripperController = R"x(
gripper_controller:
  ros__parameters:
    joints: [gripper_joint] # gripper_mimic_joint follows it
    command_interfaces: [position]
    state_interfaces: [position, velocity]
)x";

constexpr std::string_view kReadme = R"x(# @package@

@robot@: @summary@.

```
doppel check @package@         # what is wrong with the description, and where
doppel view @package@          # look at it and move its joints in the browser
doppel up @package@            # physics, controllers, ROS 2's topics and actions
doppel move @move@ --in 2      # from another shell
```

| file | holds |
|---|---|
| `urdf/@robot@.urdf.xacro` | links and joints: lengths, radii, limits |
| `urdf/solids.xacro` | the shapes, and their inertias from sizes and densities |
| `urdf/@robot@.ros2_control.xacro` | the interfaces of ros2_control, and the hardware behind them |
| `config/controllers.yaml` | the controllers |

Save any of them while `doppel up` runs, and the arm continues with the new model. Zero is the upright pose;
`initial` in the ros2_control file is where it starts.

With ROS 2, put the folder into a workspace's `src/` and build it with colcon; `use_sim:=true` selects Gazebo's hardware,
else it is mock hardware until you name your driver's plugin.
)x";

constexpr const char* kCounts[] = {"zero",  "one",   "two",  "three", "four",   "five",  "six",
                                   "seven", "eight", "nine", "ten",   "eleven", "twelve"};

std::string count_of(int dof) {
  return dof < static_cast<int>(std::size(kCounts)) ? kCounts[dof] : std::to_string(dof);
}

std::string escaped_xml(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '&') {
      out += "&amp;";
    } else if (c == '<') {
      out += "&lt;";
    } else if (c == '>') {
      out += "&gt;";
    } else if (c == '"') {
      out += "&quot;";
    } else {
      out += c;
    }
  }
  return out;
}

std::string manifest(const PackageName& name, const ArmDesign& design, const PackageAuthor& author) {
  return filled(kManifest, {{"package", name.package},
                            {"robot", name.robot},
                            {"summary", summary(design)},
                            {"email", escaped_xml(author.email)},
                            {"author", escaped_xml(author.name)},
                            {"licence", escaped_xml(author.licence)}});
}

std::string controllers(const ArmDesign& design) {
  std::string joints;
  for (const ArmJoint& joint : design.joints) joints += (joints.empty() ? "" : ", ") + joint.name;
  const bool gripper = design.request.gripper;
  return filled(kControllers, {{"joints", joints},
                               {"gripper_type", std::string(gripper ? kGripperType : "")},
                               {"gripper", std::string(gripper ? kGripperController : "")}});
}

}  // namespace

std::string filled(std::string_view text,
                   std::initializer_list<std::pair<std::string_view, std::string>> values) {
  std::string out;
  while (!text.empty()) {
    const std::size_t at = text.find('@');
    const std::size_t end = at == std::string_view::npos ? at : text.find('@', at + 1);
    out += text.substr(0, at);
    if (end == std::string_view::npos) break;
    const std::string_view name = text.substr(at + 1, end - at - 1);
    const auto value = std::ranges::find(values, name, [](const auto& pair) { return pair.first; });
    if (value == values.end()) throw std::logic_error(fmt::format("the template's '{}' has no value", name));
    out += value->second;
    text.remove_prefix(end + 1);
  }
  return out;
}

std::string summary(const ArmDesign& design) {
  return fmt::format("an arm of {} joint{}{}, reach {:g} m", count_of(design.request.dof),
                     design.request.dof == 1 ? "" : "s",
                     design.request.gripper ? " with a gripper of two fingers" : "", design.request.reach);
}

std::string example_move(const ArmDesign& design) {
  std::string out;
  for (const ArmJoint& joint : design.joints) {
    if (joint.axis == AxisKind::pitch && out.find(' ') == std::string::npos)
      out += fmt::format("{}{}={:g}", out.empty() ? "" : " ", joint.name, joint.initial > 0.5 ? 0.4 : 0.8);
  }
  if (design.request.gripper)
    out += fmt::format(" gripper_joint={:g}", std::round(design.finger_travel * 900) / 1000);
  return out;
}

std::vector<PackageFile> arm_package(const PackageName& name, const ArmDesign& design,
                                     const PackageAuthor& author) {
  return {{"package.xml", manifest(name, design, author)},
          {"CMakeLists.txt", filled(kCMake, {{"package", name.package}})},
          {"README.md", filled(kReadme, {{"package", name.package},
                                         {"robot", name.robot},
                                         {"summary", summary(design)},
                                         {"move", example_move(design)}})},
          {"urdf/" + name.robot + ".urdf.xacro", robot_xacro(name, design)},
          {"urdf/" + name.robot + ".ros2_control.xacro", control_xacro(name, design)},
          {"urdf/solids.xacro", solids_xacro()},
          {"config/controllers.yaml", controllers(design)}};
}

}  // namespace doppel::scaffold
