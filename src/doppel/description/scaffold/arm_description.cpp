// The xacro files of the package. Repeated parts are macros, so that users can edit the sizes.
#include <fmt/format.h>

#include <cmath>

#include "doppel/description/scaffold/detail/package_texts.h"

namespace doppel::scaffold {
namespace {

constexpr std::string_view kSolids = R"x(<?xml version="1.0" encoding="utf-8"?>
<!-- Solids with their visual and collision geometry, and inertias computed from their sizes (m) and densities (kg/m^3). -->
<robot xmlns:xacro="http://www.ros.org/wiki/xacro">

  <xacro:property name="hub_density" value="@hub_density@"/>    <!-- a motor with its gear -->
  <xacro:property name="tube_density" value="@tube_density@"/>    <!-- a thin-walled tube, as a solid one -->
  <xacro:property name="plastic_density" value="1000"/>
  <xacro:property name="hub_ratio" value="@hub_ratio@"/>    <!-- the hub's radius, and half of its length, by the tube's radius -->

  <material name="base_grey"><color rgba="0.25 0.27 0.30 1"/></material>
  <material name="hub_orange"><color rgba="0.90 0.45 0.13 1"/></material>
  <material name="tube_white"><color rgba="0.86 0.87 0.89 1"/></material>

  <xacro:macro name="cylinder_shape" params="radius length xyz rpy material">
    <visual>
      <origin xyz="${xyz}" rpy="${rpy}"/>
      <geometry><cylinder radius="${radius}" length="${length}"/></geometry>
      <material name="${material}"/>
    </visual>
    <collision>
      <origin xyz="${xyz}" rpy="${rpy}"/>
      <geometry><cylinder radius="${radius}" length="${length}"/></geometry>
    </collision>
  </xacro:macro>

  <!-- An upright cylinder that stands on the link's origin. -->
  <xacro:macro name="column_link" params="name radius length density material">
    <xacro:property name="m" value="${density * pi * radius**2 * length}"/>
    <link name="${name}">
      <inertial>
        <origin xyz="0 0 ${length / 2}" rpy="0 0 0"/>
        <mass value="${m}"/>
        <inertia ixx="${m * (3 * radius**2 + length**2) / 12}" ixy="0" ixz="0"
                 iyy="${m * (3 * radius**2 + length**2) / 12}" iyz="0" izz="${m * radius**2 / 2}"/>
      </inertial>
      <xacro:cylinder_shape radius="${radius}" length="${length}" xyz="0 0 ${length / 2}" rpy="0 0 0" material="${material}"/>
    </link>
  </xacro:macro>

  <!-- A box whose underside is centred at the link's origin. -->
  <xacro:macro name="box_link" params="name x y z density material">
    <xacro:property name="m" value="${density * x * y * z}"/>
    <link name="${name}">
      <inertial>
        <origin xyz="0 0 ${z / 2}" rpy="0 0 0"/>
        <mass value="${m}"/>
        <inertia ixx="${m * (y**2 + z**2) / 12}" ixy="0" ixz="0"
                 iyy="${m * (x**2 + z**2) / 12}" iyz="0" izz="${m * (x**2 + y**2) / 12}"/>
      </inertial>
      <visual>
        <origin xyz="0 0 ${z / 2}" rpy="0 0 0"/>
        <geometry><box size="${x} ${y} ${z}"/></geometry>
        <material name="${material}"/>
      </visual>
      <collision>
        <origin xyz="0 0 ${z / 2}" rpy="0 0 0"/>
        <geometry><box size="${x} ${y} ${z}"/></geometry>
      </collision>
    </link>
  </xacro:macro>

