#include "doppel/ros/bus/standard_node.h"

#include <fmt/format.h>

#include "doppel/ros/bus/parameter_services.h"
#include "doppel/ros/messages/rcl_interfaces.h"
#include "doppel/ros/messages/rosgraph_msgs.h"
#include "doppel/ros/messages/type_description_message.h"

namespace doppel {
namespace {

using rcl_interfaces::msg::ParameterEvent;
using type_description_interfaces::srv::GetTypeDescription;

constexpr const char* kParameterEvents = "/parameter_events";
constexpr const char* kClock = "/clock";
constexpr std::size_t kMaxLoggers = 1000;  // with a level

void publish_changes(Node& node) {
  const auto events = node.advertise<ParameterEvent>(kParameterEvents, Qos::parameter_events());
  node.parameters().on_event([&node, events](const Parameters::Event& event) {
    if (!events.has_listeners()) return;
    ParameterEvent message;
    message.stamp = to_time_msg(node.bus().ros_now());
    message.node = node.name();
    for (const auto* declared : event.declared)
      message.new_parameters.push_back({declared->name, to_msg(declared->value)});
    for (const auto* changed : event.changed)
      message.changed_parameters.push_back({changed->name, to_msg(changed->value)});
    for (const auto* deleted : event.deleted)
      message.deleted_parameters.push_back({deleted->name, to_msg(deleted->value)});
    events.publish(message, node.bus().now());
  });
}

void declare_sim_time(Node& node) {
  const bool sim_time = node.bus().sim_time();
  node.parameters().declare(
      "use_sim_time", sim_time,
      {.description = "use simulated time (/clock) for stamps",
       .check = [sim_time](const ParameterValue& value) {
         return std::get<bool>(value) == sim_time
                    ? Status()
                    : Status::refused(
                          "the twin has one clock; choose it at the start with --stamp sim or --stamp wall");
       }});
  if (!sim_time) return;
  node.subscribe<rosgraph_msgs::msg::Clock>(
      kClock, [](const auto&) {}, Qos::clock_subscription());
  declare_qos_overrides(node, kClock, QosOverrideOf::subscription, Qos::clock_subscription());
}

// The support of a type: for a message its description, for a service or an action itself.
const TypeDescription& described(const TypeSupport& type) {
  return *type.description();
}
template <class Support>
const Support& described(const Support& support) {
  return support;
}

template <class Support>
void fill_description(const Support* found, const GetTypeDescription::Request& request,
                      GetTypeDescription::Response& response) {
  if (found == nullptr || response.successful || found->hash() != request.type_hash) return;
  response.successful = true;
  response.type_description = description_message(described(*found));
  if (request.include_type_sources) response.type_sources = type_sources(described(*found));
}

// As in rcl, except that every node knows every type of the program.
void serve_type_descriptions(Node& node) {
  node.serve<GetTypeDescription>("~/get_type_description", [](const auto& request, const auto& respond) {
    GetTypeDescription::Response response;
    if (!request.type_hash.starts_with("RIHS01_")) {
      response.failure_reason = "Failed to parse type hash";
    } else {
      fill_description(find_type(request.type_name), request, response);
      fill_description(find_service(request.type_name), request, response);
      fill_description(find_action(request.type_name), request, response);
      if (!response.successful) response.failure_reason = "Type not currently in use by this node";
    }
    respond(response);
  });
}

}  // namespace

void serve_logger_levels(Node& node) {
  using rcl_interfaces::srv::GetLoggerLevels;
  using rcl_interfaces::srv::SetLoggerLevels;
  auto& levels = node.bus().logger_levels();
  node.serve<GetLoggerLevels>("~/get_logger_levels", [&levels](const auto& request, const auto& respond) {
    GetLoggerLevels::Response response;
    for (const std::string& name : request.names) {
      const auto found = levels.find(name);
      response.levels.push_back({name, found == levels.end() ? 0 : found->second});
    }
    respond(response);
  });
  node.serve<SetLoggerLevels>("~/set_logger_levels", [&levels](const auto& request, const auto& respond) {
    using Level = rcl_interfaces::msg::LoggerLevel;
    SetLoggerLevels::Response response;
    for (const Level& wanted : request.levels) {
      const bool known = wanted.level % 10 == 0 && wanted.level <= Level::LOG_LEVEL_FATAL;
      const bool room = levels.contains(wanted.name) || levels.size() < kMaxLoggers;
      if (known && room) levels[wanted.name] = wanted.level;
      response.results.push_back({known && room, known ? "" : "Invalid logger level"});
    }
    respond(response);
  });
}

void declare_qos_overrides(Node& node, std::string_view topic, QosOverrideOf end, const Qos& qos,
                           QosOverridePolicies policies) {
  const std::string name = node.bus().names().resolve(NameKind::topic, topic, node.name());
  const std::string prefix = fmt::format("qos_overrides.{}.{}.", name,
                                         end == QosOverrideOf::publisher ? "publisher" : "subscription");
  const auto declare = [&](const char* policy, ParameterValue value) {
    node.parameters().declare(prefix + policy, std::move(value), {.read_only = true});
  };
  declare("depth", static_cast<std::int64_t>(qos.depth));
  if (policies == QosOverridePolicies::all)
    declare("durability", std::string(qos.transient_local() ? "transient_local" : "volatile"));
  declare("history", std::string(qos.keep_all ? "keep_all" : "keep_last"));
  declare("reliability", std::string(qos.best_effort ? "best_effort" : "reliable"));
}

void make_standard(Node& node, bool own_clock) {
  node.advertise<rcl_interfaces::msg::Log>("/rosout", Qos::rosout());
  serve_parameters(node);
  serve_type_descriptions(node);
  publish_changes(node);
  node.subscribe<ParameterEvent>(
      kParameterEvents, [](const auto&) {}, Qos::parameter_events());
  if (!own_clock) declare_sim_time(node);
  node.parameters().declare(
      "start_type_description_service", true,
      {.description = "Start the ~/get_type_description service for this node.", .read_only = true});
  declare_qos_overrides(node, kParameterEvents, QosOverrideOf::publisher, Qos::parameter_events());
}

}  // namespace doppel
