#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "doppel/control/manager/joint_list.h"
#include "doppel/control/manager/plugin_library.h"
#include "doppel/control/manager/test/manager_rig.h"

namespace doppel {
namespace {

using testing::AnyOf;
using testing::ElementsAre;
using testing::HasSubstr;
using Names = std::vector<std::string>;

constexpr const char* kTwoGroups = R"(
controller_manager:
  ros__parameters:
    update_rate: 100
    left: {type: position_controllers/JointGroupPositionController}
    both: {type: position_controllers/JointGroupPositionController}
    states: {type: joint_state_broadcaster/JointStateBroadcaster}
left:
  ros__parameters:
    joints: [a]
both:
  ros__parameters:
    joints: [a, b]
)";

// Records its updates; fails its activation if requested.
class Probe : public Controller {
 public:
  struct Call {
    std::string who;
    Time now;
    Duration period;
  };
  Probe(std::vector<Call>& calls, const bool& refuses) : calls_(calls), refuses_(refuses) {}
  void on_init(ControllerContext& context) override {
    name_ = context.name;
    rate_ = context.update_rate;
    joint_ = declare<std::string>(context.node->parameters(), context.overrides, "joint", "");
  }
  [[nodiscard]] InterfaceConfiguration command_interfaces() const override {
    if (joint_.empty()) return {};
    return {InterfaceConfiguration::Kind::individual, {joint_ + "/position"}};
  }
  [[nodiscard]] InterfaceConfiguration state_interfaces() const override { return {}; }
  Status on_activate() override { return refuses_ ? Status::refused("not today") : Status{}; }
  void update(Time now, Duration period) override { calls_.push_back({name_, now, period}); }