  <!-- A link of the arm: a hub (the motor) around its joint, and a tube along z. `roll`: the joint turns
       about z, so that the hub lies along the tube; else it turns about y. -->
  <xacro:macro name="arm_link" params="name roll radius length">
    <xacro:property name="hub_r" value="${hub_ratio * radius}"/>
    <xacro:property name="hub_l" value="${2 * hub_ratio * radius}"/>
    <xacro:property name="hub_m" value="${hub_density * pi * hub_r**2 * hub_l}"/>
    <xacro:property name="tube_m" value="${tube_density * pi * radius**2 * length}"/>
    <xacro:property name="hub_across" value="${hub_m * (3 * hub_r**2 + hub_l**2) / 12}"/>
    <xacro:property name="hub_along" value="${hub_m * hub_r**2 / 2}"/>
    <xacro:property name="tube_across" value="${tube_m * (3 * radius**2 + length**2) / 12}"/>
    <xacro:property name="centre" value="${tube_m * length / 2 / (hub_m + tube_m)}"/>
    <!-- of both about their common centre, which lies on z (parallel axis theorem) -->
    <xacro:property name="shift" value="${hub_m * centre**2 + tube_m * (length / 2 - centre)**2}"/>
    <link name="${name}">
      <inertial>
        <origin xyz="0 0 ${centre}" rpy="0 0 0"/>
        <mass value="${hub_m + tube_m}"/>
        <inertia ixx="${hub_across + tube_across + shift}" ixy="0" ixz="0"
                 iyy="${(hub_across if roll else hub_along) + tube_across + shift}" iyz="0"
                 izz="${(hub_along if roll else hub_across) + tube_m * radius**2 / 2}"/>
      </inertial>
      <xacro:cylinder_shape radius="${hub_r}" length="${hub_l}" xyz="0 0 0" rpy="${0 if roll else pi / 2} 0 0" material="hub_orange"/>
      <xacro:cylinder_shape radius="${radius}" length="${length}" xyz="0 0 ${length / 2}" rpy="0 0 0" material="tube_white"/>
    </link>
  </xacro:macro>

  <xacro:macro name="arm_joint" params="name parent child z axis limit effort velocity">
    <joint name="${name}" type="revolute">
      <origin xyz="0 0 ${z}" rpy="0 0 0"/>
      <parent link="${parent}"/>
      <child link="${child}"/>
      <axis xyz="${axis}"/>
      <limit lower="${-limit}" upper="${limit}" effort="${effort}" velocity="${velocity}"/>
      <!-- of a geared drive: 2 % of its effort as friction, 5 % as drag at full speed -->
      <dynamics damping="${0.05 * effort / velocity}" friction="${0.02 * effort}"/>
    </joint>
  </xacro:macro>

  <xacro:macro name="fixed_joint" params="name parent child z">
    <joint name="${name}" type="fixed">
      <origin xyz="0 0 ${z}" rpy="0 0 0"/>
      <parent link="${parent}"/>
      <child link="${child}"/>
    </joint>
  </xacro:macro>

</robot>
)x";

constexpr std::string_view kRobot = R"x(<?xml version="1.0" encoding="utf-8"?>
<!-- @robot@: @summary@.
     Each effort limit is at least twice what holds the arm stretched out with a payload of @payload@ kg. -->
<robot name="@robot@" xmlns:xacro="http://www.ros.org/wiki/xacro">

  <!-- true: Gazebo drives the joints; false: @hardware@ (see @robot@.ros2_control.xacro) -->
  <xacro:arg name="use_sim" default="false"/>
  <xacro:include filename="solids.xacro"/>
  <xacro:include filename="@robot@.ros2_control.xacro"/>

  <!-- from joint to joint, and of the tubes between them, m; shapes, masses and inertias follow -->
  <xacro:property name="base_height" value="@base_height@"/>
  <xacro:property name="base_radius" value="@base_radius@"/>
@sizes@
  <link name="world"/>
  <xacro:fixed_joint name="world_to_base" parent="world" child="base_link" z="0"/>
  <xacro:column_link name="base_link" radius="${base_radius}" length="${base_height}" density="${hub_density}" material="base_grey"/>

@joints@@tool@
</robot>
)x";

