// What every hardware component must guarantee, and how controllers use it: the same tests with the simulated
// robot and with the loopback. A further component is one more row of kComponents.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <ostream>

#include "doppel/control/controllers/builtin.h"
#include "doppel/control/hardware/hardware_registry.h"
#include "doppel/control/manager/controller_manager.h"
#include "doppel/description/urdf/load.h"
#include "doppel/physics/contract/engine_modules.h"
#include "doppel/ros/messages/controller_manager_msgs.h"
#include "doppel/ros/messages/sensor_msgs.h"
#include "doppel/ros/messages/std_msgs.h"
#include "doppel/ros/messages/trajectory_msgs.h"
#include "doppel/scenario/compile/simulated_hardware.h"

namespace doppel {
namespace {

using Names = std::vector<std::string>;

struct Component {
  const char* name;
  std::string_view plugin;
  double tolerance;  // rad, of a commanded position at rest
  double lag;        // rad, of a position on its way at 1 rad/s
};
void PrintTo(const Component& component, std::ostream* out) {
  *out << component.name;
}
constexpr Component kComponents[] = {{"simulated", kSimulatedPlugin, 2e-3, 0.12},
                                     {"loopback", "doppel/Loopback", 1e-12, 0.02}};

constexpr const char* kLevelArm = R"(<robot name="arm">
<link name="world"/>
<link name="a"><inertial><origin xyz="0.1 0 0"/><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="b"><inertial><origin xyz="0.1 0 0"/><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j 1" type="revolute"><parent link="world"/><child link="a"/><axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="50" velocity="3"/></joint>
<joint name="j 2" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0.2 0 0"/><axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="50" velocity="3"/></joint>
</robot>)";

constexpr const char* kControllers = R"(controller_manager:
  ros__parameters:
    update_rate: 100
    states: {type: joint_state_broadcaster/JointStateBroadcaster}
    arm: {type: joint_trajectory_controller/JointTrajectoryController}
    positions: {type: forward_command_controller/ForwardCommandController}
    speeds: {type: velocity_controllers/JointGroupVelocityController}
arm: {ros__parameters: {joints: [j 1, j 2], command_interfaces: [position], state_interfaces: [position, velocity]}}
positions: {ros__parameters: {joints: [j 1, j 2], interface_name: position}}
speeds: {ros__parameters: {joints: [j 1, j 2]}}
)";

class HardwareContract : public ::testing::TestWithParam<Component> {
 protected:
  HardwareContract() : file_(ParameterFile::parse(kControllers, "test.yaml")), node_(bus_, "/test") {
    PackageResolver resolver;
    Diagnostics unused;
    robot_ = parse_urdf(kLevelArm, "arm.urdf", resolver, unused);
    log_.add_sink([this](const LogLine& line) { said_ += line.text + "\n"; });
    description_.name = "ArmSystem";
    description_.type = "system";
    description_.plugin = GetParam().plugin;
    description_.params = {{"unclaimed", "hold"}};
    for (const char* name : {"j 1", "j 2"}) {
      HardwareJointDescription joint;
      joint.name = name;
      for (const char* command : {kPosition, kVelocity})
        joint.command_interfaces.emplace_back().name = command;
      for (const char* state : {kPosition, kVelocity, kEffort})
        joint.state_interfaces.emplace_back().name = state;
      description_.joints.push_back(std::move(joint));
    }
  }

  void bring_up(const Names& controllers) {
    Diagnostics diagnostics;
    robot_.hardware = {description_};
    model_ = std::make_shared<const Model>(compile_model(robot_, BaseKind::fixed, diagnostics));
    WorldSettings world;
    world.gravity.setZero();
    world.ground = false;
    InstanceOptions options;
    options.gravity = world.gravity;
    options.q0 = model_->neutral();
    apply_initial_values(robot_, *model_, options.q0, diagnostics);
    CollisionMeshes meshes;
    engine_ = compile_world(kDefaultEngine, world,
                            {make_instance(std::make_shared<const RobotDescription>(robot_), model_, options,
                                           meshes, diagnostics)},
                            diagnostics)
                  ->make_engine();
    HardwareRegistry registry = HardwareRegistry::with_builtin();
    register_simulated_hardware(registry, engine_->instance(0));
    manager_ = std::make_unique<ControllerManager>(bus_, *model_, controllers_, &file_,
                                                   ControllerManagerOptions{}, log_, diagnostics);
    EXPECT_TRUE(
        manager_->add_hardware(registry.find(description_.plugin)->make(), description_, diagnostics));
    manager_->start(controllers);
    EXPECT_FALSE(diagnostics.has_errors());
  }
  void TearDown() override { manager_.reset(); }

