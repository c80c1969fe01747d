// joint_trajectory_controller's parameters, interfaces and life cycle.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "doppel/control/controllers/builtin.h"
#include "doppel/control/controllers/detail/joint_trajectory_controller.h"
#include "doppel/control/controllers/test/jtc_rig.h"

namespace doppel {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using Names = std::vector<std::string>;
using Result = FollowJointTrajectory::Result;

std::string load_error(JtcOptions options) {
  options.start = false;
  JtcRig rig(options);
  return input_error_of([&] { rig.manager->load("arm"); });
}

std::string configure_error(JtcOptions options) {
  options.start = false;
  JtcRig rig(options);
  rig.manager->load("arm");
  return rig.manager->configure("arm").why();
}

// jtc.md, B1.
TEST(JtcSetup, EmptyUnknownAndRepeatedListsAreErrors) {
  JtcOptions options;
  options.listed = "[]";
  EXPECT_THAT(load_error(options), HasSubstr("'joints' is empty"));
  options.listed = "[a, b, a]";
  EXPECT_THAT(load_error(options), AllOf(HasSubstr("test.yaml:5:36"), HasSubstr("'a' twice")));
  EXPECT_THAT(load_error(options_of({})), HasSubstr("'command_interfaces' is empty"));
  EXPECT_THAT(load_error(options_of({kPosition}, {})), HasSubstr("'state_interfaces' is empty"));
  EXPECT_THAT(load_error(options_of({"positon"})),
              AllOf(HasSubstr("did you mean 'position'"), HasSubstr("test.yaml:5:")));
  EXPECT_THAT(load_error(options_of({kPosition}, {kPosition, kEffort})),
              HasSubstr("unknown interface 'effort'"));
  EXPECT_THAT(load_error(options_of({kPosition, kPosition})), HasSubstr("twice"));
  EXPECT_THAT(load_error(options_of({kPosition}, {kPosition, kPosition})), HasSubstr("twice"));
}

// jtc.md, B2.
TEST(JtcSetup, CommandInterfaceCombinationsAreChecked) {
  for (const Names& good : std::vector<Names>{{kPosition},
                                              {kPosition, kVelocity},
                                              {kVelocity, kPosition},
                                              {kPosition, kVelocity, kAcceleration},
                                              {kVelocity},
                                              {kEffort},
                                              {kPosition, kEffort}}) {
    EXPECT_THAT(configure_error(options_of(good)), IsEmpty()) << yaml_list(good);
  }
  for (const Names& bad : std::vector<Names>{{kAcceleration},
                                             {kPosition, kAcceleration},
                                             {kVelocity, kAcceleration},
                                             {kVelocity, kEffort},
                                             {kPosition, kVelocity, kEffort},
                                             {kPosition, kVelocity, kAcceleration, kEffort}}) {
    EXPECT_THAT(load_error(options_of(bad)), HasSubstr("cannot follow a trajectory")) << yaml_list(bad);
  }
}

// jtc.md, B3.
TEST(JtcSetup, StateInterfaceCombinationsAreChecked) {
  EXPECT_THAT(load_error(options_of({kPosition}, {kPosition})), IsEmpty());
  EXPECT_THAT(load_error(options_of({kPosition}, {kPosition, kVelocity, kAcceleration})), IsEmpty());
  EXPECT_THAT(load_error(options_of({kPosition}, {kVelocity})), HasSubstr("cannot follow"));
  EXPECT_THAT(load_error(options_of({kPosition}, {kPosition, kAcceleration})), HasSubstr("cannot follow"));
}

// jtc.md, B4.
TEST(JtcSetup, ClosedLoopNeedsVelocityState) {
  for (const Names& commands : std::vector<Names>{{kVelocity}, {kEffort}, {kPosition, kEffort}}) {
    EXPECT_THAT(configure_error(options_of(commands, {kPosition})),
                HasSubstr("add velocity to state_interfaces"));
  }
  EXPECT_THAT(configure_error(options_of({kPosition, kVelocity}, {kPosition})), IsEmpty());
}

// jtc.md, B5.
TEST(JtcSetup, ActivationClaimsEveryInterface) {
  JtcRig rig(options_of({kPosition, kVelocity}));
  const ControllerView view = rig.manager->controllers().front();
  EXPECT_THAT(view.claimed, ElementsAre("a/position", "a/velocity", "b/position", "b/velocity", "c/position",
                                        "c/velocity"));
  EXPECT_THAT(view.required_states, ElementsAre("a/position", "a/velocity", "b/position", "b/velocity",
                                                "c/position", "c/velocity"));
}

// jtc.md, B6.
TEST(JtcSetup, CommandJointsCanBeSubset) {
  JtcOptions options = options_of({kPosition}, {kPosition}, "command_joints: [c, a]");
  JtcRig rig(options);
  EXPECT_THAT(rig.manager->controllers().front().claimed, ElementsAre("c/position", "a/position"));
  rig.say(trajectory(kJoints, {point(0.5, {1, 2, 3})}));
  rig.run_for(0.6);
  EXPECT_DOUBLE_EQ(rig.command("a/position"), 1);
  EXPECT_DOUBLE_EQ(rig.command("c/position"), 3);
  EXPECT_TRUE(std::isnan(rig.command("b/position")));
}

// jtc.md, B6.
TEST(JtcSetup, CommandJointsCanBeRenamed) {
  JtcOptions options = options_of({kPosition}, {kPosition}, "command_joints: [outer/a, outer/b, outer/c]");
  for (const char* joint : {"a", "b", "c"}) {
    options.more_commands.push_back({std::string("outer/") + joint, kPosition, std::nan("")});
  }
  JtcRig rig(options);
  rig.say(trajectory(kJoints, {point(0.5, {1, 2, 3})}));
  rig.run_for(0.6);
  EXPECT_DOUBLE_EQ(rig.command("outer/b/position"), 2);
}

// jtc.md, B6.
TEST(JtcSetup, UnknownCommandJointsFailConfiguration) {
  EXPECT_THAT(configure_error(options_of({kPosition}, {kPosition}, "command_joints: [a, b, c, d]")),
              HasSubstr("4 names and 'joints' only 3"));
  EXPECT_THAT(configure_error(options_of({kPosition}, {kPosition}, "command_joints: [a, bb]")),
              AllOf(HasSubstr("'bb'"), HasSubstr("must be some of them")));
}

// jtc.md, B7.
TEST(JtcSetup, ContinuousJointWithoutLimitsIsAccepted) {
  JtcOptions options;
  options.joints = {{.name = "turn", .type = JointType::continuous}};
  EXPECT_THAT(configure_error(options), IsEmpty());
}

TEST(JtcSetup, UnknownJointIsReportedWithPlace) {
  JtcOptions options;
  options.joints = {{"shoulder"}, {"elbow"}};
  options.listed = "[shoulder, elbo]";
  EXPECT_THAT(load_error(options), AllOf(HasSubstr("test.yaml:5:40"), HasSubstr("did you mean 'elbow'")));
}

TEST(JtcSetup, MimicJointsAreLeftOut) {
  JtcOptions options;
  options.joints = {{"a"}, {.name = "finger", .mimics = "a"}};
  JtcRig rig(options);
  EXPECT_EQ(rig.count(Severity::warning, "finger"), 1u);
  EXPECT_THAT(rig.manager->controllers().front().claimed, ElementsAre("a/position"));
  rig.say(trajectory({"finger", "a"}, {point(0.1, {9, 1})}));
  rig.run_for(0.2);
  EXPECT_DOUBLE_EQ(rig.command("a/position"), 1);
}

// jtc.md, B8.
TEST(JtcSetup, ContinuousJointTakesShortestWay) {
  JtcOptions options;
  options.joints = {{.name = "turn", .type = JointType::continuous},
                    {.name = "swing", .lower = -9, .upper = 9}};
  options.start = false;
  JtcRig rig(options);
  rig.hardware->set_position("turn", 3);
  rig.hardware->set_position("swing", 3);
  rig.start();
  Recorder<control_msgs::msg::JointTrajectoryControllerState> states(rig.bus, "/arm/controller_state");
  rig.say(trajectory({"turn", "swing"}, {point(1, {-3, -3})}));
  rig.run_for(0.5);
  const auto& middle = states.messages.back().reference.positions;
  EXPECT_NEAR(middle[0], -3 - (3.14159265 - 3) * 0.98, 0.02);  // beyond pi
  EXPECT_NEAR(middle[1], 0, 0.1);
  for (const auto& state : states.messages) EXPECT_LT(std::abs(state.error.positions[0]), 3.15);
}

// jtc.md, B9.
TEST(JtcSetup, ActivationHoldsPosition) {
  JtcOptions options;
  options.start = false;
  JtcRig rig(options);
  for (const std::string& joint : kJoints) rig.hardware->set_position(joint, 0.3);
  rig.manager->load("arm");
  ASSERT_TRUE(rig.manager->configure("arm").ok());
  ASSERT_TRUE(rig.activate().ok());
  rig.run(20);
  for (const std::string& joint : kJoints) EXPECT_DOUBLE_EQ(rig.command(joint + "/position"), 0.3);
  rig.hardware->set_position("a", 1);  // the hold is the position measured then, not the one measured now
  rig.run(1);
  EXPECT_DOUBLE_EQ(rig.command("a/position"), 0.3);
}

// The controller alone, with the test's own handles.
struct Handles {
  explicit Handles(const Names& full_names, double value)
      : names(full_names), values(full_names.size(), value) {}
  void give(Controller& controller) {
    for (std::size_t i = 0; i < names.size(); ++i) {
      controller.command_handles.emplace_back(&names[i], names[i].find('/'), &values[i]);
    }
  }
  void give_states(Controller& controller) {
    for (std::size_t i = 0; i < names.size(); ++i) {
      controller.state_handles.emplace_back(&names[i], names[i].find('/'), &values[i]);
    }
  }
  Names names;
  std::vector<double> values;
};

struct Bare {
  explicit Bare(const std::string& more = "", const std::string& commands = "position")
      : model(fake_robot({{"a"}})), node(bus, "/arm") {
    const ParameterFile file =
        ParameterFile::parse("arm: {ros__parameters: {joints: [a], command_interfaces: [" + commands +
                                 "], state_interfaces: [position]" + more + "}}",
                             "bare.yaml");
    overrides = file.overrides_for("/arm");
    context = {
        "arm", &node, &model, &log, &overrides, 100, "joint_trajectory_controller/JointTrajectoryController"};
    controller.on_init(context);
    EXPECT_TRUE(controller.on_configure().ok());
  }
  void update(int times = 1) {
    for (int i = 0; i < times; ++i, now += from_seconds(0.01)) {
      bus.set_now(now);
      controller.update(now, from_seconds(0.01));
    }
  }
  Bus bus;
  Model model;
  Node node;
  Log log;
  ParameterOverrides overrides;
  ControllerContext context;
  JointTrajectoryController controller;
  Time now = time_from_seconds(1);
};

// jtc.md, B10.
TEST(JtcSetup, ActivationStartsFromLastCommand) {
  Bare bare;
  Handles commands({"a/position"}, 0.7), states({"a/position"}, 0.5);
  commands.give(bare.controller), states.give_states(bare.controller);
  ASSERT_TRUE(bare.controller.on_activate().ok());
  bare.update(5);
  EXPECT_DOUBLE_EQ(commands.values[0], 0.7);
}

// jtc.md, B10.
TEST(JtcSetup, ActivationWithoutCommandStartsFromState) {
  Bare bare;
  Handles commands({"a/position"}, std::nan("")), states({"a/position"}, 0.5);
  commands.give(bare.controller), states.give_states(bare.controller);
  ASSERT_TRUE(bare.controller.on_activate().ok());
  bare.update(5);
  EXPECT_DOUBLE_EQ(commands.values[0], 0.5);
}

// jtc.md, B10.
TEST(JtcSetup, ActivationStartsFromStateWhereConfigured) {
  Bare bare(", set_last_command_interface_value_as_state_on_activation: false");
  Handles commands({"a/position"}, 0.7), states({"a/position"}, 0.5);
  commands.give(bare.controller), states.give_states(bare.controller);
  ASSERT_TRUE(bare.controller.on_activate().ok());
  bare.update(5);
  EXPECT_DOUBLE_EQ(commands.values[0], 0.5);
}

// jtc.md, B11.
TEST(JtcSetup, ActivationClearsIntegral) {
  JtcRig rig(options_of({kEffort}, {kPosition, kVelocity}, "gains: {a: {i: 10.0}}"));
  rig.hardware->set_position("a", -1);
  rig.run(50);
  EXPECT_GT(rig.command("a/effort"), 1);
  ASSERT_TRUE(rig.deactivate().ok());
  ASSERT_TRUE(rig.activate().ok());
  rig.run(3);
  EXPECT_DOUBLE_EQ(rig.command("a/effort"), 0);
}

// jtc.md, B12.
TEST(JtcSetup, MissingInterfacesAreReported) {
  Bare bare;
  Handles commands({"b/position"}, 0), states({"a/position"}, 0);
  commands.give(bare.controller), states.give_states(bare.controller);
  EXPECT_EQ(bare.controller.on_activate().why(), "Expected 1 'position' command interfaces, got 0.");
  bare.controller.command_handles.clear();
  bare.controller.state_handles.clear();
  Handles right({"a/position"}, 0);
  right.give(bare.controller);
  EXPECT_EQ(bare.controller.on_activate().why(), "Expected 1 'position' state interfaces, got 0.");
}

TEST(JtcSetup, UnmeasuredPositionFailsActivation) {
  Bare bare;
  Handles commands({"a/position"}, std::nan("")), states({"a/position"}, std::nan(""));
  commands.give(bare.controller), states.give_states(bare.controller);
  EXPECT_THAT(bare.controller.on_activate().why(), HasSubstr("joint 'a' has no measured position"));
}

TEST(JtcSetup, NanMeasurementKeepsLastCommand) {
  Bare bare;
  Handles commands({"a/position"}, std::nan("")), states({"a/position"}, 0.5);
  commands.give(bare.controller), states.give_states(bare.controller);
  ASSERT_TRUE(bare.controller.on_activate().ok());
  bare.update(2);
  Node speaker(bare.bus, "/speaker");
  states.values[0] = std::nan("");
  speaker.advertise<JointTrajectory>("/arm/joint_trajectory")
      .publish(trajectory({"a"}, {point(1, {1})}), bare.now);
  bare.update(2);
  EXPECT_DOUBLE_EQ(commands.values[0], 0.5);
  bare.update(100);  // the point itself needs no start
  EXPECT_DOUBLE_EQ(commands.values[0], 1);
}

// jtc.md, B13.
TEST(JtcSetup, DeactivationAbortsGoal) {
  JtcRig rig(options_of({kPosition, kVelocity, kAcceleration}));
  const auto goal = rig.send(trajectory(kJoints, {point(1, {1, 1, 1}, {0, 0, 0}, {0, 0, 0})}));
  rig.run_for(0.5);
  EXPECT_GT(rig.command("a/velocity"), 0.5);
  ASSERT_TRUE(rig.deactivate().ok());
  EXPECT_EQ(rig.answers[goal].status, GoalStatus::aborted);
  EXPECT_EQ(rig.answers[goal].result.error_code, Result::INVALID_GOAL);
  EXPECT_EQ(rig.answers[goal].result.error_string, "Current goal cancelled during deactivate transition.");
}

// jtc.md, B13.
TEST(JtcSetup, DeactivationKeepsPositionAndZeroesOtherCommands) {
  Bare bare("", "position, velocity, acceleration");
  Handles commands({"a/position", "a/velocity", "a/acceleration"}, 0.4), states({"a/position"}, 0);
  commands.give(bare.controller), states.give_states(bare.controller);
  ASSERT_TRUE(bare.controller.on_activate().ok());
  ASSERT_TRUE(bare.controller.on_deactivate().ok());
  EXPECT_THAT(commands.values, ElementsAre(0.4, 0, 0));
}

// jtc.md, B14.
TEST(JtcSetup, ReactivationHoldsPosition) {
  JtcRig rig;
  rig.say(trajectory(kJoints, {point(1, {1, 1, 1})}));
  rig.run_for(0.5);
  ASSERT_TRUE(rig.deactivate().ok());
  const double where = rig.hardware->position("a");
  rig.run(10);
  ASSERT_TRUE(rig.activate().ok());
  rig.run_for(1.5);
  EXPECT_DOUBLE_EQ(rig.command("a/position"), where);
}

// jtc.md, B15.
TEST(JtcSetup, CleanupSucceedsWhenInactive) {
  Bare bare;
  EXPECT_TRUE(bare.controller.on_cleanup().ok());
  EXPECT_TRUE(bare.controller.on_configure().ok());
  Handles commands({"a/position"}, 0.7), states({"a/position"}, 0.5);
  commands.give(bare.controller), states.give_states(bare.controller);
  ASSERT_TRUE(bare.controller.on_activate().ok());
  bare.update(2);
  EXPECT_TRUE(bare.controller.on_deactivate().ok());
  EXPECT_TRUE(bare.controller.on_cleanup().ok());
  EXPECT_TRUE(bare.controller.on_configure().ok());
  EXPECT_TRUE(bare.controller.on_activate().ok());
  bare.update(2);
  EXPECT_DOUBLE_EQ(commands.values[0], 0.7);
}

TEST(JtcSetup, InvalidParametersAreErrors) {
  EXPECT_THAT(load_error(options_of({kPosition}, {kPosition}, "action_monitor_rate: 0.01")),
              HasSubstr("0.01 is below"));
  EXPECT_THAT(load_error(options_of({kPosition}, {kPosition}, "interpolation_method: spline")),
              HasSubstr("did you mean 'splines'"));
  EXPECT_THAT(load_error(options_of({kPosition}, {kPosition}, "gains: {a: {antiwindup_strategy: nnone}}")),
              HasSubstr("did you mean 'none'"));
  EXPECT_THAT(
      load_error(options_of({kPosition}, {kPosition}, "gains: {b: {u_clamp_min: 2.0, u_clamp_max: 1.0}}")),
      AllOf(HasSubstr("gains of joint 'b'"), HasSubstr("u_clamp_min 2")));
  EXPECT_THAT(load_error(options_of({kPosition}, {kPosition}, "constraints: {goal_time: -1.0}")),
              HasSubstr("below 0"));
}

// jtc.md, B47.
TEST(JtcSetup, UnusedGainsAreReportedOnce) {
  JtcRig rig(options_of({kPosition}, {kPosition, kVelocity}, "gains: {a: {p: 200.0}, c: {d: 3.0}}"));
  EXPECT_EQ(rig.count(Severity::warning,
                      "gains for a, c have no effect: with command_interfaces [position] no PID runs; "
                      "stiffness is set by the servo"),
            1u)
      << rig.said();
  EXPECT_EQ(rig.count(Severity::warning, "test.yaml:5:"), 1u);
  JtcRig silent(options_of({kVelocity}, {kPosition, kVelocity}, "gains: {a: {p: 200.0}}"));
  EXPECT_EQ(silent.count(Severity::warning, "gains"), 0u) << silent.said();
}

// jtc.md, B56.
TEST(JtcSetup, UnusedStoppedVelocityIsReported) {
  const std::string tight = "constraints: {stopped_velocity_tolerance: 0.001}";
  EXPECT_EQ(JtcRig(options_of({kPosition}, {kPosition, kVelocity}, tight))
                .count(Severity::warning, "stopped_velocity"),
            1u);
  EXPECT_EQ(JtcRig(options_of({kVelocity}, {kPosition, kVelocity}, tight))
                .count(Severity::warning, "stopped_velocity"),
            0u);
  EXPECT_EQ(JtcRig(options_of({kPosition})).count(Severity::warning, "stopped_velocity"), 0u);
}

// jtc.md, B74.
TEST(JtcSetup, LoadsByRosName) {
  EXPECT_NE(builtin_controllers().find("joint_trajectory_controller/JointTrajectoryController"), nullptr);
}

TEST(JtcSetup, OpenLoopControlGivesDeprecationWarning) {
  JtcRig rig(options_of({kPosition}, {kPosition}, "open_loop_control: true"));
  EXPECT_EQ(rig.count(Severity::warning, "interpolate_from_desired_state: true"), 1u);
}

}  // namespace
}  // namespace doppel
