// The controller that is generated for a robot on wheels without a controllers' file and without a plugin.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "doppel/ros/messages/geometry_msgs.h"
#include "doppel/ros/messages/nav_msgs.h"
#include "doppel/twin/assembly/twin.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

struct WheelText {
  std::string name = "";
  double x = 0, y = 0, radius = 0.1;
  std::string axis = "0 1 0", parent = "base_footprint", rpy = "0 0 0", friction = "";
};

std::string body_text(const std::string& name, const std::string& shape, double mass = 1) {
  return "<link name='" + name + "'><inertial><mass value='" + std::to_string(mass) +
         "'/><inertia ixx='0.02' iyy='0.02' izz='0.02' ixy='0' ixz='0' iyz='0'/></inertial><collision>" +
         shape + "</collision></link>";
}
std::string joint_text(const std::string& name, const std::string& type, const std::string& parent,
                       const std::string& child, double x, double y, const std::string& axis,
                       const std::string& rpy = "0 0 0") {
  return "<joint name='" + name + "' type='" + type + "'><parent link='" + parent + "'/><child link='" +
         child + "'/><origin xyz='" + std::to_string(x) + " " + std::to_string(y) + " 0' rpy='" + rpy +
         "'/><axis xyz='" + axis + "'/><limit effort='20' velocity='30' lower='-0.6' upper='0.6'/></joint>";
}
// A wheel as a cylinder, whose link may be turned.
std::string text_of(const WheelText& w) {
  return body_text(w.name + "_link", "<origin xyz='0 0 0' rpy='1.5707963 0 0'/><geometry><cylinder radius='" +
                                         std::to_string(w.radius) + "' length='0.04'/></geometry>") +
         joint_text(w.name, "continuous", w.parent, w.name + "_link", w.x, w.y, w.axis, w.rpy) +
         (w.friction.empty() ? "" : "<gazebo reference='" + w.name + "_link'>" + w.friction + "</gazebo>");
}
// A link on a joint about the vertical, in the height of the axles.
std::string fork_text(const std::string& name, const std::string& type, double x, double y) {
  return "<link name='" + name +
         "_link'><inertial><mass value='0.5'/><inertia ixx='0.01' iyy='0.01' izz='0.01' "
         "ixy='0' ixz='0' iyz='0'/></inertial></link>" +
         joint_text(name, type, "base_footprint", name + "_link", x, y, "0 0 1");
}

class BaseWheelsTest : public ::testing::Test {
 protected:
  BaseWheelsTest() : folder_(fs::temp_directory_path() / ("doppel_wheels_" + std::to_string(::getpid()))) {
    fs::create_directories(folder_);
  }
  ~BaseWheelsTest() override { fs::remove_all(folder_); }

  void up(const std::string& parts, const std::string& controllers = "") {
    std::ofstream(folder_ / "rover.urdf")
        << "<robot name='rover'>"
        << body_text("base_footprint", "<geometry><box size='0.2 0.1 0.05'/></geometry>", 8) << parts
        << "</robot>";
    Scenario scenario;
    scenario.robots = {{.target = (folder_ / "rover.urdf").string()}};
    scenario.start_controllers = start_controllers_;
    if (!controllers.empty()) {
      std::ofstream(folder_ / "controllers.yaml") << controllers;
      scenario.robots.front().controllers = {folder_ / "controllers.yaml"};
    }
    Diagnostics diagnostics;
    edge_.reset();
    twin_ = std::make_unique<Twin>(scenario, log_, diagnostics);
    edge_ = twin_->bus().attach("program");
    said_.clear();
    for (const Diagnostic& d : diagnostics.all()) said_ += d.rule + ": " + d.message + "\n";
  }
  [[nodiscard]] std::string base_type(const std::string& name = "base_controller") const {
    for (const ControllerView& c : twin_->robot().controller_manager().controllers()) {
      if (c.name == name && c.state == ControllerState::active) return c.type;
    }
    return "";
  }
  // Drives for two seconds; returns the velocity of the base in its own axes, over the last one.
  geometry_msgs::msg::Twist driven(double x, double y, double yaw) {
    const geometry_msgs::msg::Twist twist{{x, y, 0}, {0, 0, yaw}};
    Pose before;
    for (int i = 0; i < 2000; ++i) {
      if (i == 1000) before = pose();
      if (i % 50 == 0) {
        const Status sent =
            edge_->publish("/teleop", "/cmd_vel", geometry_msgs::msg::Twist::kType, to_cdr(twist));
        EXPECT_TRUE(sent.ok()) << sent.why();
      }
      twin_->between_steps();
      twin_->step();
    }
    const Pose moved = before.inverse() * pose();
    const double turn = std::atan2(moved.linear()(1, 0), moved.linear()(0, 0));
    // The velocity of an arc, from its chord.
    const double half = turn / 2, arc = std::abs(half) > 1e-9 ? half / std::sin(half) : 1.0;
    const double dx = moved.translation().x() * arc, dy = moved.translation().y() * arc;
    return {{std::cos(half) * dx + std::sin(half) * dy, -std::sin(half) * dx + std::cos(half) * dy, 0},
            {0, 0, turn}};
  }
  [[nodiscard]] Pose pose() const { return twin_->robot().instance().base_pose(); }