  void run(double seconds) {
    const auto ticks = static_cast<int>(std::lround(seconds / to_seconds(manager_->period())));
    for (int i = 0; i < ticks; ++i) {
      bus_.set_now(now_);
      manager_->tick(now_);
      manager_->settle(now_);
      manager_->housekeeping(now_);
      now_ += manager_->period();
      while (engine_->time() < now_) engine_->step();
    }
  }
  void command(const std::string& controller, std::vector<double> values) {
    node_.advertise<std_msgs::msg::Float64MultiArray>("/" + controller + "/commands")
        .publish({{}, std::move(values)}, now_);
  }
  [[nodiscard]] double q(const std::string& joint) const { return manager_->state(joint + "/position"); }
  [[nodiscard]] double v(const std::string& joint) const { return manager_->state(joint + "/velocity"); }
  Status switch_to(const Names& start, const Names& stop) {
    return manager_->switch_controllers(start, stop, Strictness::strict);
  }
  [[nodiscard]] HardwareView hardware() const { return manager_->hardware().front(); }
  HardwareState bring_to(const char* state) {
    controller_manager_msgs::srv::SetHardwareComponentState::Request request;
    request.name = "ArmSystem";
    request.target_state.label = state;
    bus_.set_now(now_);
    bus_.attach("client")->call("/controller_manager/set_hardware_component_state", to_cdr(request),
                                [](Status, Bytes) {});
    bus_.spin();
    return hardware().state;
  }

  Bus bus_;
  ParameterFile file_;
  Node node_;
  RobotDescription robot_;
  HardwareDescription description_;
  std::shared_ptr<const Model> model_;
  ControllerRegistry controllers_ = builtin_controllers();
  Log log_;
  std::string said_;
  std::unique_ptr<Engine> engine_;
  std::unique_ptr<ControllerManager> manager_;
  Time now_{};
};

TEST_P(HardwareContract, InterfacesAndInitialValuesMatchDescription) {
  description_.joints[1].state_interfaces[0].initial_value = 0.75;
  bring_up({"states"});
  Names commands, states;
  for (const InterfaceView& i : manager_->command_interfaces()) commands.push_back(i.full_name);
  for (const InterfaceView& i : manager_->state_interfaces()) states.push_back(i.full_name);
  EXPECT_THAT(commands, testing::ElementsAre("j 1/position", "j 1/velocity", "j 2/position", "j 2/velocity"));
  EXPECT_EQ(states.size(), 6u);
  EXPECT_EQ(hardware().state, HardwareState::active);
  EXPECT_DOUBLE_EQ(q("j 2"), 0.75);
  run(0.5);
  EXPECT_NEAR(q("j 2"), 0.75, GetParam().tolerance);  // no command: it is held
}

TEST_P(HardwareContract, TrajectoryIsFollowedToItsEnd) {
  bring_up({"states", "arm"});
  trajectory_msgs::msg::JointTrajectory message;
  message.joint_names = {"j 1", "j 2"};
  message.points.resize(1);
  message.points[0].positions = {0.8, -0.4};
  message.points[0].time_from_start = to_duration_msg(std::chrono::seconds(1));
  node_.advertise<trajectory_msgs::msg::JointTrajectory>("/arm/joint_trajectory").publish(message, now_);
  run(0.5);
  EXPECT_NEAR(q("j 1"), 0.4, GetParam().lag);
  run(1.5);
  EXPECT_NEAR(q("j 1"), 0.8, GetParam().tolerance);
  EXPECT_NEAR(q("j 2"), -0.4, GetParam().tolerance);
  EXPECT_NEAR(v("j 1"), 0.0, 1e-2);
}

TEST_P(HardwareContract, HandoverKeepsPosition) {
  bring_up({"positions"});
  command("positions", {0.5, 0.25});
  run(1.5);
  manager_->load("arm");
  ASSERT_TRUE(manager_->configure("arm").ok());
  ASSERT_TRUE(switch_to({"arm"}, {"positions"}).ok());
  run(1.0);
  EXPECT_NEAR(q("j 1"), 0.5, GetParam().tolerance);
  EXPECT_NEAR(q("j 2"), 0.25, GetParam().tolerance);
}

