// The simulator's services with the names of gazebo_ros, as called from another shell.
#include <algorithm>
#include <cmath>
#include <optional>

#include "doppel/ros/messages/doppel_msgs.h"
#include "doppel/ros/messages/rosgraph_msgs.h"
#include "doppel/ros/messages/sensor_msgs.h"
#include "doppel/ros/messages/tf2_msgs.h"
#include "twin_fixture.h"

namespace doppel::test {
namespace {

class TwinServicesTest : public TwinFixture {
 protected:
  static bool has(const std::string& answer, const char* text) {
    return answer.find(text) != std::string::npos;
  }
};

TEST_F(TwinServicesTest, PauseStepsAndUnpauses) {
  bring_up("omarm_one");
  run(0.1);
  call("/gazebo/pause_physics", "std_srvs/srv/Empty", "{}");
  EXPECT_TRUE(twin_->time_control().paused);
  const Time stands = twin_->now();
  const auto ask_for_steps = [&](std::uint32_t steps,
                                 std::optional<doppel_msgs::srv::Step::Response>& answer) {
    const Bytes request = to_cdr(doppel_msgs::srv::Step::Request{steps});
    edge_->call("/gazebo/step", request, [&answer](const Status& status, const Bytes& response) {
      EXPECT_TRUE(status.ok()) << status.why();
      EXPECT_TRUE(from_cdr(response, answer.emplace()).ok());
    });
    twin_->between_steps();
  };
  const auto run_owed = [&](std::uint64_t steps) {  // as in the runner
    for (std::uint64_t i = 0; i < steps; ++i) twin_->step();
    twin_->time_control().steps_owed -= steps;
    twin_->between_steps();
  };
  std::optional<doppel_msgs::srv::Step::Response> none, five, three, many;
  ask_for_steps(0, none);
  ASSERT_TRUE(none);
  ask_for_steps(5, five);
  ask_for_steps(3, three);
  EXPECT_EQ(twin_->time_control().steps_owed, 8u);
  run_owed(4);
  EXPECT_FALSE(five);  // a response is sent only after the steps are done
  run_owed(2);
  ASSERT_TRUE(five);
  EXPECT_TRUE(five->success);
  EXPECT_EQ(five->sim_time, to_seconds(stands + 6 * twin_->step_size()));
  EXPECT_FALSE(three);
  run_owed(2);
  ASSERT_TRUE(three);
  EXPECT_EQ(three->sim_time, to_seconds(stands + 8 * twin_->step_size()));
  ask_for_steps(1000, many);
  call("/gazebo/unpause_physics", "std_srvs/srv/Empty", "{}");
  EXPECT_FALSE(twin_->time_control().paused);
  ASSERT_TRUE(many);
  EXPECT_FALSE(many->success);
}

// The topics of the events of the twin's services.
std::size_t event_topics(const Bus& bus) {
  const auto topics = bus.topics();
  return static_cast<std::size_t>(std::ranges::count_if(
      topics, [](const TopicInfo& topic) { return topic.name.ends_with("/_service_event"); }));
}

TEST_F(TwinServicesTest, IntrospectionIsSwitchedByParameter) {
  bring_up("omarm_one");
  EXPECT_EQ(event_topics(twin_->bus()), 0U);
  const auto set = [this](const char* value) {
    return call("/gazebo/set_parameters", "rcl_interfaces/srv/SetParameters",
                std::string("{parameters: [{name: service_introspection, value: {type: 4, string_value: ") +
                    value + "}}]}");
  };
  EXPECT_NE(set("contents").find("successful: true"), std::string::npos);
  EXPECT_EQ(event_topics(twin_->bus()), twin_->bus().services().size());
  EXPECT_NE(set("content").find("did you mean 'contents'?"), std::string::npos);
  EXPECT_NE(set("disabled").find("successful: true"), std::string::npos);
  EXPECT_EQ(event_topics(twin_->bus()), 0U);
}

TEST_F(TwinServicesTest, IntrospectionIsSetByCommandLine) {
  Scenario scenario;
  scenario.robots = {{.target = "omarm_one"}};
  scenario.ros.parameters = {GivenParameter{"gazebo", "service_introspection", std::string("metadata"), ""}};
  bring_up(scenario);
  EXPECT_EQ(twin_->bus().service_events(), ServiceEvents::metadata);
  scenario.ros.parameters = {GivenParameter{"gazebo", "service_introspection", std::string("all"), ""}};
  EXPECT_THROW(bring_up(scenario), InputError);
}

TEST_F(TwinServicesTest, StepWithoutPauseIsRefused) {
  bring_up("omarm_one");
  EXPECT_NE(call("/gazebo/step", "doppel_msgs/srv/Step", "{steps: 5}").find("success: false"),
            std::string::npos);
}

TEST_F(TwinServicesTest, SpeedIsValidatedAndApplied) {
  bring_up("omarm_one");
  call("/gazebo/set_speed", "doppel_msgs/srv/SetSpeed", "{factor: 2.5}");
  EXPECT_EQ(twin_->time_control().speed, 2.5);
  EXPECT_NE(call("/gazebo/set_speed", "doppel_msgs/srv/SetSpeed", "{factor: -1}").find("success: false"),
            std::string::npos);
  EXPECT_EQ(twin_->time_control().speed, 2.5);
}

TEST_F(TwinServicesTest, ResetRestoresStartAndHolds) {
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

// While paused no message is due; clients receive changes nevertheless.
TEST_F(TwinServicesTest, TransformsFollowWhilePaused) {
  bring_up("lab_arm");
  run(0.5);
  for (const char* topic : {"/clock", "/tf", "/joint_states"}) listen(topic);
  received<rosgraph_msgs::msg::Clock>("/clock");
  call("/gazebo/set_state", "doppel_msgs/srv/SetState", "{names: [j1], positions: [0.4], velocities: []}");
  const auto states = received<sensor_msgs::msg::JointState>("/joint_states");
  ASSERT_EQ(states.size(), 1u);
  const auto j1 = std::ranges::find(states[0].name, "j1") - states[0].name.begin();
  EXPECT_NEAR(states[0].position[static_cast<std::size_t>(j1)], 0.4, 1e-9);
  call("/gazebo/set_state", "doppel_msgs/srv/SetState", "{names: [j1], positions: [0.3], velocities: []}");
  EXPECT_EQ(received<tf2_msgs::msg::TFMessage>("/tf").size(), 1u);
  call("/gazebo/reset_world", "std_srvs/srv/Empty", "{}");
  const auto clocks = received<rosgraph_msgs::msg::Clock>("/clock");
  ASSERT_EQ(clocks.size(), 1u);
  EXPECT_EQ(from_msg(clocks[0].clock), Time{});
}

TEST_F(TwinServicesTest, JointLoadsMatchGravityTorque) {
  bring_up("lab_arm");
  run(1.0);
  listen("/doppel/joint_loads");
  run(1.0);
  const auto loads = received<doppel_msgs::msg::JointLoads>("/doppel/joint_loads");
  EXPECT_NEAR(static_cast<double>(loads.size()), 5.0, 1.0);
  const auto expected = twin_->robot().gravity_sag();
  ASSERT_EQ(loads.back().joint_names.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(loads.back().joint_names[i], expected[i].joint);
    EXPECT_NEAR(loads.back().gravity_torques[i], expected[i].torque, 1e-3);
    EXPECT_NEAR(loads.back().sags[i], expected[i].sag, 1e-4);
    EXPECT_NEAR(loads.back().margins[i], expected[i].margin, 1e-3);
    EXPECT_NEAR(loads.back().efforts[i], expected[i].torque, 0.05 + 0.05 * std::abs(expected[i].torque))
        << "expected the drive at rest to carry the gravity torque";
  }
}

// Compared with the physics engine's own energy, which is computed independently of the loads.
TEST_F(TwinServicesTest, JointLoadsAreSlopeOfPotentialEnergy) {
  for (const char* robot : {"lab_arm", "omarm_one", "omarm_zero"}) {
    bring_up(robot);
    listen("/doppel/joint_loads");
    run(0.3);
    received<doppel_msgs::msg::JointLoads>("/doppel/joint_loads");
    twin_->publish_state();
    twin_->between_steps();
    const auto loads = received<doppel_msgs::msg::JointLoads>("/doppel/joint_loads");
    ASSERT_EQ(loads.size(), 1u);
    const Engine& engine = twin_->engine();
    Instance& instance = twin_->robot().instance();
    const std::vector<double> q(instance.q().begin(), instance.q().end());
    const std::vector<double> rest(instance.v().size(), 0.0);
    for (std::size_t i = 0; i < loads[0].joint_names.size(); ++i) {
      const Model& model = twin_->robot().model();
      const ModelJoint& joint =
          model.joints[static_cast<std::size_t>(model.find_joint(loads[0].joint_names[i]))];
      const auto energy_at = [&](double offset) {
        Eigen::VectorXd moved = Eigen::Map<const Eigen::VectorXd>(q.data(), model.nq);
        moved[joint.q] += offset;
        instance.set_state({moved.data(), q.size()}, rest);  // mimic joints follow
        return engine.potential_energy();
      };
      const double slope = (energy_at(1e-5) - energy_at(-1e-5)) / 2e-5;
      EXPECT_NEAR(loads[0].gravity_torques[i], slope, 1e-6) << robot << ' ' << joint.name;
      EXPECT_NEAR(loads[0].margins[i], joint.effort - std::abs(slope), 1e-6) << robot << ' ' << joint.name;
    }
  }
}

// The error of a drive at rest is the reported sag, within the friction.
TEST_F(TwinServicesTest, SagMatchesReport) {
  bring_up("lab_arm");
  run(2.0);
  listen("/doppel/joint_loads");
  run(0.3);
  const auto loads = received<doppel_msgs::msg::JointLoads>("/doppel/joint_loads").back();
  const Instance& robot = twin_->robot().instance();
  const Model& model = robot.model();
  for (std::size_t i = 0; i < loads.joint_names.size(); ++i) {
    const int index = model.find_joint(loads.joint_names[i]);
    const ModelJoint& joint = model.joints[static_cast<std::size_t>(index)];
    const double behind = robot.drive_reference(index) - robot.q()[static_cast<std::size_t>(joint.q)];
    const double stiffness = robot.made_of().servos[static_cast<std::size_t>(index)].stiffness;
    EXPECT_NEAR(behind, loads.sags[i], joint.friction / stiffness + 1e-6) << joint.name;
  }
}

TEST_F(TwinServicesTest, JointEffortEndsAfterDuration) {
  Scenario scenario;
  scenario.robots = {{.target = "omarm_one"}};
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
  EXPECT_LT(std::abs(joint("Revolute 1").v), 0.05);  // friction has stopped it: the effort has ended
}

TEST_F(TwinServicesTest, EffortsAndWrenchesBeyondTheirNumberAreRefused) {
  bring_up("lab_arm");
  const auto push_joint = [this] {
    return call("/gazebo/apply_joint_effort", "gazebo_msgs/srv/ApplyJointEffort",
                "{joint_name: j1, effort: 0.001, duration: {sec: 10}}");
  };
  const auto push_link = [this] {
    return call("/gazebo/apply_link_wrench", "gazebo_msgs/srv/ApplyLinkWrench",
                "{link_name: '" + twin_->robot().instance().model().links.back().name +
                    "', wrench: {force: {x: 0.001}}, duration: {sec: 10}}");
  };
  for (int i = 0; i < 256; ++i) ASSERT_TRUE(has(push_joint(), "success: true")) << i;
  EXPECT_TRUE(has(push_joint(), "too many efforts and wrenches are active"));
  EXPECT_TRUE(has(push_link(), "too many efforts and wrenches are active"));
  call("/gazebo/clear_joint_efforts", "gazebo_msgs/srv/JointRequest", "{joint_name: j1}");
  EXPECT_TRUE(has(push_joint(), "success: true"));
  EXPECT_TRUE(has(push_link(), "success: true"));
}

TEST_F(TwinServicesTest, SavedStatesBeyondTheirNumberAreRefused) {
  bring_up("lab_arm");
  const auto save = [this](const std::string& name) {
    return call("/doppel/save_state", "doppel_msgs/srv/SaveState", "{name: " + name + "}");
  };
  const char* const refusal = "there are 64 saved states already; delete some";
  for (int i = 0; i < 64; ++i) ASSERT_TRUE(has(save("state_" + std::to_string(i)), "success: true")) << i;
  EXPECT_TRUE(has(save("one_more"), refusal));
  EXPECT_TRUE(has(save("state_0"), "success: true")) << "a state may be replaced";
  EXPECT_TRUE(has(call("/doppel/delete_state", "doppel_msgs/srv/DeleteState", "{name: state_0}"), "deleted"));
  EXPECT_TRUE(has(save("one_more"), "success: true"));
  EXPECT_TRUE(has(save("another"), refusal));
}

TEST_F(TwinServicesTest, EffortOnHeldJointNamesItsDrive) {
  bring_up("omarm_one");
  const std::string answer = call("/gazebo/apply_joint_effort", "gazebo_msgs/srv/ApplyJointEffort",
                                  "{joint_name: 'Revolute 1', effort: 0.5, duration: {sec: 1}}");
  EXPECT_NE(answer.find("its drive holds its position with up to 3.5 N m"), std::string::npos) << answer;
}

TEST_F(TwinServicesTest, UnknownNamesAreAnsweredWithNearest) {
  bring_up("omarm_one");
  const std::string answer = call("/gazebo/apply_joint_effort", "gazebo_msgs/srv/ApplyJointEffort",
                                  "{joint_name: 'Revolute_1', effort: 0.5}");
  EXPECT_NE(answer.find("success: false"), std::string::npos) << answer;
  EXPECT_NE(answer.find("Revolute 1"), std::string::npos) << answer;
}

TEST_F(TwinServicesTest, StateCanBeReadAndWritten) {
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