  fs::path folder_;
  bool start_controllers_ = true;
  Log log_;
  std::unique_ptr<Twin> twin_;
  std::unique_ptr<Edge> edge_;
  std::string said_;
};

// The continuous joints of an arm are no casters, and fall without a controller.
TEST_F(BaseWheelsTest, ContinuousJointOfArmOnBaseIsHeld) {
  up(text_of({"left", 0, 0.2}) + text_of({"right", 0, -0.2}) + fork_text("swivel", "continuous", -0.2, 0) +
     text_of({.name = "caster", .x = -0.03, .parent = "swivel_link"}) +
     fork_text("shoulder", "revolute", 0.05, 0) +
     body_text("forearm_link", "<geometry><box size='0.1 0.05 0.05'/></geometry>") +
     joint_text("roll", "continuous", "shoulder_link", "forearm_link", 0.1, 0, "1 0 0"));
  EXPECT_EQ(base_type(), "diff_drive_controller/DiffDriveController") << said_;
  EXPECT_THAT(said_, HasSubstr("joint_trajectory_controller with 2 joints"));
  const Instance robot = twin_->robot().instance();
  EXPECT_EQ(robot.drive(robot.model().find_joint("roll")), DriveMode::position);
  EXPECT_EQ(robot.drive(robot.model().find_joint("swivel")), DriveMode::passive);
}

TEST_F(BaseWheelsTest, StartWithoutControllersHasNoNoteOfGeneratedOnes) {
  const std::string parts =
      text_of({"left", 0, 0.2}) + text_of({"right", 0, -0.2}) + fork_text("turret", "revolute", 0.1, 0);
  up(parts);
  EXPECT_THAT(said_, HasSubstr("up.base_generated"));
  EXPECT_THAT(said_, HasSubstr("up.controllers_generated"));
  start_controllers_ = false;
  up(parts);
  EXPECT_THAT(said_, Not(HasSubstr("up.base_generated")));
  EXPECT_THAT(said_, Not(HasSubstr("up.controllers_generated")));
}

TEST_F(BaseWheelsTest, TwoWheelsAndCasterGetDiffDrive) {
  up(text_of({"left", 0, 0.2}) + text_of({"right", 0, -0.2}) + fork_text("swivel", "continuous", -0.2, 0) +
     text_of({.name = "caster", .x = -0.03, .parent = "swivel_link"}));
  EXPECT_EQ(base_type(), "diff_drive_controller/DiffDriveController") << said_;
  EXPECT_THAT(said_, HasSubstr("wheels left and right, separation 0.4 m, radius 0.1 m"));
  EXPECT_THAT(said_, Not(HasSubstr("joint_trajectory_controller with"))) << "expected the caster to be free";
  const auto v = driven(0.3, 0, 0);
  EXPECT_NEAR(v.linear.x, 0.3, 0.003);
  EXPECT_NEAR(v.angular.z, 0, 0.003);
}

