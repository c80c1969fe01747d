#include "doppel/scenario/compile/simulated_hardware.h"

#include <gtest/gtest.h>

#include <cmath>

#include "doppel/description/urdf/load.h"
#include "doppel/physics/contract/engine_modules.h"

namespace doppel {
namespace {

constexpr const char* kMimicArm = R"(<robot name="arm">
<link name="world"/>
<link name="a"><inertial><origin xyz="0.1 0 0"/><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="b"><inertial><origin xyz="0.1 0 0"/><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="tool"/>
<joint name="j 1" type="revolute"><parent link="world"/><child link="a"/><origin xyz="0 0 1"/><axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="20" velocity="3"/></joint>
<joint name="j 2" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0.2 0 0"/><axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="20" velocity="3"/><mimic joint="j 1"/></joint>
<joint name="glue" type="fixed"><parent link="b"/><child link="tool"/></joint>
</robot>)";

HardwareJointDescription entry(const std::string& name, std::vector<std::string> commands) {
  HardwareJointDescription out;
  out.name = name;
  for (const std::string& command : commands) out.command_interfaces.emplace_back().name = command;
  for (const char* state : {kPosition, kVelocity, kEffort}) out.state_interfaces.emplace_back().name = state;
  return out;
}

class SimulatedHardwareTest : public ::testing::Test {
 protected:
  SimulatedHardwareTest() {
    use(kMimicArm);
    diagnostics_ = {};
    hardware_.name = "system";
  }
  void use(const std::string& urdf) {
    PackageResolver resolver;
    robot_ = parse_urdf(urdf, "arm.urdf", resolver, diagnostics_);
    model_ = std::make_shared<const Model>(compile_model(robot_, BaseKind::fixed, diagnostics_));
    CollisionMeshes meshes;
    engine_ = compile_world(kDefaultEngine, {},
                            {make_instance(std::make_shared<const RobotDescription>(robot_), model_, {},
                                           meshes, diagnostics_)},
                            diagnostics_)
                  ->make_engine();
    arm_ = engine_->instance(0);
  }
  [[nodiscard]] SimulatedHardware make() {
    SimulatedHardware system(arm_);
    EXPECT_TRUE(system.on_init({hardware_, *model_, log_, 100.0, diagnostics_}).ok());
    EXPECT_TRUE(system.on_configure().ok());
    EXPECT_TRUE(system.on_activate().ok());
    return system;
  }
  [[nodiscard]] std::vector<std::string> rules() const {
    std::vector<std::string> out;
    for (const Diagnostic& d : diagnostics_.all()) out.push_back(d.rule);
    return out;
  }

