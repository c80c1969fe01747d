// docs/ros2.md lists what a running twin offers; its tables are generated here, from the bus of a twin that
// has one controller of every type. After an intended change: DOPPEL_WRITE_DOCS=1 build/bin/ros2_tables_test

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <map>
#include <set>

#include "doppel/ros/bus/rosout.h"
#include "doppel/session/live/calibration_service.h"
#include "doppel/session/live/health_publisher.h"
#include "doppel/session/live/validation_service.h"
#include "doppel/twin/assembly/runner.h"
#include "doppel/twin/assembly/twin.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

constexpr const char* kBegin = "<!-- what follows is made by tests/ros2_tables_test.cpp -->\n";
constexpr const char* kEnd = "<!-- end of what is made -->\n";

constexpr const char* kRobot = R"(<robot name="arm">
  <link name="base"><inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="hand"><inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="JOINT" type="revolute"><parent link="base"/><child link="hand"/><axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="20" velocity="3"/></joint>
  <ros2_control name="ArmSystem" type="system">
    <hardware><plugin>gz_ros2_control/GazeboSimSystem</plugin></hardware>
    <joint name="JOINT">
      <command_interface name="position"/><command_interface name="velocity"/><command_interface name="effort"/>
      <state_interface name="position"/><state_interface name="velocity"/><state_interface name="effort"/>
    </joint>
  </ros2_control>
</robot>
)";

constexpr const char* kControllers = R"(controller_manager:
  ros__parameters:
    joint_state_broadcaster: {type: joint_state_broadcaster/JointStateBroadcaster}
    arm_controller: {type: joint_trajectory_controller/JointTrajectoryController}
    group_controller: {type: position_controllers/JointGroupPositionController}
    pid: {type: pid_controller/PidController}
    gripper: {type: position_controllers/GripperActionController}
    effort_gripper: {type: effort_controllers/GripperActionController}
    parallel_gripper: {type: parallel_gripper_action_controller/GripperActionController}
arm_controller: {ros__parameters: {joints: [JOINT], command_interfaces: [position], state_interfaces: [position, velocity]}}
group_controller: {ros__parameters: {joints: [JOINT]}}
pid: {ros__parameters: {dof_names: [JOINT], command_interface: effort, reference_and_state_interfaces: [position]}}
gripper: {ros__parameters: {joint: JOINT}}
effort_gripper: {ros__parameters: {joint: JOINT}}
parallel_gripper: {ros__parameters: {joint: JOINT}}
)";

std::string qos_text(const Qos& qos) {
  return fmt::format("{}, {}, {}{}", qos.best_effort ? "best effort" : "reliable",
                     qos.transient_local() ? "transient local" : "volatile",
                     qos.keep_all ? "all" : fmt::format("last {}", qos.depth),
                     qos.lifespan > Duration{} ? fmt::format(", for {:g} s", to_seconds(qos.lifespan)) : "");
}

// "~/x" for names below the node.
std::string shown(const std::string& name, const std::string& node) {
  return name.starts_with(node + "/") ? "~" + name.substr(node.size()) : name;
}

struct Offer {
  std::set<std::string> topics, services, actions, parameters;  // rows of tables
};

std::string parameter_row(const Parameters::Declared& declared) {
  std::string value = to_string(declared.value);
  if (declared.name == "robot_description") value = "the URDF";
  std::string more = declared.options.read_only ? "read-only" : "";
  if (const auto& range = declared.options.range)
    more += fmt::format("{}{:g} to {:g}", more.empty() ? "" : ", ", range->from, range->to);
  return fmt::format("| `{}` | {} | {} | {} |\n", declared.name, parameter_type_name(declared.value),
                     value.empty() ? "" : fmt::format("`{}`", value), more);
}

std::map<std::string, Offer> offers_of(Twin& twin) {
  std::map<std::string, Offer> offers;
  for (const TopicInfo& topic : twin.bus().topics()) {
    if (topic.name.find("/_action/") != std::string::npos) continue;
    for (const bool out : {true, false}) {
      for (const EndpointInfo& end : out ? topic.publishers : topic.subscribers) {
        if (!end.edge.empty()) continue;
        offers[end.node].topics.insert(fmt::format("| `{}` | {} | {} | {} |\n", shown(topic.name, end.node),
                                                   topic.type, out ? "out" : "in", qos_text(end.qos)));
      }
    }
  }
  constexpr std::string_view kSend = "/_action/send_goal", kSuffix = "_SendGoal";
  for (const ServiceInfo& service : twin.bus().services()) {
    if (service.name.ends_with(kSend)) {
      const std::string name = service.name.substr(0, service.name.size() - kSend.size());
      offers[service.node].actions.insert(
          fmt::format("| `{}` | {} |\n", shown(name, service.node),
                      service.type.substr(0, service.type.size() - kSuffix.size())));
    } else if (service.name.find("/_action/") == std::string::npos) {
      offers[service.node].services.insert(
          fmt::format("| `{}` | {} |\n", shown(service.name, service.node), service.type));
    }
  }
  return offers;
}