TEST_F(BaseWheelsTest, WheelsOfOneSideAreListedFromFrontToRear) {
  up(text_of({"l2", -0.2, 0.2}) + text_of({"l1", 0.2, 0.2}) + text_of({"r1", 0.2, -0.2}) +
     text_of({"r2", -0.2, -0.2}));
  EXPECT_THAT(said_, HasSubstr("wheels l1, l2 and r1, r2, separation 0.4 m"));
  EXPECT_THAT(said_, HasSubstr("these wheels scrub in turns"));
  EXPECT_NEAR(driven(0.3, 0, 0).linear.x, 0.3, 0.003);
}

TEST_F(BaseWheelsTest, TwoSteeredWheelsGetAckermann) {
  up(fork_text("steer_l", "revolute", 0.3, 0.15) + fork_text("steer_r", "revolute", 0.3, -0.15) +
     text_of({.name = "fl", .parent = "steer_l_link"}) + text_of({.name = "fr", .parent = "steer_r_link"}) +
     text_of({"rl", -0.1, 0.15}) + text_of({"rr", -0.1, -0.15}));
  EXPECT_EQ(base_type(), "ackermann_steering_controller/AckermannSteeringController") << said_;
  EXPECT_THAT(said_, HasSubstr("wheelbase 0.4 m"));
  const auto v = driven(0.4, 0, 0.3);  // of the root, which is 0.1 m before the driven axle
  EXPECT_NEAR(v.linear.x, 0.4, 0.004);
  EXPECT_NEAR(v.linear.y, 0.03, 0.004);
  EXPECT_NEAR(v.angular.z, 0.3, 0.006);
}

TEST_F(BaseWheelsTest, ForkWithoutTrailSteersAndOneWithTrailIsCaster) {
  const std::string driven = text_of({"rl", -0.1, 0.15}) + text_of({"rr", -0.1, -0.15});
  up(driven + fork_text("fork", "continuous", 0.3, 0) + text_of({.name = "front", .parent = "fork_link"}));
  EXPECT_EQ(base_type(), "tricycle_steering_controller/TricycleSteeringController") << said_;
  up(driven + fork_text("fork", "continuous", 0.3, 0) +
     text_of({.name = "front", .x = -0.03, .parent = "fork_link"}));
  EXPECT_EQ(base_type(), "diff_drive_controller/DiffDriveController") << said_;
}

TEST_F(BaseWheelsTest, SteeringAxisThatPointsDownIsReported) {
  std::string fork = fork_text("fork", "revolute", 0.3, 0);
  fork.replace(fork.find("xyz='0 0 1'"), 11, "xyz='0 0 -1'");
  up(text_of({"rl", -0.1, 0.15}) + text_of({"rr", -0.1, -0.15}) + fork +
     text_of({.name = "front", .parent = "fork_link"}));
  EXPECT_EQ(base_type(), "");
  EXPECT_THAT(said_, HasSubstr("a positive angle of 'fork' steers to the right"));
}

// Wheels with rollers: friction along the rolling direction only, or along the axis of the roller.
std::string rollers(const std::string& direction) {
  return "<collision><surface><friction><ode><mu>0.9</mu><mu2>0</mu2><fdir1 "
         "gz:expressed_in='base_footprint'>" +
         direction + "</fdir1></ode></friction></surface></collision>";
}

TEST_F(BaseWheelsTest, OmniWheelsDriveInEveryDirection) {
  std::string parts;
  for (int i = 0; i < 3; ++i) {
    const double angle = 2 * M_PI / 3 * i, c = std::cos(angle), s = std::sin(angle);
    const std::string direction = std::to_string(-s) + " " + std::to_string(c) + " 0";
    parts += text_of({.name = "w" + std::to_string(i),
                      .x = 0.25 * c,
                      .y = 0.25 * s,
                      .axis = "0 -1 0",
                      .rpy = "0 0 " + std::to_string(angle + M_PI / 2),
                      .friction = rollers(direction)});
  }
  up(parts);
  EXPECT_EQ(base_type(), "omni_wheel_drive_controller/OmniWheelDriveController") << said_;
  EXPECT_THAT(said_, HasSubstr("wheels w0, w1, w2, 0.25 m from the centre, radius 0.1 m"));
  const auto v = driven(0.3, 0.2, 0.4);
  EXPECT_NEAR(v.linear.x, 0.3, 3e-4);
  EXPECT_NEAR(v.linear.y, 0.2, 3e-4);
  EXPECT_NEAR(v.angular.z, 0.4, 4e-4);
}

