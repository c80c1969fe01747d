// Hardware that fails: its life cycle, the controllers that use it, and everything else, which keeps running.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "doppel/control/manager/plugin_library.h"
#include "doppel/control/manager/test/manager_rig.h"
#include "doppel/ros/messages/controller_manager_msgs.h"
#include "doppel/ros/messages/diagnostic_msgs.h"
#include "doppel/ros/messages/std_msgs.h"
#include "doppel/ros/messages/std_srvs.h"

namespace doppel {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using Names = std::vector<std::string>;

// Joint a on FakeSystem, joint b on Other; a group for each, a second one for b, and a broadcaster.
constexpr const char* kTwoSystems = R"(controller_manager:
  ros__parameters:
    states: {type: joint_state_broadcaster/JointStateBroadcaster}
    left: {type: position_controllers/JointGroupPositionController, fallback_controllers: [spare]}
    right: {type: position_controllers/JointGroupPositionController}
    spare: {type: velocity_controllers/JointGroupVelocityController}
left: {ros__parameters: {joints: [a]}}
right: {ros__parameters: {joints: [b]}}
spare: {ros__parameters: {joints: [b]}}
states: {ros__parameters: {joints: [b], interfaces: [position]}}
)";

constexpr const char* kOneGroup = R"(controller_manager:
  ros__parameters:
    left: {type: position_controllers/JointGroupPositionController}
left: {ros__parameters: {joints: [a]}}
)";

struct TwoSystems : ManagerRig {
  explicit TwoSystems(const std::string& yaml = kTwoSystems)
      : ManagerRig(yaml, {{"a"}, {"b"}}, only("FakeSystem", "a", {kPosition})) {
    auto second = std::make_unique<FakeHardware>(only("Other", "b", {kPosition, kVelocity}));
    other = second.get();
    EXPECT_TRUE(manager->add_hardware(std::move(second), other->description(), diagnostics));
  }
  static FakeHardwareOptions only(const std::string& name, const std::string& joint, Names commands) {
    FakeHardwareOptions options;
    options.name = name;
    options.joints = {joint};
    options.commands = std::move(commands);
    return options;
  }
  [[nodiscard]] HardwareView view(const std::string& name) const {
    for (const HardwareView& v : manager->hardware()) {
      if (v.name == name) return v;
    }
    throw std::logic_error("no hardware " + name);
  }
  FakeHardware* other = nullptr;
};

// Calls the service of the controller manager for FakeSystem, and ticks once; false if the call fails.
bool bring_hardware_to(ManagerRig& rig, const std::string& label) {
  controller_manager_msgs::srv::SetHardwareComponentState::Request request;
  request.name = "FakeSystem";
  request.target_state.label = label;
  bool ok = false;
  const auto edge = rig.bus.attach("client");
  edge->call("/controller_manager/set_hardware_component_state", to_cdr(request),
             [&](Status status, Bytes) { ok = status.ok(); });
  rig.run(1);
  return ok;
}

// The group 'left' has commanded 0.5 and is inactive again.
struct CommandedRig : ManagerRig {
  CommandedRig() : ManagerRig(kOneGroup) {
    manager->start(Names{"left"});
    say<std_msgs::msg::Float64MultiArray>("/left/commands", {{}, {0.5}});
    run(2);
    EXPECT_EQ(hardware->last_command("a/position"), 0.5);
    EXPECT_TRUE(switch_to({}, {"left"}).ok());
  }
};

TEST(HardwareLifecycle, StartInitialisesConfiguresAndActivates) {
  ManagerRig rig("");
  EXPECT_THAT(rig.hardware->calls, ElementsAre("on_init", "on_configure", "on_activate"));
  rig.manager.reset();  // disables the hardware as well
}