 private:
  std::vector<Call>& calls_;
  const bool& refuses_;
  std::string name_, joint_;
  double rate_ = 0;
};

struct ProbeRig : ManagerRig {
  explicit ProbeRig(const std::string& yaml) : ManagerRig(yaml) {
    registry.add("test/Probe", [this] { return std::make_unique<Probe>(calls, refuses); });
  }
  std::vector<Probe::Call> calls;
  bool refuses = false;
};

void make_inactive(ManagerRig& rig, const Names& names) {
  for (const std::string& name : names) {
    rig.manager->load(name);
    ASSERT_TRUE(rig.manager->configure(name).ok());
  }
}

TEST(ControllerManager, ClaimsAreExclusive) {
  ManagerRig rig(kTwoGroups);
  make_inactive(rig, {"left", "both"});
  EXPECT_TRUE(rig.switch_to({"left"}).ok());
  const Status refused = rig.switch_to({"both"});
  EXPECT_EQ(refused.why(),
            "'both' claims the command interface 'a/position', which is claimed by 'left'; deactivate 'left' "
            "first");
  EXPECT_EQ(rig.manager->command_interfaces()[0].claimed_by, "left");
  EXPECT_EQ(rig.manager->command_interfaces()[1].claimed_by, "");
  EXPECT_FALSE(rig.hardware->claimed("b/position"));

  EXPECT_TRUE(rig.switch_to({"both"}, {"left"}).ok());
  EXPECT_EQ(rig.manager->command_interfaces()[0].claimed_by, "both");
  EXPECT_EQ(rig.state_of("left"), ControllerState::inactive);
  EXPECT_TRUE(rig.hardware->claimed("a/position"));
  EXPECT_TRUE(rig.hardware->claimed("b/position"));
}

TEST(ControllerManager, StrictRefusesAllAndBestEffortSwitchesPart) {
  ManagerRig rig(kTwoGroups);
  make_inactive(rig, {"left", "both", "states"});
  for (const Names& impossible :
       {Names{"states", "nobody"}, Names{"left", "both"}, Names{"states", "states "}}) {
    EXPECT_FALSE(rig.switch_to(impossible).ok());
    EXPECT_EQ(rig.state_of("states"), ControllerState::inactive);
    EXPECT_EQ(rig.state_of("left"), ControllerState::inactive);
  }
  EXPECT_TRUE(rig.hardware->switches.empty());
  EXPECT_FALSE(rig.switch_to({}, {"left"}).ok());

  EXPECT_TRUE(
      rig.manager->switch_controllers(Names{"states", "lefd", "left"}, Names{}, Strictness::best_effort)
          .ok());
  EXPECT_EQ(rig.state_of("states"), ControllerState::active);
  EXPECT_EQ(rig.state_of("left"), ControllerState::active);
  EXPECT_EQ(rig.count(Severity::warning, "did you mean 'left'?"), 1u) << rig.said();
  // Best effort accepts what is already the case; it fails if nothing at all can be switched.
  EXPECT_TRUE(rig.manager->switch_controllers(Names{"left"}, Names{}, Strictness::best_effort).ok());
  EXPECT_FALSE(rig.switch_to({"left"}).ok());
  EXPECT_FALSE(rig.manager->switch_controllers(Names{"nobody"}, Names{}, Strictness::best_effort).ok());
}

// As in ros2_control: best effort leaves out names, never a claim, because what stops would leave the arm
// passive.
TEST(ControllerManager, FailedActivationStopsNoOtherController) {
  ManagerRig rig(kTwoGroups);
  make_inactive(rig, {"left", "both", "states"});
  ASSERT_TRUE(rig.switch_to({"left", "states"}).ok());
  const Status refused =
      rig.manager->switch_controllers(Names{"both"}, Names{"states"}, Strictness::best_effort);
  EXPECT_EQ(refused.why(),
            "'both' claims the command interface 'a/position', which is claimed by 'left'; deactivate 'left' "
            "first");
  EXPECT_EQ(rig.state_of("states"), ControllerState::active);
  EXPECT_EQ(rig.state_of("left"), ControllerState::active);
  EXPECT_EQ(rig.state_of("both"), ControllerState::inactive);
  EXPECT_THAT(rig.manager->switch_controllers(Names{"bothh"}, Names{"left"}, Strictness::best_effort).why(),
              HasSubstr("did you mean 'both'?"));
  EXPECT_EQ(rig.state_of("left"), ControllerState::active);
}

TEST(ControllerManager, FailedStrictSwitchIsRolledBack) {
  ProbeRig rig(R"(
controller_manager:
  ros__parameters:
    left: {type: position_controllers/JointGroupPositionController}
    probe: {type: test/Probe}
left: {ros__parameters: {joints: [a]}}
probe: {ros__parameters: {joint: a}}
)");
  make_inactive(rig, {"left", "probe"});
  ASSERT_TRUE(rig.switch_to({"left"}).ok());
  rig.refuses = true;
  const Status status = rig.switch_to({"probe"}, {"left"});
  EXPECT_THAT(status.why(), HasSubstr("not today"));
  EXPECT_EQ(rig.state_of("left"), ControllerState::active);
  EXPECT_EQ(rig.state_of("probe"), ControllerState::inactive);
  EXPECT_TRUE(rig.hardware->claimed("a/position"));
  EXPECT_EQ(rig.manager->command_interfaces()[0].claimed_by, "left");

  EXPECT_TRUE(rig.manager->switch_controllers(Names{"probe"}, Names{"left"}, Strictness::best_effort).ok());
  EXPECT_EQ(rig.state_of("left"), ControllerState::inactive);
  EXPECT_FALSE(rig.hardware->claimed("a/position"));  // passive and unclaimed
}

TEST(ControllerManager, HardwareRefusalFailsSwitch) {
  ManagerRig rig(kTwoGroups);
  make_inactive(rig, {"left"});
  rig.hardware->refuse_switch = "servo 3 is hot";
  const Status status = rig.manager->switch_controllers(Names{"left"}, Names{}, Strictness::best_effort);
  EXPECT_THAT(status.why(), HasSubstr("servo 3 is hot"));
  EXPECT_EQ(rig.state_of("left"), ControllerState::inactive);
}

TEST(ControllerManager, InvalidTransitionsAreRefused) {
  ManagerRig rig(kTwoGroups);
  rig.manager->load("left");
  EXPECT_THAT(rig.switch_to({"left"}).why(), HasSubstr("not configured"));
  EXPECT_TRUE(rig.manager->configure("left").ok());
  EXPECT_TRUE(rig.switch_to({"left"}).ok());
  EXPECT_FALSE(rig.manager->configure("left").ok());
  EXPECT_FALSE(rig.manager->unload("left").ok());
  EXPECT_TRUE(rig.switch_to({}, {"left"}).ok());
  EXPECT_TRUE(rig.manager->unload("left").ok());
  EXPECT_TRUE(rig.manager->controllers().empty());
  rig.manager->load("left");  // its node's names are free again
  EXPECT_THAT(input_error_of([&] { rig.manager->load("left"); }), HasSubstr("already loaded"));
  EXPECT_THAT(input_error_of([&] { rig.manager->load("lefft"); }), HasSubstr("did you mean 'left'?"));
}

// Whatever its life cycle throws, of any type.
struct ThrowsIn : Controller {
  explicit ThrowsIn(std::string the_transition) : transition(std::move(the_transition)) {}
  void on_init(ControllerContext&) override {}
  Status on_configure() override { return thrown_in("configure"); }
  Status on_activate() override { return thrown_in("activate"); }
  Status on_deactivate() override { return thrown_in("deactivate"); }
  Status on_cleanup() override { return thrown_in("cleanup"); }
  [[nodiscard]] InterfaceConfiguration command_interfaces() const override { return {}; }
  [[nodiscard]] InterfaceConfiguration state_interfaces() const override { return {}; }
  void update(Time, Duration) override {}
  Status thrown_in(const std::string& now) const {
    if (now == transition) throw 42;  // NOLINT: no std::exception
    return {};
  }
  std::string transition;
};

TEST(ControllerManager, ThrowingTransitionIsRefusedAndManagerKeepsRunning) {
  for (const std::string transition : {"configure", "activate", "deactivate", "cleanup"}) {
    SCOPED_TRACE(transition);
    ManagerRig rig("");
    rig.registry.add("test/ThrowsIn", [&] { return std::make_unique<ThrowsIn>(transition); });
    rig.manager->load("t", "test/ThrowsIn");
    const std::vector<std::string> names{"t"};
    EXPECT_EQ(rig.manager->configure("t").ok(), transition != "configure");
    if (transition == "configure") continue;
    EXPECT_EQ(rig.switch_to(names).ok(), transition != "activate");
    if (transition == "activate") continue;
    EXPECT_TRUE(rig.switch_to({}, names).ok()) << "expected it to stop nevertheless";
    EXPECT_EQ(rig.manager->configure("t").ok(), transition != "cleanup")
        << "expected configure to clean up first";
  }
}

TEST(ControllerManager, ThrowingControllerIsReportedAndNotLoaded) {
  ManagerRig rig("");
  struct Thrower : Controller {
    void on_init(ControllerContext&) override { throw std::runtime_error("no such file"); }
    [[nodiscard]] InterfaceConfiguration command_interfaces() const override { return {}; }
    [[nodiscard]] InterfaceConfiguration state_interfaces() const override { return {}; }
    void update(Time, Duration) override {}
  };
  rig.registry.add("test/Thrower", [] { return std::make_unique<Thrower>(); });
  EXPECT_THAT(input_error_of([&] { rig.manager->load("t", "test/Thrower"); }),
              HasSubstr("cannot initialise 't': no such file"));
  EXPECT_TRUE(rig.manager->controllers().empty());
  EXPECT_THAT(input_error_of([&] { rig.manager->load("controller_manager", "test/Thrower"); }),
              HasSubstr("needs a node name of its own"));
}

TEST(ControllerManager, UnknownTypeIsReportedWithNearestAndPlace) {
  ManagerRig rig(
      "controller_manager:\n  ros__parameters:\n    jsb:\n"
      "      type: joint_state_broadcaster/JointStateBroadcastr\n");
  const std::string error = input_error_of([&] { rig.manager->load("jsb"); });
  EXPECT_THAT(error, HasSubstr("test.yaml:4:13: error: there is no controller type"));
  EXPECT_THAT(error, HasSubstr("did you mean 'joint_state_broadcaster/JointStateBroadcaster'?"));
  EXPECT_TRUE(rig.manager->controllers().empty());
}

TEST(ControllerManager, UnknownJointIsErrorWithPlace) {
  ManagerRig rig(R"(controller_manager:
  ros__parameters:
    arm:
      type: position_controllers/JointGroupPositionController
arm:
  ros__parameters:
    joints:
      - Revolute 1
      - Revolut 2
)",
                 {{"Revolute 1"}, {"Revolute 2"}});
  const std::string error = input_error_of([&] { rig.manager->load("arm"); });
  EXPECT_THAT(error, HasSubstr("test.yaml:9:9: error: controller 'arm' lists joint 'Revolut 2', which the "
                               "robot 'fake' does not have; did you mean 'Revolute 2'?"));
  EXPECT_TRUE(rig.manager->controllers().empty());
  EXPECT_THAT(rig.bus.nodes(), testing::Not(testing::Contains("/arm")));
}

