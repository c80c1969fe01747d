#include "doppel/bus/standard_node.h"

#include <fmt/format.h>

#include "doppel/bus/parameter_services.h"
#include "doppel/messages/rcl_interfaces.h"
#include "doppel/messages/rosgraph_msgs.h"

namespace doppel {
namespace {

using rcl_interfaces::msg::ParameterEvent;

constexpr const char* kParameterEvents = "/parameter_events";
constexpr const char* kClock = "/clock";

void tell_changes(Node& node) {
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
    events.publish(message, node.bus().now());
  });
}

void declare_sim_time(Node& node) {
  const bool sim_time = node.bus().sim_time();
  node.parameters().declare(
      "use_sim_time", sim_time,
      {.description = "stamps are simulated time, as /clock tells it",
       .check = [sim_time](const ParameterValue& value) {
         return std::get<bool>(value) == sim_time
                    ? Status()
                    : Status::refused("the whole twin has one clock; --stamp sim or --stamp wall chooses it "
                                      "when it is started");
       }});
  if (!sim_time) return;
  node.subscribe<rosgraph_msgs::msg::Clock>(kClock, [](const auto&) {}, Qos::clock_subscription());
  declare_qos_overrides(node, kClock, QosOverrideOf::subscription, Qos::clock_subscription());
}

}  // namespace

void declare_qos_overrides(Node& node, std::string_view topic, QosOverrideOf end, const Qos& qos) {
  const std::string name = node.bus().names().resolve(NameKind::topic, topic, node.name());
  const std::string prefix = fmt::format("qos_overrides.{}.{}.", name,
                                         end == QosOverrideOf::publisher ? "publisher" : "subscription");
  const auto declare = [&](const char* policy, ParameterValue value) {
    node.parameters().declare(prefix + policy, std::move(value), {.read_only = true});
  };
  declare("depth", static_cast<std::int64_t>(qos.depth));
  declare("durability", std::string(qos.transient_local() ? "transient_local" : "volatile"));
  declare("history", std::string(qos.keep_all ? "keep_all" : "keep_last"));
  declare("reliability", std::string(qos.best_effort ? "best_effort" : "reliable"));
}

void make_standard(Node& node) {
  node.advertise<rcl_interfaces::msg::Log>("/rosout", Qos::rosout());
  serve_parameters(node);
  tell_changes(node);
  node.subscribe<ParameterEvent>(kParameterEvents, [](const auto&) {}, Qos::parameter_events());
  declare_sim_time(node);
  node.parameters().declare("start_type_description_service", true,
                            {.description = "Start the ~/get_type_description service for this node.",
                             .read_only = true});
  declare_qos_overrides(node, kParameterEvents, QosOverrideOf::publisher, Qos::parameter_events());
}

}  // namespace doppel
