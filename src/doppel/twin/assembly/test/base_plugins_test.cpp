// Plugins of Gazebo that drive a base, in a description without controllers.
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
using ::testing::Contains;
using ::testing::HasSubstr;

std::string plugin_link(const std::string& name) {
  return "<link name=\"" + name +
         "\"><inertial><mass value=\"1\"/><inertia ixx=\"0.02\" iyy=\"0.02\" izz=\"0.02\" ixy=\"0\" "
         "ixz=\"0\" "
         "iyz=\"0\"/></inertial><collision><geometry><sphere radius=\"0.1\"/></geometry></collision></link>";
}
std::string plugin_wheel(const std::string& name, double x, double y, const char* axis = "0 1 0") {
  return plugin_link(name + "_link") + "<joint name=\"" + name +
         "\" type=\"continuous\"><parent link=\"base_footprint\"/><child link=\"" + name +
         "_link\"/><origin xyz=\"" + std::to_string(x) + " " + std::to_string(y) + " 0\"/><axis xyz=\"" +
         axis + "\"/><limit effort=\"20\" velocity=\"30\"/></joint>";
}

class BasePluginsTest : public ::testing::Test {
 protected:
  BasePluginsTest() : folder_(fs::temp_directory_path() / ("doppel_plugins_" + std::to_string(::getpid()))) {
    fs::create_directories(folder_);
  }
  ~BasePluginsTest() override {
    listener_.reset();
    fs::remove_all(folder_);
  }

  void up(const std::string& wheels, const std::string& plugin) {
    std::ofstream(folder_ / "rover.urdf") << "<robot name=\"rover\">" + plugin_link("base_footprint") +
                                                 wheels + "<gazebo>" + plugin + "</gazebo></robot>";
    Scenario scenario;
    scenario.robots = {{.target = (folder_ / "rover.urdf").string()}};
    Diagnostics diagnostics;
    twin_ = std::make_unique<Twin>(scenario, log_, diagnostics);
    for (const Diagnostic& d : diagnostics.all()) said_ += d.rule + ": " + d.message + "\n";
    listener_ = std::make_unique<Node>(twin_->bus(), "/listener");
    listener_->subscribe<nav_msgs::msg::Odometry>("/odom", [this](const auto& m) { odometry_ = m; });
  }
  [[nodiscard]] std::string type_of(const std::string& name) {
    for (const ControllerView& c : twin_->robot().controller_manager().controllers()) {
      if (c.name == name && c.state == ControllerState::active) return c.type;
    }
    return "";
  }
  // Publishes on a topic of a type as another program does, for a second.
  template <class M>
  void drive(const std::string& topic, const M& message) {
    const auto edge = twin_->bus().attach("program");
    for (int i = 0; i < 1000; ++i) {
      if (i % 50 == 0) {
        const Status status = edge->publish("/teleop", topic, M::kType, to_cdr(message));
        ASSERT_TRUE(status.ok()) << status.why();
      }
      twin_->between_steps();
      twin_->step();
    }
  }
  [[nodiscard]] double command(const std::string& interface) {
    return twin_->robot().controller_manager().command(interface);
  }

  fs::path folder_;
  Log log_;
  std::unique_ptr<Twin> twin_;
  std::unique_ptr<Node> listener_;
  nav_msgs::msg::Odometry odometry_;
  std::string said_;
};

const geometry_msgs::msg::Twist kAhead{{0.5, 0, 0}, {}};

TEST_F(BasePluginsTest, ClassicDiffDriveIsMapped) {
  up(plugin_wheel("left", 0, 0.2) + plugin_wheel("right", 0, -0.2) + plugin_wheel("caster", -0.2, 0, "0 0 1"),
     "<plugin name='drive' filename='libgazebo_ros_diff_drive.so'><left_joint>left</left_joint>"
     "<right_joint>right</right_joint><wheel_separation>0.4</wheel_separation><wheel_diameter>0.2</"
     "wheel_diameter>"
     "<odometry_frame>odom</odometry_frame><robot_base_frame>base_footprint</robot_base_frame>"
     "<max_wheel_torque>20</max_wheel_torque></plugin>");
  EXPECT_EQ(type_of("diff_drive"), "diff_drive_controller/DiffDriveController") << said_;
  EXPECT_THAT(said_, HasSubstr("mapped to the controller 'diff_drive'"));
  EXPECT_THAT(said_, HasSubstr("it reads cmd_vel and publishes odom"));
  EXPECT_THAT(said_, HasSubstr("without effect: max_wheel_torque"));
  drive("/cmd_vel", kAhead);
  EXPECT_DOUBLE_EQ(command("left/velocity"), 5.0);
  EXPECT_DOUBLE_EQ(command("right/velocity"), 5.0);
  EXPECT_EQ(odometry_.child_frame_id, "base_footprint");
  EXPECT_EQ(odometry_.header.frame_id, "odom");
  EXPECT_TRUE(type_of("joint_trajectory_controller").empty());  // the caster is free
}