TEST(ControllerManager, FixedAndRepeatedJointsAreErrors) {
  const std::vector<FakeJoint> joints = {{"a"}, {"flange", JointType::fixed}};
  const auto error_for = [&](const std::string& list) {
    ManagerRig rig(
        "controller_manager: {ros__parameters: {g: {type: "
        "position_controllers/JointGroupPositionController}}}\ng: {ros__parameters: {joints: " +
            list + "}}",
        joints);
    return input_error_of([&] { rig.manager->load("g"); });
  };
  EXPECT_THAT(error_for("[a, flange]"), HasSubstr("'flange', which is fixed"));
  EXPECT_THAT(error_for("[a, a]"), HasSubstr("lists joint 'a' twice"));
  EXPECT_THAT(error_for("[]"), HasSubstr("commands nothing"));
}

TEST(ControllerManager, MimicJointsAreDroppedWithWarning) {
  ManagerRig rig(R"(controller_manager:
  ros__parameters:
    gripper: {type: position_controllers/JointGroupPositionController}
gripper:
  ros__parameters:
    joints: [a, finger]
)",
                 {{"a"}, {.name = "finger", .mimics = "a"}});
  rig.start({"gripper"});
  EXPECT_EQ(rig.count(Severity::warning, "test.yaml:6:17: joint 'finger' mimics 'a'"), 1u) << rig.said();
  EXPECT_THAT(rig.manager->controllers()[0].claimed, ElementsAre("a/position"));
}