TEST_F(BaseWheelsTest, DiagonalRollersGetMecanum) {
  up(text_of({.name = "fl", .x = 0.2, .y = 0.2, .friction = rollers("1 -1 0")}) +
     text_of({.name = "fr", .x = 0.2, .y = -0.2, .friction = rollers("1 1 0")}) +
     text_of({.name = "rl", .x = -0.2, .y = 0.2, .friction = rollers("1 1 0")}) +
     text_of({.name = "rr", .x = -0.2, .y = -0.2, .friction = rollers("1 -1 0")}));
  EXPECT_EQ(base_type(), "mecanum_drive_controller/MecanumDriveController") << said_;
  const auto v = driven(0.3, 0.2, 0.4);
  EXPECT_NEAR(v.linear.x, 0.3, 3e-4);
  EXPECT_NEAR(v.linear.y, 0.2, 3e-4);
  EXPECT_NEAR(v.angular.z, 0.4, 4e-4);
}

TEST_F(BaseWheelsTest, FoundFileThatLeavesWheelsAloneGetsBaseController) {
  fs::create_directories(folder_ / "config");
  std::ofstream(folder_ / "package.xml") << "<package format='3'><name>rover</name></package>";
  std::ofstream(folder_ / "config/controllers.yaml")
      << "controller_manager: {ros__parameters: {update_rate: 100, base_controller: {type: nobodys/Type}, "
         "joint_state_broadcaster: {type: joint_state_broadcaster/JointStateBroadcaster}}}\n";
  up(text_of({"l1", 0.2, 0.2}) + text_of({"r1", 0.2, -0.2}) + text_of({"l2", -0.2, 0.2}) +
     text_of({"r2", -0.2, -0.2}));
  EXPECT_EQ(base_type("base_controller_rest"), "diff_drive_controller/DiffDriveController") << said_;
  EXPECT_NEAR(driven(0.3, 0, 0).linear.x, 0.3, 0.003);
}

TEST_F(BaseWheelsTest, ValuesOfContactsWithoutEffectAreReported) {
  up(text_of({.name = "left", .y = 0.2, .friction = "<kp>1e6</kp><minDepth>0.001</minDepth>"}) +
     text_of({"right", 0, -0.2}));
  EXPECT_THAT(said_, HasSubstr("up.contact_values: <kp>, <minDepth> in <gazebo> have no effect"));
}

TEST_F(BaseWheelsTest, SideWithReversedAxesDrivesAheadByNegativeMultiplier) {
  const auto wheels = [](const char* name, double y, const char* axis) {
    return text_of({.name = std::string(name) + "_front", .x = 0.15, .y = y, .axis = axis}) +
           text_of({.name = std::string(name) + "_rear", .x = -0.15, .y = y, .axis = axis});
  };
  up(wheels("left", 0.2, "0 -1 0") + wheels("right", -0.2, "0 1 0"));
  EXPECT_EQ(base_type(), "diff_drive_controller/DiffDriveController") << said_;
  EXPECT_THAT(said_, HasSubstr("the axes of the left wheels point to the right"));
  const auto v = driven(0.3, 0, 0);
  EXPECT_NEAR(v.linear.x, 0.3, 0.003);
  EXPECT_NEAR(v.angular.z, 0, 0.003);
}

