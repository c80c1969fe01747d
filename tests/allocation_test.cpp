// The loop neither allocates nor frees, at rest or on a trajectory, with or without subscribers: every
// operator new and delete of this program is counted.
#include <chrono>
#include <thread>

#include "doppel/base/core/test/heap_touches.h"
#include "twin_fixture.h"

namespace doppel::test {
namespace {

class Allocation : public TwinFixture {
 protected:
  std::size_t count(double seconds) {
    return heap_touches_of([&] { run(seconds); });
  }
};

TEST_F(Allocation, CounterCountsAllocations) {
  EXPECT_EQ(heap_touches_of([] {
              int* volatile escaped = new int(1);  // otherwise the compiler removes both
              delete escaped;
            }),
            2u);
}

TEST_F(Allocation, LoopDoesNotAllocate) {
  for (const char* robot : {"omarm_one", "lab_arm"}) {
    SCOPED_TRACE(robot);
    bring_up(robot);
    run(0.3);
    EXPECT_EQ(count(2.0), 0u) << "expected no heap operation at rest, without subscribers";
  }
}

TEST_F(Allocation, TrajectoryWithListenerDoesNotAllocate) {
  bring_up("omarm_one");
  for (const TopicInfo& topic : twin_->bus().topics()) edge_->subscribe(topic.id);
  publish("/omarm_arm_controller/joint_trajectory", "trajectory_msgs/msg/JointTrajectory",
          R"({joint_names: ["Revolute 1","Revolute 2","Revolute 3","Revolute 4","Revolute 5","Revolute 6"],
points: [{positions: [1.0, 1.2, 1.57, 1.57, 1.57, 1.57], time_from_start: {sec: 2}}]})");
  run(0.3);
  EXPECT_EQ(count(1.0), 0u);
  EXPECT_EQ(edge_->dropped(), 0u);
}

TEST_F(Allocation, FourArmsAndTwoBasesWithListenerDoNotAllocate) {
  Scenario scenario;
  for (int i = 0; i < 6; ++i) {
    WorldRobot& robot = scenario.robots.emplace_back();
    robot.target = i < 4 ? "omarm_one" : "kate";
    robot.name_space = (i < 4 ? "arm_" : "base_") + std::to_string(i);
    robot.X_WR = make_pose({2.0 * i, 0, 0}, {0, 0, 0});
  }
  bring_up(scenario);
  for (const TopicInfo& topic : twin_->bus().topics()) edge_->subscribe(topic.id);
  const auto drive = [&](const WorldRobot& robot) {
    publish("/" + robot.name_space + "/base_controller/cmd_vel", "geometry_msgs/msg/TwistStamped",
            "{twist: {linear: {x: 0.3}, angular: {z: 0.2}}}");
  };
  for (const WorldRobot& robot : scenario.robots) {
    if (robot.target == "kate") {
      drive(robot);
    } else {
      publish(
          "/" + robot.name_space + "/omarm_arm_controller/joint_trajectory",
          "trajectory_msgs/msg/JointTrajectory",
          R"({joint_names: ["Revolute 1","Revolute 2","Revolute 3","Revolute 4","Revolute 5","Revolute 6"],
points: [{positions: [1.0, 1.2, 1.57, 1.57, 1.57, 1.57], time_from_start: {sec: 2}}]})");
    }
  }
  run(0.4);  // the check of rest is over
  for (const WorldRobot& robot : scenario.robots) {
    if (robot.target == "kate") drive(robot);
  }
  EXPECT_EQ(count(0.4), 0u) << "within the time-out of the command, whose end is reported";
}

TEST_F(Allocation, AutomaticStatesReuseTheirMemory) {
  bring_up("omarm_one");
  twin_->keep_states(true);
  run(31.1);
  EXPECT_EQ(count(2.0), 0u) << "four states were written into the memory of those that were forgotten";
}

TEST_F(Allocation, PushOnObjectDoesNotAllocate) {
  bring_up("omarm_one");  // steps of 1 ms
  const std::string name = "a ball whose name is too long to be kept without memory of its own";
  spawn_ball(name, {1, 0, 10});
  twin_->between_steps();
  const std::string said =
      call("/gazebo/apply_link_wrench", "gazebo_msgs/srv/ApplyLinkWrench",
           "{link_name: '" + name + "', wrench: {force: {x: 1}}, duration: {nanosec: 50000000}}");
  EXPECT_NE(said.find("success: true"), std::string::npos) << said;
  EXPECT_EQ(heap_touches_of([&] {
              for (int i = 0; i < 100; ++i) twin_->step();
            }),
            0u);
  const FrameVelocity velocity = twin_->engine().find(name).value().base_velocity();
  EXPECT_NEAR(velocity.linear_W.x(), 0.05, 1e-6) << "expected the push to act for its duration only";
}

// Kate's sensors of light take the poses of all bodies, also of those that are spawned while she runs.
TEST_F(Allocation, SensorsDoNotAllocateAfterSpawn) {
  bring_up("kate");
  for (const TopicInfo& topic : twin_->bus().topics()) edge_->subscribe(topic.id);
  run(0.5);
  for (int i = 0; i < 30; ++i) spawn_ball("ball_" + std::to_string(i), {3 + 0.2 * i, 3, 0.05});
  std::size_t touched = 0;
  for (int i = 0; i < 10; ++i) {
    twin_->between_steps();
    touched += heap_touches_of([&] {
      for (int k = 0; k < 40; ++k) twin_->step();
    });
  }
  EXPECT_EQ(touched, 0u);
}

}  // namespace
}  // namespace doppel::test