TEST(ControllerManager, UpdateRateIsRoundedToLoopPeriod) {
  const ManagerRig exact("controller_manager: {ros__parameters: {update_rate: 225}}");
  EXPECT_EQ(exact.manager->period(), from_seconds(1.0 / 225));
  EXPECT_TRUE(exact.diagnostics.all().empty());
  double asked = 0;
  SourceLocation place;
  ControllerManagerOptions options;
  options.choose_period = [&](double rate, const SourceLocation& where, Diagnostics&) {
    asked = rate;
    place = where;
    return Duration(4'000'000);
  };
  const ManagerRig rounded("controller_manager:\n  ros__parameters:\n    update_rate: 225\n", {{"a"}}, {},
                           options);
  EXPECT_EQ(asked, 225.0);
  EXPECT_EQ(place.place(), "test.yaml:3:18");
  EXPECT_EQ(rounded.manager->period(), Duration(4'000'000));
  EXPECT_THAT(input_error_of([] { ManagerRig("controller_manager: {ros__parameters: {update_rate: 0}}"); }),
              HasSubstr("above 0 Hz"));
}

TEST(ControllerManager, ControllersKeepRateAndOrder) {
  ProbeRig rig(R"(
controller_manager:
  ros__parameters:
    update_rate: 100
    z_first: {type: test/Probe}
    slow: {type: test/Probe}
    odd: {type: test/Probe}
slow: {ros__parameters: {update_rate: 25}}
odd: {ros__parameters: {update_rate: 30}}
)");
  rig.start({"z_first", "slow", "odd"});
  EXPECT_EQ(rig.count(Severity::warning,
                      "30 Hz does not divide the controller manager's 100 Hz; 'odd' is updated every 3 "
                      "ticks, at 33.3333 Hz"),
            1u)
      << rig.said();
  rig.run(12);
  std::string order;
  for (const auto& call : rig.calls) order += call.who[0];
  EXPECT_EQ(order,
            "zso"
            "z"
            "z"
            "zo"
            "zs"
            "z"
            "zo"
            "z"
            "zs"
            "zo"
            "z"
            "z");
  for (const auto& call : rig.calls) {
    EXPECT_EQ(call.period, call.who == "slow"  ? Duration(40'000'000)
                           : call.who == "odd" ? Duration(30'000'000)
                                               : Duration(10'000'000));
  }
  EXPECT_EQ(rig.manager->controllers()[1].update_rate, 25.0);
}

