#include "doppel/scenario/resolve/ros1_controllers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "doppel/scenario/resolve/controllers_file.h"

namespace doppel {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Names = std::vector<std::string>;

// Two wheels 0.4 m apart, of radius 0.1 m, and a joint that steers.
RobotDescription rover() {
  RobotDescription robot;
  robot.name = "rover";
  robot.links.emplace_back().name = "base_link";
  for (const auto& [name, y] : {std::pair{"left", 0.2}, std::pair{"right", -0.2}}) {
    Link& wheel = robot.links.emplace_back();
    wheel.name = std::string(name) + "_link";
    wheel.collisions.emplace_back().geometry = Cylinder{0.1, 0.04};
    Joint& joint = robot.joints.emplace_back();
    joint.name = name;
    joint.child = wheel.name;
    joint.origin.xyz = {0, y, 0};
  }
  Joint& steer = robot.joints.emplace_back();
  steer.name = "steer";
  steer.origin.xyz = {0.5, 0.2, 0};
  return robot;
}

struct Mapped {
  explicit Mapped(const std::string& yaml)
      : file(ros1_controllers(yaml, "control.yaml", rover(), diagnostics)) {}
  [[nodiscard]] ParameterOverrides of(const std::string& node) const {
    return file->overrides_for("/" + node);
  }
  [[nodiscard]] double number(const std::string& node, const std::string& name) const {
    ParameterOverrides all = of(node);
    const ParameterOverride* found = all.find(name);
    return found == nullptr ? -1 : std::get<double>(found->value);
  }
  [[nodiscard]] std::string said() const {
    std::string out;
    for (const Diagnostic& d : diagnostics.all()) out += d.where.place() + ": " + d.message + "\n";
    return out;
  }
  Diagnostics diagnostics;
  std::optional<ParameterFile> file;
};

constexpr const char* kDiffDrive = R"(
rover_joint_publisher: {type: "joint_state_controller/JointStateController", publish_rate: 50}
rover_velocity_controller:
  type: "diff_drive_controller/DiffDriveController"
  left_wheel: ['left']
  right_wheel: 'right'
  velocity_rolling_window_size: 2.4
  odom_frame_id: /odom
  wheel_radius_multiplier: 1.5
  k_l: 0.1
  linear:
    x:
      has_velocity_limits: true
      max_velocity: 1
      has_acceleration_limits: true
      max_acceleration: 3.0
      min_acceleration: -2.0
      max_jerk: 5.0
other_node: {frequency: 50}
)";

TEST(Ros1Controllers, DiffDriveIsMappedWithDimensionsOfDescription) {
  const Mapped mapped(kDiffDrive);
  ASSERT_TRUE(mapped.file);
  const ControllersFile file = controllers_in(*mapped.file);
  EXPECT_TRUE(file.of_ros1);
  EXPECT_TRUE(file.for_ros2);
  ASSERT_EQ(file.controllers.size(), 2U);
  EXPECT_EQ(file.controllers[0].type, "joint_state_broadcaster/JointStateBroadcaster");
  EXPECT_EQ(file.controllers[1].type, "diff_drive_controller/DiffDriveController");
  EXPECT_THAT(file.controllers[1].named_joints(), ElementsAre("left", "right"));
  const std::string base = "rover_velocity_controller";
  EXPECT_DOUBLE_EQ(mapped.number(base, "wheel_separation"), 0.4);
  EXPECT_DOUBLE_EQ(mapped.number(base, "wheel_radius"), 0.1);
  EXPECT_DOUBLE_EQ(mapped.number(base, "left_wheel_radius_multiplier"), 1.5);
  EXPECT_DOUBLE_EQ(mapped.number(base, "right_wheel_radius_multiplier"), 1.5);
  ParameterOverrides all = mapped.of(base);
  EXPECT_EQ(std::get<std::int64_t>(all.find("velocity_rolling_window_size")->value), 2);
  EXPECT_EQ(std::get<std::string>(all.find("odom_frame_id")->value), "odom");
}

TEST(Ros1Controllers, LimitsHoldWhereTheyAreSwitchedOn) {
  const Mapped mapped(kDiffDrive);
  const std::string base = "rover_velocity_controller";
  EXPECT_DOUBLE_EQ(mapped.number(base, "linear.x.max_velocity"), 1.0);
  EXPECT_DOUBLE_EQ(mapped.number(base, "linear.x.max_acceleration"), 3.0);
  EXPECT_DOUBLE_EQ(mapped.number(base, "linear.x.max_deceleration"), -2.0);
  EXPECT_DOUBLE_EQ(mapped.number(base, "linear.x.max_acceleration_reverse"), -2.0);
  EXPECT_DOUBLE_EQ(mapped.number(base, "linear.x.max_deceleration_reverse"), 3.0);
  EXPECT_DOUBLE_EQ(mapped.number(base, "linear.x.max_jerk"), -1) << "expected no jerk limit";
}