TEST(HardwareLifecycle, ReadErrorStopsItsControllersOnly) {
  TwoSystems rig;
  rig.start({"states", "left", "right"});
  rig.run(2);
  rig.hardware->read_answer = HardwareReturn::error;
  const int writes = rig.hardware->writes, others = rig.other->writes;
  rig.run(5);
  EXPECT_EQ(rig.view("FakeSystem").state, HardwareState::unconfigured);
  EXPECT_THAT(rig.view("FakeSystem").fault, HasSubstr("error in read: no reply"));
  EXPECT_EQ(rig.hardware->calls.back(), "on_error");
  EXPECT_EQ(rig.state_of("left"), ControllerState::inactive);
  EXPECT_EQ(rig.state_of("right"), ControllerState::active);
  EXPECT_EQ(rig.state_of("states"), ControllerState::active);
  EXPECT_EQ(rig.hardware->writes, writes);
  EXPECT_EQ(rig.other->writes, others + 5);
  EXPECT_EQ(rig.count(Severity::error,
                      "hardware 'FakeSystem' is unconfigured: error in read: no reply; its "
                      "joints are free; deactivated: 'left'"),
            1u)
      << rig.said();
}

TEST(HardwareLifecycle, ExceptionInWriteBecomesComponentError) {
  TwoSystems rig;
  rig.start({"left", "right"});
  rig.run(2);
  rig.hardware->throw_in = "write";
  rig.run(2);
  EXPECT_EQ(rig.view("FakeSystem").state, HardwareState::unconfigured);
  EXPECT_THAT(rig.view("FakeSystem").fault, HasSubstr("error in write: lost the port"));
  EXPECT_EQ(rig.state_of("left"), ControllerState::inactive);
  EXPECT_EQ(rig.state_of("right"), ControllerState::active);
}

TEST(HardwareLifecycle, ExceptionInSwitchBecomesComponentError) {
  TwoSystems rig;
  rig.hardware->throw_in = "perform_switch";
  rig.start({"left", "right"});
  rig.run(1);
  EXPECT_EQ(rig.view("FakeSystem").state, HardwareState::unconfigured);
  EXPECT_EQ(rig.state_of("left"), ControllerState::inactive);
  EXPECT_EQ(rig.state_of("right"), ControllerState::active);
}

TEST(HardwareLifecycle, FailedRecoveryFinalizesComponent) {
  TwoSystems rig;
  rig.start({"left"});
  rig.hardware->refuse_recovery = true;
  rig.hardware->read_answer = HardwareReturn::error;
  rig.run(1);
  EXPECT_EQ(rig.view("FakeSystem").state, HardwareState::finalized);
  EXPECT_THAT(rig.view("FakeSystem").fault, HasSubstr("recovery failed: it is burnt"));
  EXPECT_FALSE(rig.manager->state_interfaces()[0].available);
}

TEST(HardwareLifecycle, DeactivateRequestKeepsComponentReadable) {
  TwoSystems rig;
  rig.start({"left", "right"});
  rig.run(1);
  rig.hardware->read_answer = HardwareReturn::deactivate;
  rig.run(1);
  EXPECT_EQ(rig.view("FakeSystem").state, HardwareState::inactive);
  EXPECT_THAT(rig.view("FakeSystem").fault, HasSubstr("deactivation in read"));
  EXPECT_EQ(rig.hardware->calls.back(), "on_deactivate");
  EXPECT_EQ(rig.state_of("left"), ControllerState::inactive);
  rig.hardware->read_answer = HardwareReturn::ok;
  const int reads = rig.hardware->reads;
  rig.run(3);
  EXPECT_EQ(rig.hardware->reads, reads + 3);
}

TEST(HardwareLifecycle, LostHardwareStartsFallbackControllers) {
  TwoSystems rig;
  rig.start({"left"});
  rig.manager->load("spare");
  ASSERT_TRUE(rig.manager->configure("spare").ok());
  rig.run(1);
  rig.hardware->read_answer = HardwareReturn::error;
  rig.run(1);
  EXPECT_EQ(rig.state_of("left"), ControllerState::inactive);
  EXPECT_EQ(rig.state_of("spare"), ControllerState::active);
  EXPECT_EQ(rig.count(Severity::warning, "'spare' replaces 'left'"), 1u) << rig.said();
}