TEST(ControllerManager, DoubleClaimAtStartIsReportedWithBothPlaces) {
  ManagerRig rig(kTwoGroups);
  const std::string error = input_error_of([&] { rig.start({"states", "left", "both"}); });
  EXPECT_THAT(error, HasSubstr("test.yaml:13:14: error: 'both' and 'left' both claim the command interface "
                               "'a/position' at test.yaml:10:14"));
  EXPECT_TRUE(rig.manager->controllers().empty());
  EXPECT_TRUE(rig.hardware->switches.empty());
}

TEST(ControllerManager, MissingInterfaceAtStartIsReportedWithPlace) {
  FakeHardwareOptions options;
  options.joints = {"a"};
  ManagerRig rig(kTwoGroups, {{"a"}, {"b"}}, options);
  const std::string error = input_error_of([&] { rig.start({"both"}); });
  EXPECT_THAT(error, HasSubstr("test.yaml:13:17: error: 'both' requires the command interface 'b/position', "
                               "which no hardware exports"));
}

TEST(ControllerManager, StartCollectsErrorsOfAllControllers) {
  ManagerRig rig(R"(
controller_manager:
  ros__parameters:
    one: {type: position_controllers/JointGroupPositionController}
    two: {type: position_controllers/JointGroupPositionController}
one: {ros__parameters: {joints: [x]}}
two: {ros__parameters: {joints: [z]}}
)");
  const std::string error = input_error_of([&] { rig.start({"one", "two"}); });
  EXPECT_THAT(error, HasSubstr("'x'"));
  EXPECT_THAT(error, HasSubstr("'z'"));
}

TEST(ControllerManager, YamlTyposAreReported) {
  ManagerRig rig(R"(
controller_manager:
  ros__parameters:
    updaterate: 50
    left: {type: position_controllers/JointGroupPositionController}
    other: {type: joint_state_broadcaster/JointStateBroadcaster}
left: {ros__parameters: {joints: [a], jointss: [b]}}
othr: {ros__parameters: {use_local_topics: true}}
)");
  ASSERT_EQ(rig.diagnostics.all().size(), 2u);
  EXPECT_THAT(
      rig.diagnostics.all()[0].str(),
      HasSubstr("no parameter 'updaterate', so this value has no effect; did you mean 'update_rate'?"));
  EXPECT_THAT(rig.diagnostics.all()[1].str(),
              HasSubstr("the section 'othr' belongs to no controller; did you mean 'other'?"));
  rig.manager->load("left");
  EXPECT_EQ(rig.count(Severity::warning, "'left' has no parameter 'jointss'"), 1u) << rig.said();
}

TEST(ControllerManager, DeclaredControllersKeepFileOrder) {
  ManagerRig rig(kTwoGroups);
  const auto declared = rig.manager->declared_controllers();
  ASSERT_EQ(declared.size(), 3u);
  EXPECT_EQ(declared[0].first, "left");
  EXPECT_EQ(declared[2].second, "joint_state_broadcaster/JointStateBroadcaster");
}

TEST(ControllerManager, TypeInControllersOwnSectionDeclaresIt) {
  ManagerRig rig(
      "controller_manager: {ros__parameters: {update_rate: 100, first: {type: "
      "joint_state_broadcaster/JointStateBroadcaster}}}\n"
      "second: {ros__parameters: {type: velocity_controllers/JointGroupVelocityController, joints: [a]}}\n"
      "planner: {ros__parameters: {type: NavFn}}\n");
  const auto declared = rig.manager->declared_controllers();
  ASSERT_EQ(declared.size(), 2U);
  EXPECT_EQ(declared[1].first, "second");
  EXPECT_EQ(declared[1].second, "velocity_controllers/JointGroupVelocityController");
  rig.manager->load("second");
  EXPECT_EQ(rig.state_of("second"), ControllerState::unconfigured);
}