TEST_P(HardwareContract, VelocityIsHeldUntilControllerStops) {
  bring_up({"speeds"});
  command("speeds", {1.0, 0.0});
  run(1.0);
  EXPECT_NEAR(v("j 1"), 1.0, 0.05);
  EXPECT_NEAR(q("j 1"), 1.0, 0.15);
  ASSERT_TRUE(switch_to({}, {"speeds"}).ok());
  run(0.5);
  const double rest = q("j 1");
  run(0.5);
  EXPECT_NEAR(q("j 1"), rest, 1e-3);
  EXPECT_NEAR(v("j 1"), 0.0, 1e-2);
}

TEST_P(HardwareContract, NanCommandMovesNothing) {
  bring_up({"positions"});
  command("positions", {0.5, 0.5});
  run(1.0);
  command("positions", {std::nan(""), 0.1});
  run(0.5);
  EXPECT_NEAR(q("j 1"), 0.5, GetParam().tolerance);
  EXPECT_NEAR(q("j 2"), 0.5, GetParam().tolerance);
}

TEST_P(HardwareContract, EmergencyStopEndsMotionWithoutResume) {
  bring_up({"states", "speeds"});
  command("speeds", {1.0, -1.0});
  run(0.5);
  manager_->stop("the test");
  run(0.3);
  const double rest = q("j 1");
  command("speeds", {1.0, 1.0});
  run(0.5);
  EXPECT_NEAR(q("j 1"), rest, 1e-3);
  EXPECT_NEAR(v("j 2"), 0.0, 1e-2);
  ASSERT_TRUE(manager_->reset_stop().ok());
  run(0.5);
  EXPECT_NEAR(q("j 1"), rest, 1e-3);
  command("speeds", {1.0, 0.0});
  run(0.5);
  EXPECT_NEAR(v("j 1"), 1.0, 0.05);
}

TEST_P(HardwareContract, StopDuringMotionHoldsPosition) {
  bring_up({"positions"});
  command("positions", {2.0, 0.0});
  run(0.05);
  manager_->stop("the test");
  run(0.3);
  const double rest = q("j 1");
  ASSERT_TRUE(manager_->reset_stop().ok());
  run(0.5);
  EXPECT_NEAR(q("j 1"), rest, 1e-3);
}

TEST_P(HardwareContract, HardwareCanBeReactivated) {
  bring_up({"states"});
  EXPECT_EQ(bring_to("inactive"), HardwareState::inactive);
  run(0.1);
  EXPECT_TRUE(std::isfinite(q("j 1")));
  EXPECT_EQ(bring_to("unconfigured"), HardwareState::unconfigured);
  EXPECT_EQ(bring_to("active"), HardwareState::active);
  manager_->load("positions");
  ASSERT_TRUE(manager_->configure("positions").ok());
  ASSERT_TRUE(switch_to({"positions"}, {}).ok());
  command("positions", {0.3, 0.3});
  run(1.5);
  EXPECT_NEAR(q("j 1"), 0.3, GetParam().tolerance);
}

TEST_P(HardwareContract, StatesReachBroadcaster) {
  bring_up({"states", "positions"});
  sensor_msgs::msg::JointState last;
  node_.subscribe<sensor_msgs::msg::JointState>("/joint_states",
                                                [&](const auto& message) { last = message; });
  command("positions", {0.5, -0.5});
  run(1.5);
  ASSERT_EQ(last.name.size(), 2u);
  EXPECT_NEAR(last.position[0], 0.5, GetParam().tolerance);
  EXPECT_NEAR(last.position[1], -0.5, GetParam().tolerance);
}

TEST_P(HardwareContract, SameCommandsGiveSameStates) {
  const auto history = [this] {
    manager_.reset();
    now_ = Time{};
    bring_up({"speeds"});
    std::vector<std::uint64_t> bits;
    for (int i = 0; i < 20; ++i) {
      command("speeds", {0.1 * i, -0.05 * i});
      run(0.05);
      bits.push_back(std::bit_cast<std::uint64_t>(q("j 1")));
      bits.push_back(std::bit_cast<std::uint64_t>(v("j 2")));
    }
    return bits;
  };
  EXPECT_EQ(history(), history());
}

INSTANTIATE_TEST_SUITE_P(Components, HardwareContract, ::testing::ValuesIn(kComponents),
                         [](const auto& component) { return component.param.name; });

// -- faults that only the loopback can inject

class LoopbackFaults : public HardwareContract {
 protected:
  void order(const std::string& fault, std::vector<std::pair<std::string, std::string>> more = {}) {
    description_.params = {{"fault", fault}};
    description_.params.insert(description_.params.end(), more.begin(), more.end());
  }
  // Half of its delay is over afterwards.
  void send_delayed_command() {
    description_.params = {{"delay", "0.1"}};
    bring_up({"positions"});
    run(0.05);
    command("positions", {0.02, 0.0});
    run(0.05);
  }
};

