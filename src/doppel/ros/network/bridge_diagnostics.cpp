#include "doppel/ros/network/detail/bridge_diagnostics.h"

#include <fmt/format.h>

namespace doppel::ros2 {

using diagnostic_msgs::msg::DiagnosticArray;
using diagnostic_msgs::msg::DiagnosticStatus;

NetworkDiagnostics::NetworkDiagnostics(Bus& bus, const BridgeOptions& options)
    : bus_(bus), network_(options.network), node_(bus, options.diagnostics_node) {
  topic_ = node_.advertise<DiagnosticArray>("/diagnostics", {.depth = 1});
}

void NetworkDiagnostics::publish(const NetworkStatus& now) {
  if (!topic_.has_listeners()) return;
  const std::uint64_t refused = now.refused - std::exchange(refused_published_, now.refused);
  DiagnosticStatus status;
  status.name = "doppel: ros2 network";
  status.hardware_id = fmt::format("domain {}", network_.domain);
  if (now.state == NetworkStatus::State::absent) {
    status.level = DiagnosticStatus::ERROR;
    status.message = now.problem;
  } else if (now.state == NetworkStatus::State::joining) {
    status.message = "joins";
  } else if (refused > 0) {
    status.level = DiagnosticStatus::WARN;
    status.message = fmt::format("rejected {} messages in the last second", refused);
  } else {
    status.message = fmt::format("{} other participants", now.participants);
  }
  const auto add = [&status](std::string key, std::string value) {
    status.values.push_back({std::move(key), std::move(value)});
  };
  add("domain", fmt::format("{}", network_.domain));
  add("discovery range", std::string(to_string(network_.range)));
  add("other participants", fmt::format("{}", now.participants));
  add("other nodes", fmt::format("{}", now.nodes));
  add("messages sent", fmt::format("{}", now.sent));
  add("messages received", fmt::format("{}", now.received));
  add("requests received", fmt::format("{}", now.requests));
  add("rejected", fmt::format("{}", now.refused));
  add("rejected datagrams", fmt::format("{}", now.refused_datagrams));
  add("lost", fmt::format("{}", now.lost));
  add("requests that could not be answered", fmt::format("{}", now.unanswered));
  add("warnings of Fast DDS",
      now.middleware_log.count == 0
          ? "0"
          : fmt::format("{}, the last: {}", now.middleware_log.count, now.middleware_log.latest));
  for (const auto& [name, rejected] : now.rejections)
    add(fmt::format("rejected on {}", name),
        fmt::format("{}, the last: {}", rejected.count, rejected.reason));
  DiagnosticArray message;
  message.status.push_back(std::move(status));
  bus_.post([&bus = bus_, topic = topic_, message = std::move(message)]() mutable {
    message.header.stamp = to_time_msg(bus.ros_now());
    topic.publish(message, bus.now());
  });
}

}  // namespace doppel::ros2