std::string section(const std::string& heading, const std::string& head, const std::set<std::string>& rows) {
  if (rows.empty()) return "";
  std::string out = fmt::format("\n{}\n\n{}", heading, head);
  for (const std::string& row : rows) out += row;
  return out;
}

std::string text_of(const Offer& offer) {
  return section("Topics", "| topic | type | | QoS |\n|---|---|---|---|\n", offer.topics) +
         section("Services", "| service | type |\n|---|---|\n", offer.services) +
         section("Actions", "| action | type |\n|---|---|\n", offer.actions) +
         section("Parameters", "| parameter | type | value | |\n|---|---|---|---|\n", offer.parameters);
}

Offer common_to(const std::map<std::string, Offer>& offers) {
  Offer common = offers.begin()->second;
  for (const auto& [node, offer] : offers) {
    const auto keep = [](std::set<std::string>& rows, const std::set<std::string>& others) {
      std::erase_if(rows, [&](const std::string& row) { return !others.contains(row); });
    };
    keep(common.topics, offer.topics);
    keep(common.services, offer.services);
    keep(common.parameters, offer.parameters);
  }
  common.actions.clear();
  return common;
}

std::string tables_of(Twin& twin) {
  auto offers = offers_of(twin);
  twin.bus().each_node([&offers](Node& node) {
    for (const auto& declared : node.parameters().all())
      offers[node.name()].parameters.insert(parameter_row(declared));
  });
  const Offer common = common_to(offers);
  std::string out = "\n### Every node\n" + text_of(common);
  for (auto& [node, offer] : offers) {
    const auto own = [](std::set<std::string>& rows, const std::set<std::string>& others) {
      std::erase_if(rows, [&](const std::string& row) { return others.contains(row); });
    };
    own(offer.topics, common.topics);
    own(offer.services, common.services);
    own(offer.parameters, common.parameters);
    out += fmt::format("\n### {}\n", node) + text_of(offer);
  }
  return out + "\n";
}

std::string read(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(HealthTopic, AuditExceptionIsPublished) {
  Bus bus;
  Node reader(bus, "/reader");
  std::string received;
  reader.subscribe<std_msgs::msg::String>("/doppel/health",
                                          [&](const auto& message) { received = message.data; });
  HealthPublisher health(bus, "", []() -> std::string { throw 42; });
  health.look_at(RobotDescription());
  for (int i = 0; i < 1000 && received.empty(); ++i) {
    bus.wait(std::chrono::milliseconds(10));
    bus.spin();
  }
  EXPECT_NE(received.find("health.failed"), std::string::npos) << received;
}

TEST(Ros2Documentation, TablesMatchRunningTwin) {
  const fs::path folder = fs::temp_directory_path() / fmt::format("ros2_tables_{}", getpid());
  fs::create_directories(folder);
  std::ofstream(folder / "arm.urdf") << kRobot;
  std::ofstream(folder / "controllers.yaml") << kControllers;
  Scenario scenario;
  scenario.robots = {{.target = (folder / "arm.urdf").string()}};
  scenario.robots.front().controllers = {folder / "controllers.yaml"};
  scenario.robots.front().activate = {"joint_state_broadcaster", "arm_controller"};
  Log log;
  Diagnostics diagnostics;
  Twin twin(scenario, log, diagnostics);
  const Rosout rosout(twin.bus());
  const Runner runner(twin, {});
  const HealthPublisher health(twin.bus(), "", [] { return std::string(); });
  const ValidationService validation(twin.bus(), {});
  const CalibrationService calibration(twin.bus(), {});
  const std::string tables = tables_of(twin);
  fs::remove_all(folder);

  const fs::path doc = fs::path(DOPPEL_SOURCE_DIR) / "docs" / "ros2.md";
  std::string text = read(doc);
  const std::size_t begin = text.find(kBegin), end = text.find(kEnd);
  ASSERT_TRUE(begin != std::string::npos && end != std::string::npos) << doc;
  const std::size_t from = begin + std::string_view(kBegin).size();
  if (std::getenv("DOPPEL_WRITE_DOCS") != nullptr) {
    text.replace(from, end - from, tables);
    std::ofstream(doc, std::ios::binary) << text;
    return;
  }
  EXPECT_EQ(text.substr(from, end - from), tables)
      << "docs/ros2.md differs; if this is intended: DOPPEL_WRITE_DOCS=1 build/bin/ros2_tables_test";
}

}  // namespace
}  // namespace doppel
