// The transform of a mobile base: one parent of the root in TF, by the odometry of an active controller or by the
// simulation; the truth beside it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include "doppel/ros/messages/geometry_msgs.h"
#include "doppel/ros/messages/nav_msgs.h"
#include "doppel/ros/messages/tf2_msgs.h"
#include "doppel/twin/assembly/twin.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::Not;

std::string rover_link(const std::string& name, double mass, const std::string& shape) {
  return "<link name=\"" + name + "\"><inertial><mass value=\"" + std::to_string(mass) +
         "\"/><inertia ixx=\"0.02\" iyy=\"0.02\" izz=\"0.02\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial>" +
         shape + "</link>";
}

std::string rover_wheel(const std::string& name, double y) {
  return rover_link(name + "_wheel", 1,
                    "<collision><origin rpy=\"1.5707963 0 0\"/><geometry><cylinder radius=\"0.1\" "
                    "length=\"0.04\"/></geometry></collision>") +
         "<joint name=\"" + name + "\" type=\"continuous\"><parent link=\"base_link\"/><child link=\"" +
         name + "_wheel\"/><origin xyz=\"0 " + std::to_string(y) +
         " 0\"/><axis xyz=\"0 1 0\"/><limit effort=\"20\" velocity=\"20\"/></joint>";
}

const std::string kDrivenWheel =
    "<command_interface name=\"velocity\"/><state_interface name=\"position\"/><state_interface "
    "name=\"velocity\"/></joint>";

// Two wheels and a sphere that slides.
const std::string kRover =
    "<robot name=\"rover\">" +
    rover_link(
        "base_link", 5,
        "<collision><origin xyz=\"0.15 0 -0.05\"/><geometry><sphere radius=\"0.05\"/></geometry></collision>"
        "<collision><origin xyz=\"-0.15 0 -0.05\"/><geometry><sphere "
        "radius=\"0.05\"/></geometry></collision>") +
    rover_wheel("left", 0.2) + rover_wheel("right", -0.2) +
    "<gazebo reference=\"base_link\"><mu1>0.01</mu1><mu2>0.01</mu2></gazebo>"
    "<ros2_control name=\"s\" "
    "type=\"system\"><hardware><plugin>gz_ros2_control/GazeboSimSystem</plugin></hardware>"
    "<joint name=\"left\">" +
    kDrivenWheel + "<joint name=\"right\">" + kDrivenWheel + "</ros2_control></robot>";

const std::string kRoverControllers =
    "controller_manager:\n  ros__parameters:\n    update_rate: 100\n"
    "    jsb: {type: joint_state_broadcaster/JointStateBroadcaster}\n"
    "    base: {type: diff_drive_controller/DiffDriveController}\n"
    "base:\n  ros__parameters: {left_wheel_names: [left], right_wheel_names: [right], wheel_separation: 0.4, "
    "wheel_radius: 0.1}\n";

class BaseOdometryTest : public ::testing::Test {
 protected:
  BaseOdometryTest() : folder_(fs::temp_directory_path() / ("doppel_base_" + std::to_string(::getpid()))) {
    fs::create_directories(folder_);
    std::ofstream(folder_ / "rover.urdf") << kRover;
    std::ofstream(folder_ / "controllers.yaml") << kRoverControllers;
  }
  ~BaseOdometryTest() override { fs::remove_all(folder_); }

  void up(const std::string& name_space = "", const std::string& frame = "base_link",
          const std::optional<Pose>& X_WR = std::nullopt) {
    Scenario scenario;
    scenario.robots = {{.target = (folder_ / "rover.urdf").string(), .name_space = name_space}};
    scenario.robots.front().controllers = {folder_ / "controllers.yaml"};
    scenario.robots.front().X_WR = X_WR;
    Diagnostics diagnostics;
    twin_ = std::make_unique<Twin>(scenario, log_, diagnostics);
    node_ = std::make_unique<Node>(twin_->bus(), "/listener");
    const auto listen = [this](const auto& m) {
      for (const auto& t : m.transforms) {
        parents_[t.child_frame_id].insert(t.header.frame_id);
        if (t.header.frame_id == "world") from_world_[t.child_frame_id] = t.transform;
      }
    };
    const std::string prefix = name_space.empty() ? "" : "/" + name_space;
    node_->subscribe<tf2_msgs::msg::TFMessage>("/tf", listen);
    node_->subscribe<nav_msgs::msg::Odometry>(prefix + "/ground_truth/odom",
                                              [this](const auto& m) { truth_ = m; });
    node_->subscribe<nav_msgs::msg::Odometry>(prefix + "/base/odom",
                                              [this](const auto& m) { odometry_ = m; });
    root_ = (name_space.empty() ? "" : name_space + "/") + frame;
    commands_ = node_->advertise<geometry_msgs::msg::TwistStamped>(prefix + "/base/cmd_vel");
  }
  void run(double seconds, double linear = 0, double angular = 0) {
    for (int i = 0; i < static_cast<int>(seconds * 1000); ++i) {
      if (i % 100 == 0) {
        geometry_msgs::msg::TwistStamped message;
        message.twist.linear.x = linear;
        message.twist.angular.z = angular;
        commands_.publish(message, twin_->now());
      }
      twin_->between_steps();
      twin_->step();
    }
  }
  std::set<std::string> parents_while(double seconds) {
    parents_.clear();
    run(seconds);
    return parents_[root_];
  }

