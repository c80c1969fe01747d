// The twin as a whole: what a new user sees.
#include <map>

#include "doppel/ros/messages/sensor_msgs.h"
#include "doppel/ros/messages/tf2_msgs.h"
#include "twin_fixture.h"

namespace doppel::test {
namespace {

using Goals = std::map<std::string, double>;

class TwinTest : public TwinFixture {
 protected:
  void expect_at(const Goals& goals, double tolerance) {
    for (const auto& [name, goal] : goals) EXPECT_NEAR(joint(name).q, goal, tolerance) << name;
  }
};

TEST_F(TwinTest, RobotHoldsAgainstGravity) {
  for (const char* robot : {"omarm_one", "omarm_zero", "lab_arm"}) {
    SCOPED_TRACE(robot);
    bring_up(robot);
    Goals start;
    for (const JointSnapshot& j : twin_->robot().joints()) start[j.name] = j.q;
    run(3.0);
    expect_at(start, 0.01);
    EXPECT_FALSE(twin_->diverged());
  }
}

TEST_F(TwinTest, RobotCollapsesWithoutActiveController) {
  Scenario scenario;
  scenario.robots = {{.target = "omarm_one"}};
  scenario.start_controllers = false;
  bring_up(scenario);
  const double before = twin_->robot()
                            .instance()
                            .link_pose(twin_->robot().model().find_link("gripper_base_1"))
                            .translation()
                            .z();
  run(3.0);
  const double after = twin_->robot()
                           .instance()
                           .link_pose(twin_->robot().model().find_link("gripper_base_1"))
                           .translation()
                           .z();
  EXPECT_LT(after, before - 0.05);
}

// The sample of the OmArm One walkthrough, verbatim.
TEST_F(TwinTest, OmArmOneFollowsSample) {
  bring_up("omarm_one");
  publish("/omarm_arm_controller/joint_trajectory", "trajectory_msgs/msg/JointTrajectory",
          R"({joint_names: ["Revolute 1","Revolute 2","Revolute 3","Revolute 4","Revolute 5","Revolute 6"],
points: [{positions: [1.57, 1.2, 1.57, 1.57, 1.57, 1.57], time_from_start: {sec: 3}}]})");
  run(4.0);
  expect_at({{"Revolute 1", 1.57},
             {"Revolute 2", 1.2},
             {"Revolute 3", 1.57},
             {"Revolute 4", 1.57},
             {"Revolute 5", 1.57},
             {"Revolute 6", 1.57}},
            0.01);
}

// The two samples of the OmArm Zero walkthrough; Revolute 1 is limited to 0.2 rad/s, so it arrives late.
TEST_F(TwinTest, OmArmZeroFollowsSamples) {
  bring_up("omarm_zero");
  publish(
      "/joint_trajectory_controller/joint_trajectory", "trajectory_msgs/msg/JointTrajectory",
      R"({joint_names: ['Revolute 1', 'Revolute 2', 'Revolute 3', 'Revolute 4', 'Revolute 5', 'Revolute 6'],
points: [{positions: [1.57, -1.57, -1.57, -1.57, -1.57, 0.0],
time_from_start: {sec: 3, nanosec: 0}}]})");
  run(10.0);
  expect_at({{"Revolute 1", 1.57},
             {"Revolute 2", -1.57},
             {"Revolute 3", -1.57},
             {"Revolute 4", -1.57},
             {"Revolute 5", -1.57},
             {"Revolute 6", 0.0},
             {"Revolute 7", 0.0}},
            0.01);
  publish(
      "/joint_trajectory_controller/joint_trajectory", "trajectory_msgs/msg/JointTrajectory",
      R"({joint_names: ['Revolute 1', 'Revolute 2', 'Revolute 3', 'Revolute 4', 'Revolute 5', 'Revolute 6'],
points: [{positions: [1.57, -1.0, -2.0, -1.57, -1.57, -0.3],
time_from_start: {sec: 4, nanosec: 0}}]})");
  run(8.0);
  expect_at({{"Revolute 1", 1.57},
             {"Revolute 2", -1.0},
             {"Revolute 3", -2.0},
             {"Revolute 4", -1.57},
             {"Revolute 5", -1.57},
             {"Revolute 6", -0.3},
             {"Revolute 7", 0.3}},
            0.01);
}