TEST(ControllerManager, RelativeParamsFileIsFound) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "doppel_params_file";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "left.yaml") << "left:\n  ros__parameters:\n    joints: [b]\n";
  std::ofstream(folder / "main.yaml") << "controller_manager:\n  ros__parameters:\n    left:\n"
                                         "      type: position_controllers/JointGroupPositionController\n"
                                         "      params_file: left.yaml\n";
  ManagerRig rig("");
  const ParameterFile file = ParameterFile::load(folder / "main.yaml");
  Bus bus;
  ControllerManager manager(bus, rig.model, rig.registry, &file, {}, rig.log, rig.diagnostics);
  FakeHardwareOptions options;
  options.joints = {"a", "b"};
  auto fake = std::make_unique<FakeHardware>(options);
  const HardwareDescription description = fake->description();
  EXPECT_TRUE(manager.add_hardware(std::move(fake), description, rig.diagnostics));
  manager.start(Names{"left"});
  EXPECT_THAT(manager.controllers()[0].claimed, ElementsAre("b/position"));
  EXPECT_TRUE(rig.diagnostics.all().empty());
}

TEST(ControllerManager, TypeParameterOfControllerIsNoTypo) {
  ManagerRig rig(
      "controller_manager: {ros__parameters: {g: {type: position_controllers/JointGroupPositionController,\n"
      "  node_options_args: [-r, '~/commands:=/wanted']}}}\n"
      "g: {ros__parameters: {type: position_controllers/JointGroupPositionController, joints: [a]}}");
  rig.start({"g"});
  EXPECT_EQ(rig.said(), "");
  EXPECT_TRUE(rig.diagnostics.all().empty());
  bool renamed = false;
  for (const TopicInfo& topic : rig.bus.topics()) renamed = renamed || topic.name == "/wanted";
  EXPECT_TRUE(renamed);
  ManagerRig other(
      "controller_manager: {ros__parameters: {g: {type: "
      "position_controllers/JointGroupPositionController}}}\n"
      "g: {ros__parameters: {type: a/B, joints: [a]}}");
  other.start({"g"});
  EXPECT_EQ(other.count(Severity::warning, "the type 'a/B' has no effect here"), 1u) << other.said();
}

TEST(ControllerManager, RestartReclaimsAndClearsCommands) {
  ProbeRig rig(kTwoGroups);
  rig.start({"left"});
  rig.hardware->switches.clear();
  rig.manager->restart(Time{});
  EXPECT_EQ(rig.state_of("left"), ControllerState::active);
  EXPECT_THAT(rig.hardware->switches, ElementsAre("-a/position", "+a/position"));
  EXPECT_TRUE(std::isnan(rig.manager->command("a/position")));
}

TEST(ControllerManager, SharedLibraryRegistersControllers) {
  ManagerRig rig(
      "controller_manager: {ros__parameters: {c: {type: test_plugin/Constant}}}\nc: {ros__parameters: "
      "{value: 0.5}}");
  load_plugin_library(DOPPEL_TEST_CONTROLLER_PLUGIN, rig.registry, rig.hardware_types);
  EXPECT_EQ(rig.registry.find("test_plugin/Constant")->library, DOPPEL_TEST_CONTROLLER_PLUGIN);
  rig.start({"c"});
  rig.run(2);
  EXPECT_EQ(rig.hardware->position("a"), 0.5);
  EXPECT_THAT(input_error_of([&] {
                load_plugin_library(DOPPEL_TEST_CONTROLLER_PLUGIN, rig.registry, rig.hardware_types);
              }),
              HasSubstr("already registered"));
  EXPECT_THAT(input_error_of(
                  [&] { load_plugin_library(DOPPEL_TEST_EMPTY_PLUGIN, rig.registry, rig.hardware_types); }),
              HasSubstr("exports no controller"));
  EXPECT_THAT(
      input_error_of([&] { load_plugin_library("/nowhere/lib.so", rig.registry, rig.hardware_types); }),
      HasSubstr("check the path"));
}

}  // namespace
}  // namespace doppel
