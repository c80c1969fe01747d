#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "doppel/control/manager/test/manager_rig.h"
#include "doppel/ros/bus/parameter_services.h"
#include "doppel/ros/messages/controller_manager_msgs.h"
#include "doppel/ros/messages/rcl_interfaces.h"

namespace doppel {
namespace {

namespace srv = controller_manager_msgs::srv;
using Names = std::vector<std::string>;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr const char* kYaml = R"(
controller_manager:
  ros__parameters:
    states: {type: joint_state_broadcaster/JointStateBroadcaster}
    group: {type: position_controllers/JointGroupPositionController}
    wrong: {type: position_controllers/JointGroupPositionController}
group: {ros__parameters: {joints: [a]}}
wrong: {ros__parameters: {joints: [nothing]}}
)";

struct ServiceRig : ManagerRig {
  explicit ServiceRig(const char* yaml = kYaml) : ManagerRig(yaml) { edge = bus.attach("test"); }

  template <class S>
  typename S::Response call(const std::string& service, const typename S::Request& request) {
    return ManagerRig::call<S>("/controller_manager/" + service, request);
  }
  bool make_inactive(const std::string& name) {
    return call<srv::LoadController>("load_controller", {name}).ok &&
           call<srv::ConfigureController>("configure_controller", {name}).ok;
  }
  // Like ros2_control's spawner before it loads.
  bool set(const std::string& parameter, const ParameterValue& value) {
    return call<rcl_interfaces::srv::SetParameters>("set_parameters", {{{parameter, to_msg(value)}}})
        .results.at(0)
        .successful;
  }
  bool load(const std::string& name) { return call<srv::LoadController>("load_controller", {name}).ok; }
  std::string value(const std::string& its_node, const std::string& name) {
    std::string found = "none";
    edge->get_parameters([&](const Edge::SharedParameters& values) {
      const std::vector<NamedParameter>& all = *values;
      for (const auto& p : all) {
        if (p.node == its_node && p.name == name) found = to_string(p.value);
      }
    });
    bus.spin();
    return found;
  }
};

// A parameter file of a spawner; its absolute path.
std::string file_with(const std::string& name, const std::string& yaml) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "doppel_spawner";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / name) << yaml;
  return (folder / name).string();
}

constexpr const char* kGroupType = "position_controllers/JointGroupPositionController";

// As in Jazzy: best effort leaves out what cannot be switched, and reports if that is everything.
TEST(ManagerServices, EmptyBestEffortSwitchIsOkWithMessage) {
  ServiceRig rig;
  srv::SwitchController::Request request;
  request.strictness = srv::SwitchController::Request::BEST_EFFORT;
  const auto expect_nothing_to_do = [&](std::vector<std::string> activate) {
    request.activate_controllers = std::move(activate);
    const auto answer = rig.call<srv::SwitchController>("switch_controller", request);
    EXPECT_TRUE(answer.ok);
    EXPECT_EQ(answer.message,
              "After checking the controllers, no controllers need to be activated or deactivated.");
  };
  ASSERT_TRUE(rig.load("group"));
  expect_nothing_to_do({"group"});
  EXPECT_EQ(rig.state_of("group"), ControllerState::unconfigured);
  ASSERT_TRUE(rig.call<srv::ConfigureController>("configure_controller", {"group"}).ok);
  request.activate_controllers = {"group"};
  EXPECT_EQ(rig.call<srv::SwitchController>("switch_controller", request).message,
            "Successfully switched controllers!");
  expect_nothing_to_do({"group"});
  expect_nothing_to_do({"group", "nobody"});
  EXPECT_EQ(rig.state_of("group"), ControllerState::active);
  request.activate_controllers = {"nobody"};
  EXPECT_FALSE(rig.call<srv::SwitchController>("switch_controller", request).ok);
}