constexpr std::string_view kSizes =
    R"x(  <xacro:property name="@link@_length" value="@length@"/>
  <xacro:property name="@link@_radius" value="@radius@"/>
)x";

constexpr std::string_view kJoint =
    R"x(  <xacro:arm_joint name="@name@" parent="@parent@" child="@link@" z="${@z@}" axis="@axis@"
                   limit="@limit@" effort="@effort@" velocity="@velocity@"/>
  <xacro:arm_link name="@link@" roll="${@roll@}" radius="${@link@_radius}" length="${@tube@}"/>

)x";

constexpr std::string_view kTool = R"x(  <!-- where a tool is mounted -->
  <link name="tool0"/>
  <xacro:fixed_joint name="@last@_to_tool0" parent="@last@" child="tool0" z="${@last@_length}"/>
)x";

constexpr std::string_view kGripper = R"x(
  <!-- Two fingers that slide apart; the right one follows the left one, as a rack and pinion makes it. -->
  <xacro:box_link name="gripper_base" x="@palm_x@" y="@palm_y@" z="@palm_z@" density="${plastic_density}" material="base_grey"/>
  <xacro:fixed_joint name="tool0_to_gripper_base" parent="tool0" child="gripper_base" z="0"/>
  <xacro:macro name="finger" params="name link side">
    <xacro:box_link name="${link}" x="@finger_x@" y="@finger_y@" z="@finger_z@" density="${plastic_density}" material="hub_orange"/>
    <joint name="${name}" type="prismatic">
      <origin xyz="0 ${side * @finger_offset@} @palm_z@" rpy="0 0 0"/>
      <parent link="gripper_base"/>
      <child link="${link}"/>
      <axis xyz="0 ${side} 0"/>
      <limit lower="0" upper="@travel@" effort="@finger_effort@" velocity="@finger_velocity@"/>
      <dynamics damping="@finger_damping@" friction="@finger_friction@"/>
      <xacro:if value="${side == -1}"><mimic joint="gripper_joint"/></xacro:if>
    </joint>
  </xacro:macro>
  <xacro:finger name="gripper_joint" link="left_finger" side="1"/>
  <xacro:finger name="gripper_mimic_joint" link="right_finger" side="-1"/>
)x";

constexpr std::string_view kControl = R"x(<?xml version="1.0" encoding="utf-8"?>
<!-- The interfaces that controllers see, and what is behind them. -->
<robot xmlns:xacro="http://www.ros.org/wiki/xacro">

  <xacro:macro name="driven_joint" params="name initial">
    <joint name="${name}">
      <command_interface name="position"/>
      <state_interface name="position"><param name="initial_value">${initial}</param></state_interface>
      <state_interface name="velocity"/>
    </joint>
  </xacro:macro>

  <ros2_control name="@robot@_hardware" type="system">
    <hardware>
      <xacro:if value="$(arg use_sim)">
        <plugin>gz_ros2_control/GazeboSimSystem</plugin>
      </xacro:if>
      <xacro:unless value="$(arg use_sim)">
        @plugin@
      </xacro:unless>
    </hardware>
@driven@  </ros2_control>

  <xacro:if value="$(arg use_sim)">
    <gazebo>
      <plugin filename="gz_ros2_control-system" name="gz_ros2_control::GazeboSimROS2ControlPlugin">
        <parameters>$(find @package@)/config/controllers.yaml</parameters>
      </plugin>
    </gazebo>
  </xacro:if>

</robot>
)x";

// Rounded to four decimals, as in a description that is written by hand.
std::string number(double value) {
  return fmt::format("{:g}", std::round(value * 1e4) / 1e4);
}

double finger_velocity(const ArmDesign& design) {
  constexpr double kFingerVelocity = 0.1;  // m/s
  return design.servo == nullptr ? kFingerVelocity : design.servo->velocity * kPinionRadius;
}