  Diagnostics diagnostics_;
  Log log_;
  RobotDescription robot_;
  std::shared_ptr<const Model> model_;
  std::unique_ptr<Engine> engine_;
  Instance arm_;
  HardwareDescription hardware_;
};

TEST_F(SimulatedHardwareTest, UnknownJointsAreLeftOutWithNearest) {
  hardware_.joints = {entry("j_1", {"position"})};
  static_cast<void>(make());
  ASSERT_EQ(rules(), std::vector<std::string>{"ros2_control.unknown_joint"});
  EXPECT_FALSE(diagnostics_.has_errors());
  EXPECT_NE(diagnostics_.all()[0].message.find("did you mean 'j 1'"), std::string::npos);
}

TEST_F(SimulatedHardwareTest, UnsupportedJointsAndInterfacesAreLeftOut) {
  hardware_.joints = {entry("j 1", {"position", "torque"}), entry("j 2", {"position"}),
                      entry("glue", {"position"})};
  const SimulatedHardware system = make();
  EXPECT_EQ(rules(), (std::vector<std::string>{"ros2_control.unknown_interface",
                                               "ros2_control.mimic_commanded", "ros2_control.fixed_joint"}));
  ASSERT_EQ(system.command_interfaces().size(), 1u);
  EXPECT_EQ(system.command_interfaces()[0].full_name(), "j 1/position");
  EXPECT_EQ(system.state_interfaces().size(), 6u);
}

TEST_F(SimulatedHardwareTest, ClaimChoosesDriveAndUnclaimedJointIsFree) {
  hardware_.joints = {entry("j 1", {"position", "velocity", "effort"})};
  SimulatedHardware system = make();
  const int joint = model_->find_joint("j 1");
  EXPECT_EQ(arm_.drive(joint), DriveMode::passive);
  const std::vector<std::string> position{"j 1/position"}, velocity{"j 1/velocity"}, effort{"j 1/effort"},
      none;
  system.perform_switch(velocity, none);
  EXPECT_EQ(arm_.drive(joint), DriveMode::velocity);
  system.perform_switch(position, none);
  EXPECT_EQ(arm_.drive(joint), DriveMode::position);
  system.perform_switch(effort, std::vector<std::string>{"j 1/position", "j 1/velocity"});
  EXPECT_EQ(arm_.drive(joint), DriveMode::effort);
  system.perform_switch(none, effort);
  EXPECT_EQ(arm_.drive(joint), DriveMode::passive);
  const std::vector<std::string> both{"j 1/velocity", "j 1/effort"};
  EXPECT_FALSE(system.prepare_switch(both, none).ok());
}

TEST_F(SimulatedHardwareTest, CommandMovesJointAndState) {
  hardware_.joints = {entry("j 1", {"position"})};
  SimulatedHardware system = make();
  system.perform_switch(std::vector<std::string>{"j 1/position"}, {});
  std::vector<double> states(3), commands{std::nan("")};
  static_cast<void>(system.write({}, {}, commands));
  commands = {0.5};
  static_cast<void>(system.write({}, {}, commands));
  for (int i = 0; i < 2000; ++i) engine_->step();
  static_cast<void>(system.read({}, {}, states));
  EXPECT_NEAR(states[0], 0.5, 0.02);
  EXPECT_NEAR(states[1], 0.0, 0.01);
  EXPECT_GT(std::abs(states[2]), 0.5);  // it holds two kilograms at a horizontal distance
}

TEST_F(SimulatedHardwareTest, EffortIsMeanOfStepsSinceLastReading) {
  hardware_.joints = {entry("j 1", {"position"})};
  SimulatedHardware system = make();
  system.perform_switch(std::vector<std::string>{"j 1/position"}, {});
  std::vector<double> states(3);
  static_cast<void>(system.write({}, {}, std::vector<double>{0.2}));
  const auto j = static_cast<std::size_t>(arm_.model().find_joint("j 1"));
  double largest = 0;  // difference between the mean and the last step
  for (int cycle = 0; cycle < 20; ++cycle) {
    double sum = 0;
    for (int i = 0; i < 10; ++i) {
      engine_->step();
      system.after_step();
      sum += arm_.drive_effort()[j];
    }
    largest = std::max(largest, std::abs(sum / 10 - arm_.drive_effort()[j]));
    static_cast<void>(system.read({}, {}, states));
    EXPECT_NEAR(states[2], sum / 10, 1e-12);
    static_cast<void>(system.read({}, {}, states));  // at the same time
    EXPECT_NEAR(states[2], sum / 10, 1e-12);
  }
  EXPECT_GT(largest, 0.01);
}

TEST_F(SimulatedHardwareTest, RestoredEffortContinuesAmongSteps) {
  hardware_.joints = {entry("j 1", {"position"})};
  SimulatedHardware system = make();
  system.perform_switch(std::vector<std::string>{"j 1/position"}, {});
  std::vector<double> first(3), second(3);
  static_cast<void>(system.write({}, {}, std::vector<double>{0.2}));
  const auto advance = [&](int steps) {
    for (int i = 0; i < steps; ++i) {
      engine_->step();
      system.after_step();
    }
  };
  advance(3);
  SavedSlot slot;
  ASSERT_TRUE(system.save(slot));
  const auto saved = engine_->clone();
  advance(4);
  static_cast<void>(system.read({}, {}, first));
  engine_->copy_state(*saved);
  system.restore(*slot);
  advance(4);
  static_cast<void>(system.read({}, {}, second));
  EXPECT_EQ(first, second);
}

TEST_F(SimulatedHardwareTest, UnclaimedJointFollowsDescription) {
  hardware_.joints = {entry("j 1", {"position"})};
  const int joint = model_->find_joint("j 1");
  hardware_.params = {{"unclaimed", "hold"}};
  SimulatedHardware holds = make();
  EXPECT_EQ(holds.when_unclaimed(), PassiveJoint::hold);
  EXPECT_EQ(arm_.drive(joint), DriveMode::position);
  for (int i = 0; i < 2000; ++i) engine_->step();
  EXPECT_NEAR(arm_.q()[0], 0.0, 0.05);  // without a command two kilograms would fall
  ASSERT_TRUE(holds.on_deactivate().ok());
  EXPECT_EQ(arm_.drive(joint), DriveMode::passive);
  hardware_.params = {{"unclaimed", "brake"}};
  EXPECT_EQ(make().when_unclaimed(), PassiveJoint::brake);
  EXPECT_EQ(arm_.drive(joint), DriveMode::velocity);
  hardware_.params = {{"unclaimed", "holds"}};
  SimulatedHardware wrong(arm_);
  try {
    static_cast<void>(wrong.on_init({hardware_, *model_, log_, 100.0, diagnostics_}));
    FAIL() << "expected an InputError: 'holds' is not a valid value";
  } catch (const InputError& problem) {
    EXPECT_NE(std::string(problem.what()).find("did you mean 'hold'?"), std::string::npos) << problem.what();
  }
}

TEST_F(SimulatedHardwareTest, EmergencyStopHoldsMovingJoint) {
  hardware_.joints = {entry("j 1", {"velocity"})};
  SimulatedHardware system = make();
  const std::vector<std::string> velocity{"j 1/velocity"};
  system.perform_switch(velocity, {});
  const std::vector<double> command{-1.0};
  for (int i = 0; i < 500; ++i) {
    static_cast<void>(system.write({}, {}, command));
    engine_->step();
  }
  ASSERT_LT(arm_.v()[0], -0.9);
  const double q = arm_.q()[0];
  system.on_stop();
  system.perform_switch({}, velocity);
  for (int i = 0; i < 2000; ++i) engine_->step();
  EXPECT_NEAR(arm_.v()[0], 0.0, 0.01);
  EXPECT_NEAR(arm_.q()[0], q, 0.1);
  system.on_stop_reset();
  EXPECT_EQ(arm_.drive(model_->find_joint("j 1")), DriveMode::passive);
}

TEST_F(SimulatedHardwareTest, InitialValuesAreClampedToLimits) {
  hardware_.joints = {entry("j 1", {"position"})};
  hardware_.joints[0].state_interfaces[0].initial_value = 3.0;
  robot_.hardware = {hardware_};
  Eigen::VectorXd q = model_->neutral();
  apply_initial_values(robot_, *model_, q, diagnostics_);
  EXPECT_EQ(rules(), std::vector<std::string>{"ros2_control.initial_value_outside"});
  EXPECT_EQ(q[0], 2.0);
  EXPECT_EQ(q[1], 2.0);
}

TEST_F(SimulatedHardwareTest, ContinuousJointTakesShortestWay) {
  std::string wheel = kMimicArm;
  wheel.replace(wheel.find("revolute"), 8, "continuous");
  use(wheel);
  hardware_.joints = {entry("j 1", {"position"})};
  SimulatedHardware system = make();
  system.perform_switch(std::vector<std::string>{"j 1/position"}, {});
  const std::vector<double> command{6.0};  // -0.28 rad and a turn
  for (int i = 0; i < 2000; ++i) {
    static_cast<void>(system.write({}, {}, command));
    engine_->step();
  }
  EXPECT_NEAR(arm_.q()[0], 6.0 - 2.0 * 3.14159265358979, 0.02);
}

TEST_F(SimulatedHardwareTest, PluginsAreMappedAndTyposReported) {
  hardware_.plugin = "ign_ros2_control/IgnitionSystem";
  report_plugin(hardware_, PluginUse::simulated, diagnostics_);
  hardware_.plugin = "gz_ros2_control/GazeboSimSytem";
  report_plugin(hardware_, PluginUse::simulated, diagnostics_);
  hardware_.plugin = "omarm_hardware/OmArmSystem";
  report_plugin(hardware_, PluginUse::simulated, diagnostics_);
  EXPECT_EQ(rules(), (std::vector<std::string>{"ros2_control.plugin_mapped", "ros2_control.plugin_typo",
                                               "ros2_control.plugin_simulated"}));
}

// The proposal of the note must be possible.
TEST_F(SimulatedHardwareTest, NoteNamesDevicesOnlyWhereDoppelHasTheirDriver) {
  hardware_.plugin = "doppel/FeetechSts";
  report_plugin(hardware_, PluginUse::driver, diagnostics_);
  hardware_.plugin = "my_arm/MyArmSystem";
  report_plugin(hardware_, PluginUse::simulated, diagnostics_);
  const std::string driver = diagnostics_.all()[0].str(), foreign = diagnostics_.all()[1].str();
  EXPECT_NE(driver.find("use_sim:=false drives the devices"), std::string::npos) << driver;
  EXPECT_EQ(foreign.find("use_sim:=false"), std::string::npos) << foreign;
  EXPECT_NE(foreign.find("doppel has no driver 'my_arm/MyArmSystem'"), std::string::npos) << foreign;
  for (const char* way : {"doppel/FeetechSts", "hardware.yaml", "doppel/Topic", "--plugin"})
    EXPECT_NE(foreign.find(way), std::string::npos) << foreign;
}

TEST_F(SimulatedHardwareTest, ParametersOfMockWithoutEffectAreNamed) {
  hardware_.plugin = "mock_components/GenericSystem";
  hardware_.params = {{"mock_sensor_commands", "false"},
                      {"state_following_offset", "0.0"},
                      {"calculate_dynamics", "true"},
                      {"mock_sensor_comands", "true"}};
  report_plugin(hardware_, PluginUse::simulated, diagnostics_);
  EXPECT_EQ(rules(), (std::vector<std::string>{"ros2_control.plugin_mapped", "ros2_control.param_unused",
                                               "ros2_control.unknown_param"}));
  EXPECT_NE(diagnostics_.all()[1].message.find("'calculate_dynamics'"), std::string::npos);
  EXPECT_NE(diagnostics_.all()[2].message.find("did you mean 'mock_sensor_commands'"), std::string::npos);
}

}  // namespace
}  // namespace doppel