TEST(ManagerServices, ControllerLifecycleByServices) {
  ServiceRig rig;
  ASSERT_TRUE(rig.make_inactive("group"));
  srv::SwitchController::Request request;
  request.activate_controllers = {"group"};
  request.strictness = srv::SwitchController::Request::STRICT;
  EXPECT_TRUE(rig.call<srv::SwitchController>("switch_controller", request).ok);

  const auto list = rig.call<srv::ListControllers>("list_controllers", {}).controller;
  ASSERT_EQ(list.size(), 1u);
  EXPECT_EQ(list[0].state, "active");
  EXPECT_EQ(list[0].type, "position_controllers/JointGroupPositionController");
  EXPECT_EQ(list[0].update_rate, 100);
  EXPECT_THAT(list[0].claimed_interfaces, ElementsAre("a/position"));

  const auto interfaces = rig.call<srv::ListHardwareInterfaces>("list_hardware_interfaces", {});
  ASSERT_EQ(interfaces.command_interfaces.size(), 2u);
  EXPECT_TRUE(interfaces.command_interfaces[0].is_claimed);
  EXPECT_TRUE(interfaces.command_interfaces[0].is_available);
  EXPECT_FALSE(interfaces.command_interfaces[1].is_claimed);
  EXPECT_EQ(interfaces.state_interfaces.size(), 4u);

  EXPECT_FALSE(rig.call<srv::UnloadController>("unload_controller", {"group"}).ok);
  const auto again = rig.call<srv::SwitchController>("switch_controller", request);
  EXPECT_FALSE(again.ok);
  EXPECT_THAT(again.message, HasSubstr("already active"));
  std::swap(request.activate_controllers, request.deactivate_controllers);
  EXPECT_TRUE(rig.call<srv::SwitchController>("switch_controller", request).ok);
  EXPECT_TRUE(rig.call<srv::CleanupController>("cleanup_controller", {"group"}).ok);
  EXPECT_EQ(rig.state_of("group"), ControllerState::unconfigured);
  EXPECT_TRUE(rig.call<srv::UnloadController>("unload_controller", {"group"}).ok);
  EXPECT_TRUE(rig.call<srv::ListControllers>("list_controllers", {}).controller.empty());
}

TEST(ManagerServices, FailuresAreLoggedAndNotThrown) {
  ServiceRig rig;
  EXPECT_FALSE(rig.call<srv::LoadController>("load_controller", {"wrong"}).ok);
  EXPECT_EQ(rig.count(Severity::error, "joint 'nothing'"), 1u) << rig.said();
  EXPECT_FALSE(rig.call<srv::LoadController>("load_controller", {"grup"}).ok);
  EXPECT_EQ(rig.count(Severity::error, "did you mean 'group'?"), 1u) << rig.said();
  EXPECT_FALSE(rig.call<srv::ConfigureController>("configure_controller", {"nobody"}).ok);
  EXPECT_FALSE(rig.call<srv::UnloadController>("unload_controller", {"nobody"}).ok);
  EXPECT_FALSE(rig.call<srv::CleanupController>("cleanup_controller", {""}).ok);
  EXPECT_FALSE(rig.call<srv::LoadController>("load_controller", {"/a/b"}).ok);
}

TEST(ManagerServices, ListTypesReturnsRegisteredTypes) {
  ServiceRig rig;
  const auto types = rig.call<srv::ListControllerTypes>("list_controller_types", {});
  EXPECT_THAT(types.types,
              testing::IsSupersetOf({"joint_state_broadcaster/JointStateBroadcaster",
                                     "joint_trajectory_controller/JointTrajectoryController",
                                     "forward_command_controller/ForwardCommandController",
                                     "forward_command_controller/MultiInterfaceForwardCommandController",
                                     "position_controllers/JointGroupPositionController",
                                     "velocity_controllers/JointGroupVelocityController",
                                     "effort_controllers/JointGroupEffortController",
                                     "pid_controller/PidController"}));
  EXPECT_EQ(types.types.size(), types.base_classes.size());
}