TEST(Ros1Controllers, ParameterWithoutCounterpartIsReportedAtItsPlace) {
  const Mapped mapped(kDiffDrive);
  EXPECT_THAT(mapped.said(),
              HasSubstr("control.yaml:10:8: 'k_l' of the controller 'rover_velocity_controller' has no "
                        "counterpart"));
  EXPECT_THAT(mapped.said(), HasSubstr("from the description: wheel separation 0.4 m, wheel radius 0.1 m"));
  EXPECT_FALSE(mapped.diagnostics.has_errors());
}

TEST(Ros1Controllers, NamespaceIsLeftOutAndArgumentsAreEmpty) {
  const Mapped mapped(
      "robots:\n  /rover:\n    base: {type: diff_drive_controller/DiffDriveController, left_wheel: '$(arg "
      "prefix)left', right_wheel: ['$(arg prefix)right']}\n");
  ASSERT_TRUE(mapped.file);
  const ControllersFile file = controllers_in(*mapped.file);
  ASSERT_EQ(file.controllers.size(), 1U);
  EXPECT_EQ(file.controllers[0].name, "base");
  EXPECT_THAT(file.controllers[0].named_joints(), ElementsAre("left", "right"));
  EXPECT_THAT(mapped.said(), HasSubstr("arguments of its launch file are empty: prefix"));
}

TEST(Ros1Controllers, MecanumKeepsItsTopicsAndHalfOfBothSeparations) {
  const Mapped mapped(R"(
base:
  type: "mecanum_drive_controller/MecanumDriveController"
  front_left_wheel_joint: left
  front_right_wheel_joint: right
  back_left_wheel_joint: rear_left
  back_right_wheel_joint: rear_right
  wheel_separation_x: 0.6
  wheel_separation_y: 0.5
  wheel_separation_multiplier: 2.0
  cmd_vel_timeout: 0.25
)");
  ASSERT_TRUE(mapped.file);
  EXPECT_DOUBLE_EQ(mapped.number("base", "kinematics.sum_of_robot_center_projection_on_X_Y_axis"), 1.1);
  EXPECT_DOUBLE_EQ(mapped.number("base", "kinematics.wheels_radius"), 0.1);
  EXPECT_DOUBLE_EQ(mapped.number("base", "reference_timeout"), 0.25);
  ParameterOverrides all = mapped.of("base"), manager = mapped.of("controller_manager");
  EXPECT_EQ(std::get<std::string>(all.find("rear_right_wheel_command_joint_name")->value), "rear_right");
  EXPECT_THAT(std::get<Names>(manager.find("base.node_options_args")->value),
              ElementsAre("-r", "~/reference:=base/cmd_vel", "-r", "~/odometry:=base/odom", "-r",
                          "~/tf_odometry:=/tf"));
}

TEST(Ros1Controllers, SteeredBaseIsBicycle) {
  const Mapped mapped(
      "base: {type: ackermann_steering_controller/AckermannSteeringController, rear_wheel: left, "
      "front_steer: "
      "steer}\n");
  ASSERT_TRUE(mapped.file);
  EXPECT_EQ(controllers_in(*mapped.file).controllers.at(0).type,
            "bicycle_steering_controller/BicycleSteeringController");
  EXPECT_DOUBLE_EQ(mapped.number("base", "wheelbase"), 0.5);
  EXPECT_DOUBLE_EQ(mapped.number("base", "traction_wheel_radius"), 0.1);
  EXPECT_DOUBLE_EQ(mapped.number("base", "reference_timeout"), 0.5);
}

TEST(Ros1Controllers, TypeWithoutCounterpartIsReported) {
  const Mapped mapped("base: {type: four_wheel_steering_controller/FourWheelSteeringController}\n");
  ASSERT_TRUE(mapped.file);
  EXPECT_TRUE(controllers_in(*mapped.file).controllers.empty());
  EXPECT_THAT(mapped.said(),
              HasSubstr("control.yaml:1:14: the controller type "
                        "'four_wheel_steering_controller/FourWheelSteeringController' of ROS 1 has no"));
}

TEST(Ros1Controllers, FileOfRos2WithoutManagerDeclaresItsTypedSections) {
  Diagnostics diagnostics;
  const ParameterFile file = parse_controllers(
      "base:\n  ros__parameters: {type: diff_drive_controller/DiffDriveController, left_wheel_names: "
      "[left]}\n",
      "base.yaml", rover(), diagnostics);
  const ControllersFile found = controllers_in(file);
  EXPECT_FALSE(found.of_ros1);
  EXPECT_TRUE(found.for_ros2);
  ASSERT_EQ(found.controllers.size(), 1U);
  EXPECT_EQ(found.controllers[0].type, "diff_drive_controller/DiffDriveController");
  EXPECT_THAT(found.controllers[0].named_joints(), ElementsAre("left"));
}

TEST(Ros1Controllers, OtherFilesAreNotOfRos1) {
  EXPECT_FALSE(Mapped("a: {type: plain}\n").file);
  EXPECT_FALSE(Mapped("c:\n  ros__parameters: {type: diff_drive_controller/DiffDriveController}\n").file);
}

}  // namespace
}  // namespace doppel