TEST(HardwareLifecycle, StateThatIsNotFiniteIsReportedOncePerActivation) {
  ManagerRig rig(kOneGroup);
  rig.start({"left"});
  diagnostic_msgs::msg::DiagnosticArray last;
  Node listener(rig.bus, "/listener");
  listener.subscribe<diagnostic_msgs::msg::DiagnosticArray>("/diagnostics", [&](const auto& m) { last = m; });
  rig.run(101);
  EXPECT_EQ(last.status[1].message, "All hardware components are active");
  const std::string expected = "hardware 'FakeSystem' reads nan of 'a/position'";
  EXPECT_EQ(rig.count(Severity::warning, expected), 0u);
  rig.hardware->set_offset("a", std::nan(""));
  rig.run(101);
  EXPECT_EQ(rig.count(Severity::warning, expected), 1u) << rig.said();
  EXPECT_EQ(last.status[1].level, diagnostic_msgs::msg::DiagnosticStatus::WARN);
  EXPECT_EQ(last.status[1].message, "A joint's state is not finite");
  ASSERT_TRUE(rig.switch_to({}, {"left"}).ok());
  bring_hardware_to(rig, "inactive");
  rig.run(101);
  EXPECT_EQ(last.status[1].message, "Not all hardware components are active");
  bring_hardware_to(rig, "active");
  rig.run(101);
  EXPECT_EQ(rig.count(Severity::warning, expected), 2u) << rig.said();
  rig.hardware->set_offset("a", 0);
  rig.run(101);
  EXPECT_EQ(last.status[1].level, diagnostic_msgs::msg::DiagnosticStatus::OK);
}

TEST(HardwareLifecycle, FaultIsPublishedInDiagnosticsAndParameter) {
  TwoSystems rig;
  rig.start({"left", "right"});
  diagnostic_msgs::msg::DiagnosticArray last;
  Node listener(rig.bus, "/listener");
  listener.subscribe<diagnostic_msgs::msg::DiagnosticArray>("/diagnostics", [&](const auto& m) { last = m; });
  rig.run(101);
  ASSERT_EQ(last.status.size(), 3u);
  EXPECT_EQ(last.status[0].message, "All controllers are active");
  EXPECT_EQ(last.status[1].name, "controller_manager: Hardware Components Activity");
  EXPECT_EQ(last.status[1].message, "All hardware components are active");
  rig.hardware->read_answer = HardwareReturn::error;
  rig.run(101);
  EXPECT_EQ(last.status[1].level, diagnostic_msgs::msg::DiagnosticStatus::ERROR);
  ASSERT_EQ(last.status[1].values.size(), 3u);
  EXPECT_EQ(last.status[1].values[0].value, "unconfigured");
  EXPECT_EQ(last.status[1].values[1].key, "FakeSystem fault");
  EXPECT_THAT(last.status[1].values[1].value, HasSubstr("error in read: no reply"));
  std::string fault;
  rig.bus.each_node([&](Node& node) {
    if (node.name() != "/fakesystem") return;
    if (const auto* parameter = node.parameters().find("fault"))
      fault = std::get<std::string>(parameter->value);
  });
  EXPECT_THAT(fault, HasSubstr("error in read: no reply"));
}

TEST(HardwareLifecycle, UnusableFallbackIsReported) {
  TwoSystems rig;
  rig.start({"left"});
  rig.run(1);
  rig.hardware->read_answer = HardwareReturn::error;
  rig.run(1);
  EXPECT_EQ(rig.count(Severity::error,
                      "cannot activate the fallback controller 'spare' of 'left': no "
                      "controller 'spare' is loaded"),
            1u)
      << rig.said();
}