TEST(ManagerServices, ClaimedHardwareCannotBeDeactivated) {
  ServiceRig rig;
  ASSERT_TRUE(rig.make_inactive("group"));
  srv::SwitchController::Request request;
  request.activate_controllers = {"group"};
  ASSERT_TRUE(rig.call<srv::SwitchController>("switch_controller", request).ok);
  srv::SetHardwareComponentState::Request sleep;
  sleep.name = "FakeSystem";
  sleep.target_state.label = "inactive";
  EXPECT_FALSE(rig.call<srv::SetHardwareComponentState>("set_hardware_component_state", sleep).ok);
  EXPECT_EQ(rig.count(Severity::error, "the controller 'group' uses hardware 'FakeSystem'"), 1u)
      << rig.said();
  std::swap(request.activate_controllers, request.deactivate_controllers);
  ASSERT_TRUE(rig.call<srv::SwitchController>("switch_controller", request).ok);
  const auto asleep = rig.call<srv::SetHardwareComponentState>("set_hardware_component_state", sleep);
  EXPECT_TRUE(asleep.ok);
  EXPECT_EQ(asleep.state.label, "inactive");
  EXPECT_FALSE(rig.hardware->active);
  const int writes = rig.hardware->writes;
  rig.run(3);
  EXPECT_EQ(rig.hardware->writes, writes);

  std::swap(request.activate_controllers, request.deactivate_controllers);
  const auto refused = rig.call<srv::SwitchController>("switch_controller", request);
  EXPECT_THAT(refused.message, HasSubstr("its hardware 'FakeSystem' is inactive"));
  const auto components = rig.call<srv::ListHardwareComponents>("list_hardware_components", {}).component;
  ASSERT_EQ(components.size(), 1u);
  EXPECT_EQ(components[0].state.id, lifecycle_msgs::msg::State::PRIMARY_STATE_INACTIVE);
  EXPECT_TRUE(components[0].command_interfaces[0].is_available);
  EXPECT_TRUE(components[0].state_interfaces[0].is_available);
  sleep.target_state = {lifecycle_msgs::msg::State::PRIMARY_STATE_ACTIVE, ""};
  EXPECT_TRUE(rig.call<srv::SetHardwareComponentState>("set_hardware_component_state", sleep).ok);
  sleep.target_state = {lifecycle_msgs::msg::State::PRIMARY_STATE_UNKNOWN, ""};
  EXPECT_FALSE(rig.call<srv::SetHardwareComponentState>("set_hardware_component_state", sleep).ok);
  sleep.target_state = {lifecycle_msgs::msg::State::PRIMARY_STATE_FINALIZED, ""};
  EXPECT_TRUE(rig.call<srv::SetHardwareComponentState>("set_hardware_component_state", sleep).ok);
  EXPECT_EQ(rig.hardware->calls.back(), "on_shutdown");
  sleep.target_state = {lifecycle_msgs::msg::State::PRIMARY_STATE_ACTIVE, ""};
  EXPECT_FALSE(rig.call<srv::SetHardwareComponentState>("set_hardware_component_state", sleep).ok);
  EXPECT_EQ(rig.count(Severity::error, "hardware 'FakeSystem' is finalized; restart doppel"), 1u)
      << rig.said();
}

TEST(ManagerServices, ActivityIsLatched) {
  ServiceRig rig;
  ASSERT_TRUE(rig.make_inactive("group"));
  for (const TopicInfo& topic : rig.bus.topics()) {
    if (topic.name == "/controller_manager/activity") rig.edge->subscribe(topic.id);
  }
  rig.bus.spin();
  controller_manager_msgs::msg::ControllerManagerActivity activity;
  Edge::Incoming incoming;
  ASSERT_TRUE(rig.edge->next(incoming));
  ASSERT_TRUE(from_cdr(incoming.cdr, activity).ok());
  ASSERT_EQ(activity.controllers.size(), 1u);
  EXPECT_EQ(activity.controllers[0].state.label, "inactive");
  ASSERT_EQ(activity.hardware_components.size(), 1u);
  EXPECT_EQ(activity.hardware_components[0].state.label, "active");
}