std::string tool_text(const ArmDesign& design) {
  std::string out = filled(kTool, {{"last", design.joints.back().link}});
  if (!design.request.gripper) return out;
  const double size = design.finger_length;
  return out + filled(kGripper, {{"palm_x", number(0.5 * size)},
                                 {"palm_y", number(1.5 * size)},
                                 {"palm_z", number(0.3 * size)},
                                 {"finger_x", number(0.3 * size)},
                                 {"finger_y", number(0.15 * size)},
                                 {"finger_z", number(size)},
                                 {"finger_offset", number(0.085 * size)},
                                 {"travel", number(design.finger_travel)},
                                 {"finger_effort", number(design.finger_effort)},
                                 {"finger_velocity", number(finger_velocity(design))},
                                 {"finger_damping", number(0.5 * design.finger_effort)},
                                 {"finger_friction", number(0.02 * design.finger_effort)}});
}

}  // namespace

std::string solids_xacro() {
  return filled(kSolids, {{"hub_density", number(kHubDensity)},
                          {"tube_density", number(kTubeDensity)},
                          {"hub_ratio", number(kHubRatio)}});
}

std::string robot_xacro(const PackageName& name, const ArmDesign& design) {
  std::string sizes, joints, parent = "base_link";
  // A hub is centred on its joint: the first one stands on the base, and a tube ends at the next one.
  std::string z = fmt::format("base_height + hub_ratio * {}_radius", design.joints.front().link);
  for (std::size_t i = 0; i < design.joints.size(); ++i) {
    const ArmJoint& joint = design.joints[i];
    const bool roll = joint.axis == AxisKind::roll;
    const std::string length = joint.link + "_length";
    const std::string next_hub = i + 1 < design.joints.size()
                                     ? fmt::format(" - hub_ratio * {}_radius", design.joints[i + 1].link)
                                     : "";
    sizes += filled(
        kSizes, {{"link", joint.link}, {"length", number(joint.length)}, {"radius", number(joint.radius)}});
    joints += filled(kJoint, {{"name", joint.name},
                              {"parent", parent},
                              {"link", joint.link},
                              {"z", z},
                              {"axis", roll ? "0 0 1" : "0 1 0"},
                              {"roll", roll ? "True" : "False"},
                              {"limit", number(joint.upper)},
                              {"effort", number(joint.effort)},
                              {"velocity", number(joint.velocity)},
                              {"tube", length + next_hub}});
    parent = joint.link;
    z = length;
  }
  return filled(kRobot,
                {{"robot", name.robot},
                 {"summary", summary(design)},
                 {"payload", number(design.payload)},
                 {"hardware", design.servo == nullptr ? "mock hardware, or your driver" : "the servos"},
                 {"base_radius", number(design.base_radius)},
                 {"base_height", number(design.base_height)},
                 {"sizes", sizes},
                 {"joints", joints},
                 {"tool", tool_text(design)}});
}

std::string control_xacro(const PackageName& name, const ArmDesign& design) {
  std::string driven;
  const auto add = [&](const std::string& joint, double initial) {
    driven += fmt::format("    <xacro:driven_joint name=\"{}\" initial=\"{}\"/>\n", joint, number(initial));
  };
  for (const ArmJoint& joint : design.joints) add(joint.name, joint.initial);
  if (design.request.gripper) add("gripper_joint", design.finger_travel / 2);
  const std::string plugin =
      design.servo == nullptr
          ? "<plugin>mock_components/GenericSystem</plugin> <!-- your driver's plugin in its place -->"
          : fmt::format(
                "<plugin>{}</plugin> <!-- doppel's driver; ids and port are in config/hardware.yaml -->",
                design.servo->plugin);
  return filled(kControl,
                {{"robot", name.robot}, {"package", name.package}, {"driven", driven}, {"plugin", plugin}});
}

}  // namespace doppel::scaffold
