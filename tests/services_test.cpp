// The simulator's services by the names of gazebo_ros, as another shell would call them.
#include "twin_fixture.h"

namespace doppel::test {
namespace {

class Services : public TwinFixture {};

TEST_F(Services, PauseStepAndUnpause) {
  bring_up("omarm_one");
  run(0.1);
  call("/gazebo/pause_physics", "std_srvs/srv/Empty", "{}");
  EXPECT_TRUE(twin_->time_control().paused);
  EXPECT_NE(call("/gazebo/step", "doppel_msgs/srv/Step", "{steps: 5}").find("success: true"),
            std::string::npos);
  EXPECT_EQ(twin_->time_control().steps_owed, 5u);
  call("/gazebo/unpause_physics", "std_srvs/srv/Empty", "{}");
  EXPECT_FALSE(twin_->time_control().paused);
}

TEST_F(Services, StepWithoutPauseIsRefused) {
  bring_up("omarm_one");
  EXPECT_NE(call("/gazebo/step", "doppel_msgs/srv/Step", "{steps: 5}").find("success: false"),
            std::string::npos);
}

TEST_F(Services, SpeedIsCheckedAndTaken) {
  bring_up("omarm_one");
  call("/gazebo/set_speed", "doppel_msgs/srv/SetSpeed", "{factor: 2.5}");
  EXPECT_EQ(twin_->time_control().speed, 2.5);
  EXPECT_NE(call("/gazebo/set_speed", "doppel_msgs/srv/SetSpeed", "{factor: -1}").find("success: false"),
            std::string::npos);
  EXPECT_EQ(twin_->time_control().speed, 2.5);
}

TEST_F(Services, ResetGoesBackToTheStartAndHolds) {
  bring_up("omarm_one");
  const double start = joint("Revolute 2").q;
  publish("/omarm_arm_controller/joint_trajectory", "trajectory_msgs/msg/JointTrajectory",
          R"({joint_names: ["Revolute 1","Revolute 2","Revolute 3","Revolute 4","Revolute 5","Revolute 6"],
points: [{positions: [1.0, 1.2, 1.2, 1.2, 1.2, 1.2], time_from_start: {sec: 1}}]})");
  run(1.5);
  EXPECT_GT(std::abs(joint("Revolute 2").q - start) + std::abs(joint("Revolute 1").q - 1.5708), 0.1);
  call("/gazebo/reset_simulation", "std_srvs/srv/Empty", "{}");
  EXPECT_EQ(twin_->now(), Time{});
  EXPECT_EQ(joint("Revolute 2").q, start);
  run(1.0);
  EXPECT_NEAR(joint("Revolute 2").q, start, 0.01);
}

TEST_F(Services, JointEffortActsForItsTimeOnly) {
  Scenario scenario;
  scenario.target = "omarm_one";
  scenario.start_controllers = false;
  bring_up(scenario);
  const double start = joint("Revolute 1").q;  // about the vertical: gravity does not turn it
  EXPECT_NE(call("/gazebo/apply_joint_effort", "gazebo_msgs/srv/ApplyJointEffort",
                 "{joint_name: 'Revolute 1', effort: 0.5, start_time: {sec: 0}, duration: {sec: 0, nanosec: "
                 "200000000}}")
                .find("success: true"),
            std::string::npos);
  run(0.2);
  EXPECT_GT(joint("Revolute 1").v, 0.05);
  EXPECT_GT(joint("Revolute 1").q, start);
  run(2.0);
  EXPECT_LT(std::abs(joint("Revolute 1").v), 0.05);  // friction has stopped it: the effort is gone
}

TEST_F(Services, UnknownNamesAreAnsweredWithTheNearest) {
  bring_up("omarm_one");
  const std::string answer = call("/gazebo/apply_joint_effort", "gazebo_msgs/srv/ApplyJointEffort",
                                  "{joint_name: 'Revolute_1', effort: 0.5}");
  EXPECT_NE(answer.find("success: false"), std::string::npos) << answer;
  EXPECT_NE(answer.find("Revolute 1"), std::string::npos) << answer;
}

TEST_F(Services, StateCanBeReadAndWritten) {
  bring_up("lab_arm");
  run(0.1);
  const std::string answer = call("/gazebo/set_state", "doppel_msgs/srv/SetState",
                                  "{names: [j1], positions: [0.4], velocities: []}");
  EXPECT_NE(answer.find("success: true"), std::string::npos) << answer;
  EXPECT_NEAR(joint("j1").q, 0.4, 1e-9);
  EXPECT_NE(call("/gazebo/get_state", "doppel_msgs/srv/GetState", "{}").find("j1"), std::string::npos);
  EXPECT_NE(call("/gazebo/set_state", "doppel_msgs/srv/SetState", "{names: [j1], positions: [.nan]}")
                .find("success: false"),
            std::string::npos);
}

}  // namespace
}  // namespace doppel::test