TEST(ManagerServices, ParametersAreServed) {
  ServiceRig rig;
  ASSERT_TRUE(rig.make_inactive("group"));
  EXPECT_EQ(rig.value("/controller_manager", "update_rate"), "100");
  EXPECT_EQ(rig.value("/controller_manager", "group.type"), kGroupType);
  EXPECT_EQ(rig.value("/group", "joints"), "[a]");
  Names services;
  for (const ServiceInfo& service : rig.bus.services()) services.push_back(service.name);
  EXPECT_THAT(services,
              testing::IsSupersetOf({"/controller_manager/get_parameters", "/group/set_parameters"}));
}

TEST(Spawner, UndeclaredControllerIsLoadedByTypeAndFiles) {
  for (const char* yaml : {kYaml, ""}) {  // "": up --no-controllers
    ServiceRig rig(yaml);
    for (const char* section : {"fwd", "/fwd", "/**", "/**/fwd"}) {
      const auto path =
          file_with("extra.yaml", fmt::format("{}: {{ros__parameters: {{joints: [b]}}}}", section));
      ASSERT_TRUE(rig.set("fwd.params_file", Names{path}));
      ASSERT_TRUE(rig.set("fwd.type", std::string(kGroupType)));
      ASSERT_TRUE(rig.load("fwd")) << rig.said();
      EXPECT_EQ(rig.value("/fwd", "joints"), "[b]") << section;
      EXPECT_TRUE(rig.call<srv::UnloadController>("unload_controller", {"fwd"}).ok);
    }
  }
}

TEST(Spawner, ParametersOverrideFile) {
  ServiceRig rig(
      "controller_manager: {ros__parameters: {group: {type: a/B, params_file: none.yaml}}}\n"
      "group: {ros__parameters: {joints: [a]}}");
  const auto path = file_with("later.yaml", "group: {ros__parameters: {joints: [b]}}");
  const auto relative = std::filesystem::relative(path).string();
  ASSERT_TRUE(rig.set("group.params_file", Names{relative}));
  EXPECT_FALSE(rig.set("group.type", std::int64_t{1}))
      << "expected a rejection: the type is declared as a string";
  ASSERT_TRUE(rig.set("group.type", std::string(kGroupType)));
  ASSERT_TRUE(rig.load("group")) << rig.said();
  EXPECT_EQ(rig.value("/group", "joints"), "[b]");
  EXPECT_TRUE(rig.call<rcl_interfaces::srv::SetParameters>("set_parameters", {{{"x", to_msg(1.0)}}})
                  .results.at(0)
                  .successful);
  ASSERT_EQ(rig.value("/controller_manager", "x"), "1.0");
}

TEST(Spawner, NodeArgumentsReachController) {
  ServiceRig rig;
  const auto path = file_with("given.yaml", "/**: {ros__parameters: {joints: [a], update_rate: 50}}");
  const auto topics = [&rig] {
    Names names;
    for (const TopicInfo& topic : rig.bus.topics()) {
      if (!topic.subscribers.empty()) names.push_back(topic.name);
    }
    return names;
  };
  ASSERT_TRUE(rig.set("wrong.node_options_args", Names{"--ros-args", "-r", "~/commands:=/wanted",
                                                       "--params-file", path, "-p", "joints:=[b]"}));
  ASSERT_TRUE(rig.load("wrong")) << rig.said();
  EXPECT_THAT(topics(), testing::AllOf(Contains("/wanted"), testing::Not(Contains("/wrong/commands"))));
  EXPECT_EQ(rig.value("/wrong", "joints"), "[b]")
      << "expected later files to take precedence over earlier ones, and all of them over the manager's file";
  EXPECT_EQ(rig.value("/wrong", "update_rate"), "50");

  ASSERT_TRUE(rig.set("group.node_options_args", Names{"-r", "__ns:=/left", "-r", "__node:=hand"}));
  ASSERT_TRUE(rig.load("group")) << rig.said();
  EXPECT_THAT(topics(), testing::IsSupersetOf({"/wanted", "/left/hand/commands"}))
      << "expected each controller to have its own rule";
  EXPECT_TRUE(rig.make_inactive("states"));

  EXPECT_TRUE(rig.call<srv::UnloadController>("unload_controller", {"wrong"}).ok);
  ASSERT_TRUE(rig.set("wrong.node_options_args", Names{"-p", "joints:=[b]"}));
  ASSERT_TRUE(rig.load("wrong")) << rig.said();
  EXPECT_THAT(topics(), Contains("/wrong/commands"))
      << "expected the remapping rule to be removed with the controller";
}

