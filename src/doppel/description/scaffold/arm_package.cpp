#include "doppel/description/scaffold/arm_package.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
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
@hardware_row@
Save any of them while `doppel up` runs, and the arm continues with the new model. Zero is the upright pose;
`initial` in the ros2_control file is where it starts.
@hardware@
With ROS 2, put the folder into a workspace's `src/` and build it with colcon; `use_sim:=true` selects Gazebo's hardware,
else it is
@without_sim@.
)x";

constexpr std::string_view kReadmeOfServos = R"x(
The arm itself, without one (`emulate`, in a shell of its own) or with one on USB:

```
doppel emulate @package@
doppel hardware scan
@check@
doppel up @package@ use_sim:=false
```
)x";

constexpr std::string_view kHardware =
    R"x(# What belongs to one machine and not to the description; `doppel man hardware` lists the keys.
@robot@_hardware: # the name of <ros2_control>
  port: auto # the only USB port or emulated bus; else one that `doppel hardware scan` prints
  # Placeholders, until they are those of your arm:
@placeholders@
  joints:
@joints@)x";

constexpr std::string_view kBusPlaceholders =
    R"x(  #   id         counted from the base on; `doppel hardware set-id` gives a servo its id
  #   direction  1; where `doppel hardware nudge` shows the other way: {id: 2, direction: -1}
  #   offset     0, the middle of the travel; see `doppel calibrate --live`: {id: 2, offset: 9 deg})x";

constexpr std::string_view kBoardPlaceholders =
    R"x(  #   id         the channel of the board, counted from the base on
  #   direction  1; where the joint turns the other way: {id: 2, direction: -1, offset: 0 deg}
  #   offset     0, zero is the middle of the travel)x";

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

// One servo for each joint, and one that moves both fingers.
std::string hardware(const PackageName& name, const ArmDesign& design) {
  const bool board = design.servo->first_id == 0;
  std::string joints;
  int id = design.servo->first_id;
  for (const ArmJoint& joint : design.joints)
    joints += fmt::format("    {}: {{id: {}{}}}\n", joint.name, id++, board ? ", offset: 0 deg" : "");
  if (design.request.gripper) {
    const double scale = 1 / kPinionRadius;
    joints += fmt::format(
        "    gripper_joint: {{id: {}, scale: {:g}, offset: {:.1f} deg}} # a pinion of {:g} mm\n", id, scale,
        -scale * design.finger_travel / 2 * 180 / std::numbers::pi, 1000 * kPinionRadius);
  }
  return filled(kHardware, {{"robot", name.robot},
                            {"joints", joints},
                            {"placeholders", std::string(board ? kBoardPlaceholders : kBusPlaceholders)}});
}

std::string readme(const PackageName& name, const ArmDesign& design) {
  const bool servos = design.servo != nullptr, board = servos && design.servo->first_id == 0;
  const std::string pose = fmt::format("doppel hardware confirm {} --at joint_1=0 ...", name.package);
  const std::string check =
      board ? pose
            : fmt::format("doppel hardware check {0} --fix\ndoppel hardware nudge {0} --joint joint_1",
                          name.package);
  return filled(
      kReadme,
      {{"package", name.package},
       {"robot", name.robot},
       {"summary", summary(design)},
       {"move", example_move(design)},
       {"hardware_row", servos ? "| `config/hardware.yaml` | the port and the ids of the servos |\n" : ""},
       {"hardware", servos ? filled(kReadmeOfServos, {{"package", name.package}, {"check", check}}) : ""},
       {"without_sim", servos ? "doppel's driver of the servos, which other controller managers do not have"
                              : "mock hardware until you name your driver's plugin"}});
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
  return fmt::format(
      "an arm of {} joint{}{}{}, reach {:g} m", count_of(design.request.dof),
      design.request.dof == 1 ? "" : "s", design.request.gripper ? " with a gripper of two fingers" : "",
      design.servo == nullptr ? "" : fmt::format(", servos {}", design.servo->model), design.request.reach);
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
  std::vector<PackageFile> out{{"package.xml", manifest(name, design, author)},
                               {"CMakeLists.txt", filled(kCMake, {{"package", name.package}})},
                               {"README.md", readme(name, design)},
                               {"urdf/" + name.robot + ".urdf.xacro", robot_xacro(name, design)},
                               {"urdf/" + name.robot + ".ros2_control.xacro", control_xacro(name, design)},
                               {"urdf/solids.xacro", solids_xacro()},
                               {"config/controllers.yaml", controllers(design)}};
  if (design.servo != nullptr) out.push_back({"config/hardware.yaml", hardware(name, design)});
  return out;
}

}  // namespace doppel::scaffold
