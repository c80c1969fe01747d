// A twin as ROS 2's tools see it: in a namespace, with other names and parameters, with stamps in wall-clock
// time.
#include <gmock/gmock.h>

#include <chrono>
#include <set>

#include "doppel/ros/messages/rosgraph_msgs.h"
#include "doppel/ros/messages/sensor_msgs.h"
#include "doppel/ros/messages/tf2_msgs.h"
#include "twin_fixture.h"

namespace doppel::test {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

class Ros2TwinTest : public TwinFixture {
 protected:
  static Scenario scenario_with(std::vector<std::string> words) {
    Scenario scenario;
    scenario.robots = {{.target = "omarm_zero"}};
    words.insert(words.begin(), "--ros-args");
    scenario.ros = take_ros_arguments(words);
    return scenario;
  }
  std::set<std::string> topics() {
    std::set<std::string> names;
    for (const TopicInfo& topic : twin_->bus().topics()) names.insert(topic.name);
    return names;
  }
  // The last message of a topic after a run of the given seconds.
  template <class M>
  M last(const std::string& name, double seconds) {
    TopicId id = 0;
    for (const TopicInfo& topic : twin_->bus().topics()) {
      if (topic.name == name) id = topic.id;
    }
    EXPECT_NE(id, 0U) << name;
    edge_->subscribe(id);
    run(seconds);
    M message;
    for (Edge::Incoming incoming; edge_->next(incoming);) {
      if (incoming.topic == id) static_cast<void>(from_cdr(incoming.cdr, message));
    }
    edge_->unsubscribe(id);
    return message;
  }
};

TEST_F(Ros2TwinTest, NamespaceAndRemappingAreApplied) {
  bring_up(scenario_with({"-r", "__ns:=/left", "-r", "joint_states:=js"}));
  EXPECT_THAT(topics(), AllOf(Contains("/left/js"), Contains("/tf"), Contains("/clock"),
                              Contains("/left/robot_description"),
                              Contains("/left/controller_manager/activity"), Not(Contains("/joint_states"))));
  for (const std::string& node : twin_->bus().nodes()) EXPECT_THAT(node, StartsWith("/left/"));
  for (const ControllerView& controller : twin_->robot().controller_manager().controllers())
    EXPECT_EQ(controller.state, ControllerState::active)
        << "expected the controller of the robot's own YAML: " << controller.name;
  EXPECT_FALSE(last<sensor_msgs::msg::JointState>("/left/js", 0.2).name.empty());
}

TEST_F(Ros2TwinTest, CommandLineSetsParameters) {
  bring_up(scenario_with(
      {"-p", "robot_state_publisher:frame_prefix:=left/", "-p", "controller_manager:update_rate:=50"}));
  const auto tf = last<tf2_msgs::msg::TFMessage>("/tf", 0.2);
  ASSERT_FALSE(tf.transforms.empty());
  EXPECT_THAT(tf.transforms.front().child_frame_id, StartsWith("left/"));
  EXPECT_EQ(twin_->robot().controller_manager().period(), from_seconds(0.02));
  EXPECT_THAT(call("/robot_state_publisher/set_parameters", "rcl_interfaces/srv/SetParameters",
                   "{parameters: [{name: robot_description, value: {type: 4, string_value: x}}]}"),
              HasSubstr("edit them"));
  EXPECT_THAT(call("/robot_state_publisher/set_parameters", "rcl_interfaces/srv/SetParameters",
                   "{parameters: [{name: frame_prefix, value: {type: 4, string_value: right_}}]}"),
              HasSubstr("successful: true"));
  EXPECT_THAT(last<tf2_msgs::msg::TFMessage>("/tf", 0.2).transforms.front().child_frame_id,
              StartsWith("right_"));
}

TEST_F(Ros2TwinTest, TransformRateChangeIsImmediate) {
  bring_up(scenario_with({"-p", "robot_state_publisher:publish_frequency:=1e-300"}));
  run(0.1);
  EXPECT_TRUE(last<tf2_msgs::msg::TFMessage>("/tf", 0.2).transforms.empty());
  EXPECT_THAT(call("/robot_state_publisher/set_parameters", "rcl_interfaces/srv/SetParameters",
                   "{parameters: [{name: publish_frequency, value: {type: 3, double_value: 50}}]}"),
              HasSubstr("successful: true"));
  EXPECT_FALSE(last<tf2_msgs::msg::TFMessage>("/tf", 0.2).transforms.empty());
}

TEST_F(Ros2TwinTest, WallClockStampsKeepMotion) {
  Scenario scenario = scenario_with({});
  bring_up(scenario);
  run(0.5);
  const std::uint64_t hash = twin_->state_hash();
  scenario.wall_stamps = true;
  bring_up(scenario);
  run(0.5);
  EXPECT_EQ(twin_->state_hash(), hash);
  EXPECT_THAT(topics(), Not(Contains("/clock")));
  const auto before = system_time();
  const auto states = last<sensor_msgs::msg::JointState>("/joint_states", 0.1);
  EXPECT_GE(from_msg(states.header.stamp), before);
  EXPECT_LE(from_msg(states.header.stamp), system_time());
}

TEST_F(Ros2TwinTest, WallClockStampsAreRead) {
  for (const bool wall : {false, true}) {
    Scenario scenario = scenario_with({});
    scenario.robots = {{.target = "omarm_one"}};
    scenario.wall_stamps = wall;
    bring_up(scenario);
    run(0.2);
    const double start = joint("Revolute 1").q;
    publish(
        "/omarm_arm_controller/joint_trajectory", "trajectory_msgs/msg/JointTrajectory",
        R"({header: {stamp: {nanosec: 200000000}}, joint_names: ["Revolute 1","Revolute 2","Revolute 3","Revolute 4",)"
        R"("Revolute 5","Revolute 6"], points: [{positions: [0.3, 1.2, 1.57, 1.57, 1.57, 1.57], time_from_start: {sec: 2}}]})");
    run(1.0);
    if (wall) {
      EXPECT_NEAR(joint("Revolute 1").q, start, 1e-3)
          << "expected no motion: in wall-clock time the trajectory would be long past";
    } else {
      EXPECT_GT(std::abs(joint("Revolute 1").q - start), 0.01);
    }
  }
}

}  // namespace
}  // namespace doppel::test