  fs::path folder_;
  Log log_;
  std::unique_ptr<Twin> twin_;
  std::unique_ptr<Node> node_;
  Publisher<geometry_msgs::msg::TwistStamped> commands_;
  std::map<std::string, std::set<std::string>> parents_;  // of each frame on /tf
  std::map<std::string, geometry_msgs::msg::Transform> from_world_;
  nav_msgs::msg::Odometry truth_, odometry_;
  std::string root_;
};

TEST_F(BaseOdometryTest, RootHasOneParent) {
  up();
  run(0.1);
  EXPECT_THAT(parents_while(0.5), ElementsAre("odom"));
  EXPECT_THAT(parents_["left_wheel"], ElementsAre("base_link"));
  ASSERT_TRUE(twin_->robot()
                  .controller_manager()
                  .switch_controllers({}, std::vector<std::string>{"base"}, Strictness::strict)
                  .ok());
  run(0.1);
  EXPECT_THAT(parents_while(0.5), ElementsAre("world"));
}

TEST_F(BaseOdometryTest, NamespaceIsPrefixOfBothFrames) {
  up("left");
  run(0.1);
  EXPECT_THAT(parents_while(0.5), ElementsAre("left/odom"));
  EXPECT_EQ(truth_.child_frame_id, "left/base_link");
}

TEST_F(BaseOdometryTest, TransformOffLeavesTruthInTf) {
  std::ofstream(folder_ / "controllers.yaml")
      << kRoverControllers.substr(0, kRoverControllers.rfind('}')) + ", enable_odom_tf: false}\n";
  up();
  run(0.1);
  EXPECT_THAT(parents_while(0.5), ElementsAre("world"));
}

TEST_F(BaseOdometryTest, TruthOfRobotWithPoseIsInFrameWorldOfTf) {
  std::ofstream(folder_ / "controllers.yaml")
      << kRoverControllers.substr(0, kRoverControllers.rfind('}')) + ", enable_odom_tf: false}\n";
  up("", "base_link", make_pose({1, -2, 0}, {0, 0, 1}));
  run(2.001, 0.3);
  const auto& tf = from_world_["base_link"].translation;
  EXPECT_GT(truth_.pose.pose.position.x, 0.1) << "expected the way along the robot's own x axis";
  EXPECT_NEAR(truth_.pose.pose.position.x, tf.x, 0.01);
  EXPECT_NEAR(truth_.pose.pose.position.y, tf.y, 0.01);
}

// No claim about slip: how far the wheels carry the base is tested with their contact.
TEST_F(BaseOdometryTest, GroundTruthIsPublishedBesideOdometry) {
  up();
  run(0.2);
  run(2.0, 0.3);
  EXPECT_EQ(truth_.header.frame_id, "world");
  EXPECT_EQ(truth_.child_frame_id, "base_link");
  EXPECT_NEAR(odometry_.pose.pose.position.x, 0.6, 0.02);
  EXPECT_GT(truth_.pose.pose.position.x, 0.1);
  run(1.0, 0.3, 1.0);
  run(0.001, 0.3, 1.0);  // at a multiple of its period
  const Instance& rover = twin_->robot().instance();
  const Pose X_WB = rover.base_pose();
  const Eigen::Vector3d v_B = X_WB.linear().transpose() * rover.base_velocity().linear_W;
  EXPECT_NEAR(truth_.pose.pose.position.x, X_WB.translation().x(), 0.01);
  EXPECT_NEAR(truth_.pose.pose.position.y, X_WB.translation().y(), 0.01);
  EXPECT_NEAR(truth_.twist.twist.linear.x, v_B.x(), 0.03);
  EXPECT_NEAR(truth_.twist.twist.linear.y, v_B.y(), 0.03);
  EXPECT_GT(truth_.twist.twist.angular.z, 0.1);
}

}  // namespace
}  // namespace doppel