TEST_F(BaseWheelsTest, AxesAgainstDeclaredControllerAreReported) {
  const std::string base =
      "controller_manager: {ros__parameters: {base: {type: diff_drive_controller/DiffDriveController}}}\n"
      "base: {ros__parameters: {left_wheel_names: [a], right_wheel_names: [b], wheel_separation: 0.4, "
      "wheel_radius: "
      "0.1";
  const auto wheels = [](double side, const char* axis) {
    return text_of({.name = "a", .y = side * 0.2, .axis = axis}) + text_of({.name = "b", .y = side * -0.2});
  };
  up(wheels(1, "0 1 0"), base + "}}\n");
  EXPECT_THAT(said_, Not(HasSubstr("up.base_axis")));
  up(wheels(1, "0 -1 0"), base + "}}\n");
  EXPECT_THAT(said_, HasSubstr("up.base_axis: a positive velocity of 'a' drives backwards"));
  up(wheels(1, "0 -1 0"), base + ", left_wheel_radius_multiplier: -1.0}}\n");
  EXPECT_THAT(said_, Not(HasSubstr("up.base_axis")));
  up(wheels(-1, "0 1 0"), base + "}}\n");
  EXPECT_THAT(said_,
              HasSubstr("up.base_axis: controller 'base' lists 'a' as a left wheel, but it is on the right"));
}

TEST_F(BaseWheelsTest, SteeringAxisAgainstDeclaredControllerIsReported) {
  const auto fork = [](const char* name, double y) {
    return body_text(std::string(name) + "_link", "<geometry><box size='0.01 0.01 0.01'/></geometry>", 0.5) +
           joint_text(name, "revolute", "base_footprint", std::string(name) + "_link", 0.3, y, "0 0 -1");
  };
  up(fork("steer", 0) + text_of({.name = "front", .parent = "steer_link"}) + text_of({"left", 0, 0.2}) +
         text_of({"right", 0, -0.2}),
     "controller_manager: {ros__parameters: {base: {type: "
     "tricycle_steering_controller/TricycleSteeringController}}}\n"
     "base: {ros__parameters: {traction_joints_names: [right, left], steering_joints_names: [steer], "
     "wheelbase: 0.3, "
     "traction_track_width: 0.4, traction_wheels_radius: 0.1}}\n");
  EXPECT_THAT(said_, HasSubstr("up.base_axis: a positive angle of 'steer' steers to the right"));
}

TEST_F(BaseWheelsTest, MecanumControllerOfWheelsWithoutRollersIsReported) {
  std::string wheels, joints;
  for (const auto& [name, x, y] :
       {std::tuple{"front_left", 0.2, 0.2}, std::tuple{"front_right", 0.2, -0.2},
        std::tuple{"rear_right", -0.2, -0.2}, std::tuple{"rear_left", -0.2, 0.2}}) {
    wheels += text_of({.name = name, .x = x, .y = y});
    joints += std::string(name) + "_wheel_command_joint_name: " + name + ", ";
  }
  up(wheels,
     "controller_manager: {ros__parameters: {base: {type: "
     "mecanum_drive_controller/MecanumDriveController}}}\n"
     "base: {ros__parameters: {" +
         joints + "kinematics: {wheels_radius: 0.1, sum_of_robot_center_projection_on_X_Y_axis: 0.4}}}\n");
  EXPECT_THAT(said_, HasSubstr("up.base_rollers: the wheels of the mecanum controller 'base'"));
}

TEST_F(BaseWheelsTest, WheelAgainstOthersOfItsSideIsReported) {
  up(text_of({.name = "left_front", .x = 0.15, .y = 0.2}) +
     text_of({.name = "right_front", .x = 0.15, .y = -0.2}) +
     text_of({.name = "left_rear", .x = -0.15, .y = 0.2}) +
     text_of({.name = "right_rear", .x = -0.15, .y = -0.2, .axis = "0 -1 0"}));
  EXPECT_EQ(base_type(), "");
  EXPECT_THAT(said_, HasSubstr("up.base_not_generated: the robot has wheels"));
  EXPECT_THAT(
      said_,
      HasSubstr("positive velocities of the wheels right_front, right_rear drive in opposite directions"));
}

}  // namespace
}  // namespace doppel