TEST_P(LoopbackFaults, ErrorAtNthReadStopsController) {
  order("error", {{"fault_at", "30"}});
  bring_up({"positions"});
  run(0.2);
  EXPECT_EQ(hardware().state, HardwareState::active);
  run(0.2);
  EXPECT_EQ(hardware().state, HardwareState::unconfigured);
  EXPECT_EQ(manager_->controllers().front().state, ControllerState::inactive);
  EXPECT_THAT(hardware().fault, testing::HasSubstr("from read 30 on"));
}

TEST_P(LoopbackFaults, ExceptionInWriteWithoutRecoveryFinalizes) {
  order("throw", {{"fault_at", "5"}, {"fault_in", "write"}, {"recovers", "false"}});
  bring_up({"positions"});
  run(0.1);
  EXPECT_EQ(hardware().state, HardwareState::finalized);
}

TEST_P(LoopbackFaults, DeactivateRequestDeactivatesComponent) {
  order("deactivate", {{"fault_at", "5"}});
  bring_up({"positions"});
  run(0.1);
  EXPECT_EQ(hardware().state, HardwareState::inactive);
  EXPECT_EQ(manager_->controllers().front().state, ControllerState::inactive);
}

TEST_P(LoopbackFaults, NanStatesNeverBecomeCommands) {
  order("nan", {{"fault_at", "30"}});
  bring_up({"arm"});
  run(0.2);
  const double before = manager_->command("j 1/position");
  run(0.5);
  EXPECT_TRUE(std::isnan(q("j 1")));
  EXPECT_EQ(manager_->command("j 1/position"), before);
}

TEST_P(LoopbackFaults, WrongStateIsRead) {
  order("wrong", {{"fault_at", "30"}, {"fault_for", "10"}, {"fault_size", "0.5"}});
  bring_up({"states"});
  run(0.2);
  EXPECT_EQ(q("j 1"), 0.0);
  run(0.15);
  EXPECT_EQ(q("j 1"), 0.5);
  run(0.2);
  EXPECT_EQ(q("j 1"), 0.0);
}

TEST_P(LoopbackFaults, SilentDeviceKeepsOldStates) {
  order("silent", {{"fault_at", "40"}});
  bring_up({"positions"});
  run(0.1);
  command("positions", {0.2, 0.2});
  run(0.15);
  EXPECT_EQ(q("j 1"), 0.2);
  run(0.3);
  command("positions", {0.4, 0.4});
  run(0.5);
  EXPECT_EQ(q("j 1"), 0.2);
  EXPECT_EQ(hardware().state, HardwareState::active);
}

TEST_P(LoopbackFaults, DelayedCommandArrivesLate) {
  send_delayed_command();
  run(0.05);
  EXPECT_EQ(q("j 1"), 0.0);
  run(0.03);
  EXPECT_EQ(q("j 1"), 0.02);
}

TEST_P(LoopbackFaults, DelayedCommandOfStoppedControllerMovesNothing) {
  send_delayed_command();
  ASSERT_TRUE(switch_to({}, {"positions"}).ok());
  ASSERT_TRUE(switch_to({"positions"}, {}).ok());
  run(0.5);
  EXPECT_EQ(q("j 1"), 0.0);
}

TEST_P(LoopbackFaults, DelayedCommandFromBeforeReactivationMovesNothing) {
  send_delayed_command();
  ASSERT_TRUE(switch_to({}, {"positions"}).ok());
  EXPECT_EQ(bring_to("inactive"), HardwareState::inactive);
  EXPECT_EQ(bring_to("active"), HardwareState::active);
  ASSERT_TRUE(switch_to({"positions"}, {}).ok());
  run(0.5);
  EXPECT_EQ(q("j 1"), 0.0);
}

TEST_P(LoopbackFaults, UnknownParametersAreRefusedWithNearest) {
  description_.params = {{"faut", "error"}, {"delay", "soon"}, {"unclaimed", "fre"}};
  try {
    bring_up({"positions"});
    FAIL() << "expected an InputError: three parameters are wrong";
  } catch (const InputError& problem) {
    ASSERT_EQ(problem.diagnostics().size(), 3u);
    EXPECT_THAT(problem.what(), testing::HasSubstr("did you mean 'fault'?"));
  }
}

INSTANTIATE_TEST_SUITE_P(Loopback, LoopbackFaults, ::testing::Values(kComponents[1]),
                         [](const auto& component) { return component.param.name; });

}  // namespace
}  // namespace doppel