TEST(Spawner, UnsupportedArgumentsAreReported) {
  ServiceRig rig;
  const std::pair<Names, const char*> cases[] = {{{"-r", "other:a:=b"}, "node 'other'"},
                                                 {{"-r", "a b:=c"}, "' '"},
                                                 {{"--log-level", "debug"}, "--log-level is for the whole"},
                                                 {{"-e", "/left"}, "--enclave is for the whole"},
                                                 {{"-p", "use_sim_time:=false"}, "one clock"},
                                                 {{"--params-file", "/dev/zero"}, "/dev/zero"},
                                                 {{"more", "--ros-args"}, "'more'"}};
  for (const auto& [arguments, part] : cases) {
    ASSERT_TRUE(rig.set("group.node_options_args", arguments));
    EXPECT_FALSE(rig.load("group")) << part;
    EXPECT_EQ(rig.count(Severity::error, part), 1u) << rig.said();
  }
  ASSERT_TRUE(rig.set("group.node_options_args", Names{}));
  EXPECT_TRUE(rig.load("group")) << rig.said();
}

TEST(Spawner, FailureIsReported) {
  ServiceRig rig("");
  EXPECT_FALSE(rig.load("fwd"));
  EXPECT_EQ(rig.count(Severity::error, "no type is given for the controller 'fwd'"), 1u) << rig.said();
  ASSERT_TRUE(rig.set("fwd.type", std::int64_t{1}));
  EXPECT_FALSE(rig.load("fwd"));
  EXPECT_EQ(rig.count(Severity::error, "'fwd.type' of /controller_manager is integer"), 1u) << rig.said();
  ASSERT_TRUE(rig.set("fwd.type", std::string("position_controllers/JointGroupPositionControler")));
  EXPECT_FALSE(rig.load("fwd"));
  EXPECT_EQ(rig.count(Severity::error, "did you mean"), 1u) << rig.said();
  ASSERT_TRUE(rig.set("fwd.type", std::string(kGroupType)));
  ASSERT_TRUE(rig.set("fwd.params_file", Names{"nowhere/x.yaml"}));
  EXPECT_FALSE(rig.load("fwd"));
  EXPECT_EQ(rig.count(Severity::error, "/nowhere/x.yaml"), 1u) << rig.said();
  ASSERT_TRUE(rig.set("fwd.params_file", std::string("/dev/zero")));
  EXPECT_FALSE(rig.load("fwd"));
  ASSERT_TRUE(rig.set("fwd.params_file", true));
  EXPECT_FALSE(rig.load("fwd"));
  EXPECT_EQ(rig.count(Severity::error, "'fwd.params_file' of /controller_manager is bool"), 1u) << rig.said();
}

TEST(Spawner, UndeclaredParametersAreTaken) {
  ServiceRig rig;
  ASSERT_TRUE(rig.load("group"));
  const auto edge = rig.bus.attach("other");
  Status status;
  edge->set_parameter("/group", "anything", 1.0, [&](Status s) { status = std::move(s); });
  rig.bus.spin();
  EXPECT_TRUE(status) << status.why();
  EXPECT_EQ(rig.value("/group", "anything"), "1.0");
}

}  // namespace
}  // namespace doppel
