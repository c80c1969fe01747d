#include "doppel/ros/network/detail/bridge_warnings.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "doppel/ros/bus/name_rules.h"
#include "doppel/ros/messages/rosgraph_msgs.h"
#include "doppel/ros/network/peer_distros.h"

namespace doppel::ros2 {
namespace {

constexpr std::size_t kMaxPairsReported =
    1000;                                // pairs at a time, to limit the memory that unknown peers can use
constexpr std::size_t kMachineSize = 4;  // bytes of the vendor and the machine
constexpr int kProcesses = 1 << 16;      // distinguished by the following two bytes

// The one process of this machine whose id ends in those two bytes; 0: none, or several.
int process_of(const Gid& gid) {
  constexpr int kMaxProcesses = 1 << 22;  // of Linux
  int found = 0;
  for (int id = gid.bytes[kMachineSize] | gid.bytes[kMachineSize + 1] << 8; id < kMaxProcesses;
       id += kProcesses) {
    std::error_code none;
    if (id == 0 || !std::filesystem::exists(fmt::format("/proc/{}", id), none)) continue;
    if (found != 0) return 0;
    found = id;
  }
  return found;
}

}  // namespace

std::string place_of(const Gid& other, const Gid& own, const NameProcess& name_process) {
  constexpr std::array<std::uint8_t, 2> kFastDds{1, 15};
  if (!std::ranges::equal(other.prefix().first<2>(), kFastDds)) return "another process";
  if (!std::ranges::equal(other.prefix().first<kMachineSize>(), own.prefix().first<kMachineSize>()))
    return "another machine";
  const int process = process_of(other);
  if (process == 0) return "another process on this machine";
  const std::string name = name_process ? name_process(process) : "";
  return name.empty() ? fmt::format("process {} on this machine", process) : name;
}

bool NetworkWarnings::is_new(const GraphEndpoint& own_end, const GraphEndpoint& other_end) {
  const std::pair pair(own_end.gid, other_end.gid);
  if (lasting_.size() < kMaxPairsReported) lasting_.insert(pair);
  return lasting_.contains(pair) && !said_.contains(pair);
}

void NetworkWarnings::say(const GraphEndpoint& own_end, const GraphEndpoint& other_end,
                          const std::string& text) {
  if (is_new(own_end, other_end)) log_.warning(node_base_name(own_end.node), text);
}

// The sentences are rclcpp's (publisher_base.cpp, subscription_base.cpp).
void NetworkWarnings::compare(const std::string& topic, const GraphEndpoint& publisher,
                              const GraphEndpoint& subscription, const Gid& own) {
  const bool publishes = is_same_participant(publisher.gid, own);
  if (publishes == is_same_participant(subscription.gid, own) || publisher.type != subscription.type) return;
  const std::string_view policy = incompatible_policy(publisher.qos, subscription.qos);
  if (policy.empty()) return;
  if (publishes) {
    say(publisher, subscription,
        fmt::format(
            "New subscription discovered on topic '{}', requesting incompatible QoS. No messages will "
            "be sent to it. Last incompatible policy: {}",
            topic, policy));
  } else {
    say(subscription, publisher,
        fmt::format("New publisher discovered on topic '{}', offering incompatible QoS. No messages will be "
                    "sent to it. Last incompatible policy: {}",
                    topic, policy));
  }
}

// One warning a participant: its other types follow from its distribution.
void NetworkWarnings::compare_types(const std::string& name, const std::vector<GraphEndpoint>& own_ends,
                                    const std::vector<GraphEndpoint>& other_ends, const char* part,
                                    const Gid& self) {
  const auto own_end = std::ranges::find_if(
      own_ends, [&](const GraphEndpoint& end) { return is_same_participant(end.gid, self); });
  if (own_end == own_ends.end()) return;
  for (const GraphEndpoint& other : other_ends) {
    if (is_same_participant(other.gid, self) || other.type != own_end->type) continue;
    const std::optional<ForeignType> foreign = foreign_type(other, part);
    if (!foreign || lasting_foreign_.size() >= kMaxPairsReported) continue;
    const auto prefix = other.gid.prefix();
    const auto [participant, is_first] = lasting_foreign_.emplace(prefix.begin(), prefix.end());
    if (!is_first || foreign_.contains(*participant)) continue;
    const bool has_distro = !foreign->distros.empty();
    log_.warning(
        node_base_name(own_end->node),
        fmt::format("node {} in {} has {} of {}, and this is {}: its messages on {} would be misread. {}",
                    other.node, place_of(other.gid, self, name_process_), foreign->type,
                    has_distro ? title_of(foreign->distros) : "another definition", title(ros_distro()), name,
                    has_distro ? fmt::format("Start the twin with --distro {}, or set ROS_DISTRO",
                                             to_string(foreign->distros.back()))
                               : fmt::format("Compare both: doppel interface show {}", own_end->type)));
  }
}

void NetworkWarnings::look_at(const std::vector<GraphTopic>& topics,
                              const std::vector<GraphService>& services, const Gid& own) {
  lasting_.clear();
  lasting_foreign_.clear();
  for (const GraphService& service : services) {
    compare_types(service.name, service.servers, service.clients, "_Request", own);
    compare_types(service.name, service.clients, service.servers, "_Request", own);
    compare_types(service.name, service.reply_servers, service.reply_clients, "_Response", own);
    compare_types(service.name, service.reply_clients, service.reply_servers, "_Response", own);
  }
  for (const GraphTopic& topic : topics) {
    compare_types(topic.name, topic.publishers, topic.subscriptions, "", own);
    compare_types(topic.name, topic.subscriptions, topic.publishers, "", own);
    for (const GraphEndpoint& publisher : topic.publishers) {
      for (const GraphEndpoint& subscription : topic.subscriptions)
        compare(topic.name, publisher, subscription, own);
      if (publisher.type != rosgraph_msgs::msg::Clock::kType || !is_same_participant(publisher.gid, own))
        continue;
      for (const GraphEndpoint& other : topic.publishers) {
        // The nodes of a participant arrive after its endpoints, and are looked at then.
        if (is_same_participant(other.gid, own) || other.node == kUnknownNode) continue;
        say(publisher, other,
            fmt::format("{} is also published by node {} in {}: nodes that use simulated time jump between "
                        "the two clocks; give one of them its own domain (--domain), or a namespace with its "
                        "own clock (--ros-args -r __ns:=/left -r /clock:=clock)",
                        topic.name, other.node, place_of(other.gid, own, name_process_)));
      }
    }
  }
  said_ = lasting_;
  foreign_ = lasting_foreign_;
}

}  // namespace doppel::ros2
