// The topics and services that every ROS 2 node has.
#include "doppel/ros/bus/standard_node.h"

#include <gmock/gmock.h>

#include "doppel/ros/bus/rosout.h"
#include "doppel/ros/messages/rcl_interfaces.h"
#include "doppel/ros/messages/type_description_interfaces.h"

namespace doppel {
namespace {

using rcl_interfaces::msg::ParameterEvent;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::vector<std::string> topics_of(const Bus& bus, bool published) {
  std::vector<std::string> names;
  for (const TopicInfo& topic : bus.topics()) {
    for (const EndpointInfo& end : published ? topic.publishers : topic.subscribers) {
      if (end.node == "/left/arm") names.push_back(topic.name);
    }
  }
  return names;
}

TEST(StandardNode, HasServicesAndTopicsOfRclcppNode) {
  NameRules rules;
  rules.add("__ns:=/left");
  Bus bus({.names = rules});
  Node node(bus, "/arm");
  make_standard(node);
  EXPECT_THAT(topics_of(bus, true), ElementsAre("/parameter_events", "/rosout"));
  EXPECT_THAT(topics_of(bus, false), ElementsAre("/clock", "/parameter_events"));
  std::vector<std::string> services;
  for (const ServiceInfo& service : bus.services()) services.push_back(service.name);
  for (const char* service : {"describe_parameters", "get_parameter_types", "get_parameters",
                              "list_parameters", "set_parameters", "set_parameters_atomically"}) {
    EXPECT_THAT(services, Contains(std::string("/left/arm/") + service));
  }
  const auto value = [&](const char* name) { return node.parameters().find(name)->value; };
  EXPECT_EQ(value("use_sim_time"), ParameterValue(true));
  EXPECT_EQ(value("qos_overrides./parameter_events.publisher.depth"), ParameterValue(std::int64_t{1000}));
  EXPECT_EQ(value("qos_overrides./clock.subscription.reliability"),
            ParameterValue(std::string("best_effort")));
  EXPECT_TRUE(node.parameters().set("use_sim_time", true));
  EXPECT_THAT(node.parameters().set("use_sim_time", false).why(), HasSubstr("--stamp"));
}

TEST(StandardNode, WallClockStampingHasNoClock) {
  Bus bus({.sim_time = false});
  Node node(bus, "/arm");
  make_standard(node);
  EXPECT_EQ(node.parameters().find("use_sim_time")->value, ParameterValue(false));
  for (const TopicInfo& topic : bus.topics()) EXPECT_NE(topic.name, "/clock");
}

TEST(StandardNode, ParameterChangesPublishEvents) {
  Bus bus({.sim_time = false});
  bus.set_now(Time(std::chrono::seconds(2)));
  bus.set_stamp_offset(std::chrono::seconds(100));
  Node node(bus, "/arm"), listener(bus, "/listener");
  std::vector<ParameterEvent> events;
  listener.subscribe<ParameterEvent>("/parameter_events",
                                     [&](const ParameterEvent& e) { events.push_back(e); });
  make_standard(node);
  events.clear();
  node.parameters().declare("gain", 1.0);
  node.parameters().declare("rate", std::int64_t{5});
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[0].node, "/arm");
  EXPECT_EQ(events[0].stamp.sec, 102);
  EXPECT_EQ(events[0].new_parameters.at(0).name, "gain");
  EXPECT_TRUE(node.parameters().set_all({{"gain", 2.0}, {"rate", std::int64_t{6}}}));
  EXPECT_FALSE(node.parameters().set_all({{"gain", 3.0}, {"rate", 0.5}}));
  ASSERT_EQ(events.size(), 3U) << "expected no event for a rejected change";
  ASSERT_EQ(events[2].changed_parameters.size(), 2U)
      << "expected one event for parameters that were set together";
  EXPECT_EQ(events[2].changed_parameters[0].value.double_value, 2.0);
  EXPECT_THAT(events[2].new_parameters, IsEmpty());
}

TEST(StandardNode, TypeDescriptionServiceReturnsTypes) {
  using type_description_interfaces::srv::GetTypeDescription;
  Bus bus;
  Node node(bus, "/arm");
  make_standard(node);
  const auto edge = bus.attach("edge");
  GetTypeDescription::Response response;
  const auto ask = [&](const std::string& name, const std::string& hash) {
    edge->call("/arm/get_type_description", to_cdr(GetTypeDescription::Request{name, hash, false}),
               [&](const Status&, const Bytes& bytes) { EXPECT_TRUE(from_cdr(bytes, response)); });
    bus.spin();
  };
  ask("rcl_interfaces/msg/Log", find_type("rcl_interfaces/msg/Log")->hash());
  EXPECT_TRUE(response.successful) << response.failure_reason;
  EXPECT_EQ(response.type_description.type_description.fields.at(1).name, "level");
  ask("rcl_interfaces/srv/ListParameters", find_service("rcl_interfaces/srv/ListParameters")->hash());
  EXPECT_TRUE(response.successful) << response.failure_reason;
  ask("rcl_interfaces/msg/Log", find_type("rcl_interfaces/msg/ParameterEvent")->hash());
  EXPECT_EQ(response.failure_reason, "Type not currently in use by this node");
  ask("rcl_interfaces/msg/Log", "x");
  EXPECT_EQ(response.failure_reason, "Failed to parse type hash");
}

TEST(StandardNode, LoggerLevelsCanBeSet) {
  using rcl_interfaces::srv::SetLoggerLevels;
  Bus bus;
  Node node(bus, "/arm");
  make_standard(node);
  serve_logger_levels(node);
  const auto edge = bus.attach("edge");
  SetLoggerLevels::Response response;
  edge->call("/arm/set_logger_levels", to_cdr(SetLoggerLevels::Request{{{"arm", 30}, {"arm", 31}}}),
             [&](const Status&, const Bytes& bytes) { EXPECT_TRUE(from_cdr(bytes, response)); });
  bus.spin();
  ASSERT_EQ(response.results.size(), 2U);
  EXPECT_TRUE(response.results[0].successful);
  EXPECT_FALSE(response.results[1].successful);
  std::vector<std::string> received;
  node.subscribe<rcl_interfaces::msg::Log>("/rosout",
                                           [&](const auto& line) { received.push_back(line.msg); });
  Log log;
  const Rosout rosout(bus);
  log.add_sink(rosout.sink());
  log.note("arm", "a note");
  log.warning("arm", "a warning");
  bus.spin();
  EXPECT_THAT(received, ElementsAre("a warning"));
}

TEST(Rosout, LogLinesCarryNodeName) {
  NameRules rules;
  rules.add("arm:__ns:=/left");
  Bus bus({.names = rules});
  Node arm(bus, "/arm");
  std::vector<rcl_interfaces::msg::Log> lines;
  arm.subscribe<rcl_interfaces::msg::Log>("/rosout", [&](const auto& line) { lines.push_back(line); });
  Log log;
  {
    const Rosout rosout(bus);
    log.add_sink(rosout.sink());
    log.warning("arm", "a warning");
    log.error("", "an error");
    log.note("room", "a note");
    EXPECT_TRUE(lines.empty()) << "expected no message before the next step";
    bus.spin();
  }
  log.note("arm", "too late");
  bus.spin();
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_EQ(lines[0].name, "left.arm");
  EXPECT_EQ(lines[0].msg, "a warning");
  EXPECT_EQ(lines[0].level, 30);
  EXPECT_EQ(lines[1].name, "doppel");
  EXPECT_EQ(lines[1].level, 40);
  EXPECT_EQ(lines[2].name, "room");
  EXPECT_EQ(lines[2].level, 20);
}

void speak(const Log& log) {
  log.warning("arm", "from a function");
}

TEST(Rosout, LogLinesCarrySourceLocation) {
  Bus bus;
  Node arm(bus, "/arm");
  std::vector<rcl_interfaces::msg::Log> lines;
  arm.subscribe<rcl_interfaces::msg::Log>("/rosout", [&](const auto& line) { lines.push_back(line); });
  Log log;
  const Rosout rosout(bus);
  log.add_sink(rosout.sink());
  const auto before = CodeLocation::current();
  log.note("arm", "from the test");
  speak(log);
  [&log] { log.error("arm", "from a lambda"); }();
  bus.spin();
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_EQ(lines[0].file, before.file);
  EXPECT_EQ(lines[0].function, "TestBody");
  EXPECT_EQ(lines[0].line, static_cast<std::uint32_t>(before.line) + 1);
  EXPECT_EQ(lines[1].function, "speak");
  EXPECT_EQ(lines[2].function, "operator()");
}

}  // namespace
}  // namespace doppel