TEST_F(TwinTest, LabArmFollowsSample) {
  bring_up("lab_arm");
  publish("/position_controller/commands", "std_msgs/msg/Float64MultiArray", "{data: [1, 1, 1, 1]}");
  run(4.0);
  expect_at({{"j0", 1.0}, {"j1", 1.0}, {"j2", 1.0}, {"j3", 1.0}}, 0.01);
}

TEST_F(TwinTest, SameInputsAreBitIdenticalWithListener) {
  const auto hash_of_run = [this](bool listen) {
    bring_up("omarm_one");
    if (listen) {
      for (const TopicInfo& topic : twin_->bus().topics()) edge_->subscribe(topic.id);
    }
    run(0.5);
    publish("/omarm_arm_controller/joint_trajectory", "trajectory_msgs/msg/JointTrajectory",
            R"({joint_names: ["Revolute 1","Revolute 2","Revolute 3","Revolute 4","Revolute 5","Revolute 6"],
points: [{positions: [1.0, 1.2, 1.57, 1.57, 1.57, 1.57], time_from_start: {sec: 1}}]})");
    run(1.5);
    std::size_t received = 0;
    for (Edge::Incoming message; edge_->next(message);) ++received;
    EXPECT_EQ(received > 100, listen);
    return twin_->state_hash();
  };
  const std::uint64_t alone = hash_of_run(false);
  EXPECT_EQ(hash_of_run(false), alone);
  EXPECT_EQ(hash_of_run(true), alone);
}

TEST_F(TwinTest, TransformsMatchPhysics) {
  bring_up("omarm_one");
  for (const TopicInfo& topic : twin_->bus().topics()) {
    if (topic.name == "/tf" || topic.name == "/tf_static") edge_->subscribe(topic.id);
  }
  run(0.5);
  std::map<std::string, geometry_msgs::msg::TransformStamped> latest;
  for (Edge::Incoming message; edge_->next(message);) {
    tf2_msgs::msg::TFMessage tf;
    ASSERT_TRUE(from_cdr(message.cdr, tf).ok());
    for (const auto& transform : tf.transforms) latest[transform.child_frame_id] = transform;
  }
  const Model& model = twin_->robot().model();
  EXPECT_EQ(latest.size(), model.joints.size());
  Pose X = Pose::Identity();
  for (std::string frame = "gripper_finger_left_1"; frame != "world";) {
    ASSERT_TRUE(latest.contains(frame)) << frame;
    const auto& t = latest[frame];
    Pose X_PC = Pose::Identity();
    X_PC.translation() << t.transform.translation.x, t.transform.translation.y, t.transform.translation.z;
    X_PC.linear() = Eigen::Quaterniond(t.transform.rotation.w, t.transform.rotation.x, t.transform.rotation.y,
                                       t.transform.rotation.z)
                        .toRotationMatrix();
    X = X_PC * X;
    frame = t.header.frame_id;
  }
  const Pose truth = twin_->robot().instance().link_pose(model.find_link("gripper_finger_left_1"));
  EXPECT_LT((X.matrix() - truth.matrix()).norm(),
            1e-3);  // the arm does not move, so the age of the stamp does not matter
}

TEST_F(TwinTest, MimicFollowsLeader) {
  bring_up("omarm_one");
  publish("/omarm_gripper_controller/joint_trajectory", "trajectory_msgs/msg/JointTrajectory",
          R"({joint_names: ["Revolute 8"], points: [{positions: [0.6], time_from_start: {sec: 1}}]})");
  run(2.0);
  EXPECT_NEAR(joint("Revolute 8").q, 0.6, 0.01);
  EXPECT_NEAR(joint("Revolute 9").q, joint("Revolute 8").q, 0.005);
  for (const InterfaceView& interface : twin_->robot().controller_manager().command_interfaces()) {
    EXPECT_EQ(interface.full_name.find("Revolute 9"), std::string::npos);
  }
}

TEST_F(TwinTest, NanKeepsLastGoodCommand) {
  bring_up("lab_arm");
  publish("/position_controller/commands", "std_msgs/msg/Float64MultiArray", "{data: [0.5, 0.5, 0.5, 0.5]}");
  run(3.0);
  publish("/position_controller/commands", "std_msgs/msg/Float64MultiArray", "{data: [.nan, 1, 1, 1]}");
  run(1.0);
  expect_at({{"j0", 0.5}, {"j1", 0.5}, {"j2", 0.5}, {"j3", 0.5}}, 0.01);
  EXPECT_FALSE(twin_->diverged());
}

}  // namespace
}  // namespace doppel::test