class Throwing : public Controller {
 public:
  void on_init(ControllerContext&) override {}
  [[nodiscard]] InterfaceConfiguration command_interfaces() const override {
    return {InterfaceConfiguration::Kind::individual, {"a/position"}};
  }
  [[nodiscard]] InterfaceConfiguration state_interfaces() const override { return {}; }
  void update(Time, Duration) override {
    if (++updates == 3) throw std::runtime_error("no solution");
  }
  int updates = 0;
};

TEST(HardwareLifecycle, ThrowingUpdateStartsFallback) {
  ManagerRig rig(R"(controller_manager:
  ros__parameters:
    left: {type: test/Throwing, fallback_controllers: [spare]}
    right: {type: position_controllers/JointGroupPositionController}
    spare: {type: position_controllers/JointGroupPositionController}
right: {ros__parameters: {joints: [b]}}
spare: {ros__parameters: {joints: [a]}}
)");
  rig.registry.add("test/Throwing", [] { return std::make_unique<Throwing>(); });
  rig.start({"left", "right"});
  rig.manager->load("spare");
  ASSERT_TRUE(rig.manager->configure("spare").ok());
  rig.run(2);
  EXPECT_EQ(rig.state_of("left"), ControllerState::active);
  rig.run(1);
  EXPECT_EQ(rig.state_of("left"), ControllerState::inactive);
  EXPECT_EQ(rig.state_of("right"), ControllerState::active);
  EXPECT_EQ(rig.state_of("spare"), ControllerState::active);
  EXPECT_EQ(rig.count(Severity::error, "'left' is deactivated: update() threw: no solution"), 1u)
      << rig.said();
}

TEST(HardwareLifecycle, SetStateReactivatesComponentAndClearsFault) {
  TwoSystems rig;
  rig.start({"left"});
  rig.hardware->read_answer = HardwareReturn::error;
  rig.run(1);
  rig.hardware->read_answer = HardwareReturn::ok;
  rig.hardware->calls.clear();
  EXPECT_TRUE(bring_hardware_to(rig, "active"));
  EXPECT_THAT(rig.hardware->calls, ElementsAre("on_configure", "on_activate"));
  EXPECT_EQ(rig.view("FakeSystem").state, HardwareState::active);
  EXPECT_THAT(rig.view("FakeSystem").fault, IsEmpty());
  EXPECT_TRUE(rig.switch_to({"left"}).ok());
}

TEST(HardwareLifecycle, ComponentRateIsRoundedWithWarning) {
  FakeHardwareOptions options;
  options.joints = {"a"};
  options.rw_rate = 30;
  ManagerRig rig("", {{"a"}}, options);
  EXPECT_EQ(rig.hardware->reads, 1);  // at activation
  rig.run(9);
  EXPECT_EQ(rig.hardware->reads, 1 + 3);
  EXPECT_EQ(rig.hardware->writes, 3);
  ASSERT_EQ(rig.diagnostics.all().size(), 1u);
  EXPECT_THAT(rig.diagnostics.all()[0].message,
              HasSubstr("is read and written every 3 ticks, at 33.3333 Hz"));
}

TEST(HardwareLifecycle, PluginNameLoadsComponentFromSharedLibrary) {
  ManagerRig rig("");
  load_plugin_library(DOPPEL_TEST_HARDWARE_PLUGIN, rig.registry, rig.hardware_types);
  const HardwareRegistry::Type* type = rig.hardware_types.find("test_plugin/Still");
  ASSERT_NE(type, nullptr);
  EXPECT_EQ(type->library, DOPPEL_TEST_HARDWARE_PLUGIN);
  EXPECT_EQ(type->kind, HardwareKind::real);
  HardwareDescription description;
  description.name = "Outside";
  description.plugin = "test_plugin/Still";
  description.joints.emplace_back().name = "c";
  EXPECT_TRUE(rig.manager->add_hardware(type->make(), description, rig.diagnostics));
  EXPECT_EQ(rig.manager->state("c/position"), 0.125);
  EXPECT_THAT(input_error_of([&] {
                load_plugin_library(DOPPEL_TEST_HARDWARE_PLUGIN, rig.registry, rig.hardware_types);
              }),
              HasSubstr("the hardware plugin 'test_plugin/Still' of"));
}