TEST_F(BasePluginsTest, GzDiffDriveHasItsTopicsAndLimits) {
  up(plugin_wheel("l1", 0.2, 0.2) + plugin_wheel("l2", -0.2, 0.2) + plugin_wheel("r1", 0.2, -0.2) +
         plugin_wheel("r2", -0.2, -0.2),
     "<plugin filename='gz-sim-diff-drive-system' "
     "name='gz::sim::systems::DiffDrive'><left_joint>l1</left_joint>"
     "<left_joint>l2</left_joint><right_joint>r1</right_joint><right_joint>r2</right_joint>"
     "<wheel_separation>0.4</wheel_separation><wheel_radius>0.1</wheel_radius><topic>/rover/drive</topic>"
     "<max_linear_velocity>0.25</max_linear_velocity></plugin>");
  drive("/rover/drive", kAhead);
  for (const char* wheel : {"l1", "l2", "r1", "r2"})
    EXPECT_DOUBLE_EQ(command(std::string(wheel) + "/velocity"), 2.5) << said_;
}

TEST_F(BasePluginsTest, SkidSteerOfClassicIsMapped) {
  up(plugin_wheel("l1", 0.2, 0.2) + plugin_wheel("l2", -0.2, 0.2) + plugin_wheel("r1", 0.2, -0.2) +
         plugin_wheel("r2", -0.2, -0.2),
     "<plugin name='skid' filename='libgazebo_ros_skid_steer_drive.so'><leftFrontJoint>l1</leftFrontJoint>"
     "<rightFrontJoint>r1</rightFrontJoint><leftRearJoint>l2</leftRearJoint><rightRearJoint>r2</"
     "rightRearJoint>"
     "<wheelSeparation>0.4</wheelSeparation><wheelDiameter>0.2</wheelDiameter></plugin>");
  drive("/cmd_vel", kAhead);
  EXPECT_DOUBLE_EQ(command("r2/velocity"), 5.0) << said_;
}

TEST_F(BasePluginsTest, IgnitionMecanumIsMapped) {
  up(plugin_wheel("fl", 0.2, 0.2) + plugin_wheel("bl", -0.2, 0.2) + plugin_wheel("fr", 0.2, -0.2) +
         plugin_wheel("br", -0.2, -0.2),
     "<plugin filename='ignition-gazebo-mecanum-drive-system' name='ignition::gazebo::systems::MecanumDrive'>"
     "<front_left_joint>fl</front_left_joint><front_right_joint>fr</front_right_joint>"
     "<back_left_joint>bl</back_left_joint><back_right_joint>br</back_right_joint>"
     "<wheel_separation>0.4</wheel_separation><wheelbase>0.4</wheelbase><wheel_radius>0.1</wheel_radius></"
     "plugin>");
  EXPECT_EQ(type_of("mecanum_drive"), "mecanum_drive_controller/MecanumDriveController") << said_;
  drive("/cmd_vel", geometry_msgs::msg::Twist{{0, 0.5, 0}, {}});
  EXPECT_DOUBLE_EQ(command("fl/velocity"), -5.0);
  EXPECT_DOUBLE_EQ(command("fr/velocity"), 5.0);
}

TEST_F(BasePluginsTest, NumberThatCannotBeUsedIsReportedAndNotRead) {
  up(plugin_wheel("left", 0, 0.2) + plugin_wheel("right", 0, -0.2),
     "<plugin name='drive' filename='libgazebo_ros_diff_drive.so'><left_joint>left</left_joint>"
     "<right_joint>right</right_joint><wheel_separation>-0.4</wheel_separation>"
     "<wheel_diameter>1.0 m</wheel_diameter></plugin>");
  EXPECT_THAT(said_, HasSubstr("its default is used instead: <wheel_separation>-0.4 (not above 0), "
                               "<wheel_diameter>1.0 m (not a number)"));
  EXPECT_THAT(said_, HasSubstr("radius 0.2 m"));
}

TEST_F(BasePluginsTest, PluginThatCannotBeMappedIsReported) {
  up(plugin_wheel("left", 0, 0.2) + plugin_wheel("right", 0, -0.2),
     "<plugin name='move' filename='libgazebo_ros_planar_move.so'/>"
     "<plugin name='gz::sim::systems::VelocityControl' filename='gz-sim-velocity-control-system'/>"
     "<plugin name='drive' filename='libgazebo_ros_diff_drive.so'><left_joint>lefd</left_joint>"
     "<right_joint>right</right_joint></plugin>");
  EXPECT_THAT(said_, HasSubstr("'libgazebo_ros_planar_move.so' drives the base in Gazebo and is not mapped"));
  EXPECT_THAT(said_,
              HasSubstr("'gz-sim-velocity-control-system' drives the base in Gazebo and is not mapped to a "
                        "controller: it moves the body and not its wheels"));
  EXPECT_THAT(said_, HasSubstr("it needs 'lefd', which the robot does not have"));
}

}  // namespace
}  // namespace doppel