TEST(EmergencyStop, StopIsLatchedUntilReset) {
  TwoSystems rig;
  rig.start({"states", "left", "right"});
  rig.say<std_msgs::msg::Float64MultiArray>("/left/commands", {{}, {0.5}});
  rig.run(2);
  ASSERT_EQ(rig.hardware->position("a"), 0.5);
  rig.say<std_msgs::msg::Bool>("/controller_manager/emergency_stop", {true});
  EXPECT_TRUE(rig.manager->is_stopped());
  EXPECT_EQ(rig.hardware->calls.back(), "on_stop");
  EXPECT_EQ(rig.other->calls.back(), "on_stop");
  EXPECT_EQ(rig.state_of("left"), ControllerState::inactive);
  EXPECT_EQ(rig.state_of("right"), ControllerState::inactive);
  EXPECT_EQ(rig.state_of("states"), ControllerState::active);
  const int reads = rig.hardware->reads, writes = rig.hardware->writes;
  rig.run(3);
  EXPECT_EQ(rig.hardware->reads, reads + 3);
  EXPECT_EQ(rig.hardware->writes, writes);
  EXPECT_THAT(rig.manager->switch_controllers(Names{"left"}, Names{}, Strictness::best_effort).why(),
              HasSubstr("the emergency stop is on"));
  rig.say<std_msgs::msg::Bool>("/controller_manager/emergency_stop", {false});
  EXPECT_TRUE(rig.manager->is_stopped());  // latched: only the service resets it

  ASSERT_TRUE(rig.manager->reset_stop().ok());
  EXPECT_EQ(rig.hardware->calls.back(), "on_stop_reset");
  EXPECT_EQ(rig.state_of("left"), ControllerState::active);
  EXPECT_EQ(rig.state_of("right"), ControllerState::active);
  rig.run(1);
  EXPECT_TRUE(std::isnan(rig.manager->command("a/position")));  // the command from before is not resumed
}

TEST(EmergencyStop, ResetForgetsCommandOfControllerThatEndedBefore) {
  CommandedRig rig;
  rig.run(2);
  rig.manager->stop("the test");
  ASSERT_TRUE(rig.manager->reset_stop().ok());
  rig.run(1);
  EXPECT_TRUE(std::isnan(rig.hardware->last_command("a/position")));
}

TEST(HardwareLifecycle, ActivationForgetsCommandFromBefore) {
  CommandedRig rig;
  for (const char* label : {"inactive", "active"}) EXPECT_TRUE(bring_hardware_to(rig, label));
  EXPECT_EQ(rig.hardware->calls.back(), "on_activate");
  EXPECT_TRUE(std::isnan(rig.hardware->last_command("a/position")));
}

TEST(EmergencyStop, HardwareActivatedDuringStopIsHeld) {
  ManagerRig rig(
      "controller_manager: {ros__parameters: {hardware_components_initial_state: {inactive: "
      "[FakeSystem]}}}");
  rig.manager->stop("the test");
  EXPECT_THAT(rig.hardware->calls, ElementsAre("on_init", "on_configure"));
  bring_hardware_to(rig, "active");
  EXPECT_EQ(rig.hardware->calls.back(), "on_stop");
}

TEST(EmergencyStop, ThrowingHardwareBecomesErrorAndOthersStop) {
  TwoSystems rig;
  rig.start({"left", "right"});
  rig.hardware->throw_in = "on_stop";
  rig.manager->stop("the test");
  EXPECT_EQ(rig.view("FakeSystem").state, HardwareState::unconfigured);
  EXPECT_EQ(rig.other->calls.back(), "on_stop");
  EXPECT_EQ(rig.state_of("left"), ControllerState::inactive);
}

}  // namespace
}  // namespace doppel
