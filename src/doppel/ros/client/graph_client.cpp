#include "doppel/ros/client/graph_client.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>

#include "doppel/ros/client/detail/graph_client.h"
#include "doppel/ros/network/peer_distros.h"

namespace doppel::ros2 {
namespace {

using namespace std::chrono_literals;

constexpr auto kInterruptCheck = 20ms;
// Discovery messages arrive within milliseconds of each other. A participant that has not announced its nodes
// yet gets more time, because its machine may be busy.
constexpr auto kSettleTime = 250ms;
constexpr auto kMaxDiscoveryTime = 2000ms, kMaxIncompleteTime = 5000ms;
constexpr auto kLinger = 100ms;  // as `ros2 topic pub --keep-alive`

void drain(int fd) {
  std::uint64_t count = 0;
  static_cast<void>(!read(fd, &count, sizeof count));
}

std::string text(std::chrono::nanoseconds time) {
  return time == QosProfile::kInfinite ? "Infinite" : std::to_string(time.count()) + " nanoseconds";
}

// In the order and words of rclpy's TopicEndpointInfo. Discovery does not carry the history.
std::vector<std::pair<std::string, std::string>> qos_lines(const QosProfile& qos) {
  return {{"Reliability", qos.reliability == Reliability::reliable ? "RELIABLE" : "BEST_EFFORT"},
          {"History (Depth)", "UNKNOWN"},
          {"Durability", qos.durability == Durability::transient_local ? "TRANSIENT_LOCAL" : "VOLATILE"},
          {"Lifespan", text(qos.lifespan)},
          {"Deadline", text(qos.deadline)},
          {"Liveliness", qos.liveliness == Liveliness::automatic ? "AUTOMATIC" : "MANUAL_BY_TOPIC"},
          {"Liveliness lease duration", text(qos.lease)}};
}

std::string gid_text(const Gid& gid) {
  constexpr const char* kDigits = "0123456789abcdef";
  std::string out;
  for (const std::uint8_t byte : gid.bytes) {
    if (!out.empty()) out += '.';
    out += {kDigits[byte >> 4], kDigits[byte & 15]};
  }
  return out;
}

Client::Endpoint endpoint_of(const GraphEndpoint& end) {
  return {end.node, end.type, end.type_hash, gid_text(end.gid), qos_lines(end.qos)};
}

}  // namespace

GraphClient::Impl::Impl(GraphClientOptions chosen, const MakeParticipant& make)
    : options(std::move(chosen)),
      node_name("/_doppel_" + std::to_string(getpid())),
      wake(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  try {
    ParticipantOptions with = options.network;
    with.is_cancelled = options.interrupted;
    participant = make(with, [fd = wake.get()] {
      const std::uint64_t one = 1;
      static_cast<void>(!write(fd, &one, sizeof one));  // full: the thread is awake
    });
  } catch (const NetworkError& error) {
    if (options.interrupted && options.interrupted()) throw Interrupted();
    throw ClientError(error.what());
  }
  graph = std::make_unique<Graph>(*participant);
  announce();
  discover();
}

GraphClient::Impl::~Impl() {
  if (!last_published) return;
  try {
    wait([] { return false; }, *last_published + kLinger);
  } catch (const Interrupted&) {
    last_published.reset();  // no wait after an interrupt
  }
}

void GraphClient::Impl::warn(const std::string& warning) const {
  if (options.on_status) options.on_status(warning);
}

bool GraphClient::Impl::is_own(const Gid& gid) const {
  return is_same_participant(gid, participant->gid());
}

bool GraphClient::Impl::is_complete() const {
  const auto known = [](const GraphEndpoint& end) { return !end.node.ends_with(kUnknownNode); };
  for (const GraphTopic& topic : graph->topics()) {
    if (!std::ranges::all_of(topic.publishers, known) || !std::ranges::all_of(topic.subscriptions, known))
      return false;
  }
  const auto served = [&](const GraphService& s) { return std::ranges::all_of(s.servers, known); };
  const auto has_nodes = [&](const ParticipantInfo& one) {
    const auto& nodes = graph->nodes();
    return one.enclave.empty() || std::ranges::find(nodes, one.gid, &GraphNode::participant) != nodes.end();
  };
  const std::vector<ParticipantInfo> there = participant->participants();
  return std::ranges::all_of(graph->services(), served) && std::ranges::all_of(there, has_nodes);
}

bool GraphClient::Impl::is_alone() const {
  const std::vector<ParticipantInfo> known = participant->participants();
  return std::ranges::all_of(known, [this](const ParticipantInfo& one) { return is_own(one.gid); });
}

void GraphClient::Impl::discover() {
  const auto begin = Clock::now();
  changed_at = begin;
  const auto settled = [&] {
    if (options.spin_time) return false;
    const auto now = Clock::now();
    if (is_alone()) return now - begin > kMaxDiscoveryTime;
    return is_complete() && (now - changed_at > kSettleTime || now - begin > kMaxDiscoveryTime);
  };
  wait(settled, begin + options.spin_time.value_or(kMaxIncompleteTime));
  if (const auto distro = distro_of_peers(graph->topics(), graph->services(), participant->gid()))
    adopt_ros_distro(*distro);
  if (is_alone()) {
    warn(fmt::format(
        "no participant answers in ROS 2 domain {}, range {} (ROS_DOMAIN_ID, ROS_AUTOMATIC_DISCOVERY_RANGE)",
        options.network.domain, to_string(options.network.range)));
  }
}

// Handles received samples until the condition holds, or the time is over (false).
bool GraphClient::Impl::wait(const std::function<bool()>& condition, Clock::time_point until) {
  while (!condition()) {
    if (options.interrupted && options.interrupted()) throw Interrupted();
    const auto now = Clock::now();
    if (now >= until) return false;
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - now);
    pollfd waiting{wake.get(), POLLIN, 0};
    poll(&waiting, 1, static_cast<int>(std::min<std::chrono::milliseconds>(left, kInterruptCheck).count()));
    turn();
  }
  return true;
}

void GraphClient::Impl::turn() {
  drain(wake.get());
  if (graph->update()) {
    changed_at = Clock::now();
    rebuild();
  }
  Sample sample;
  for (auto& [topic, subscription] : subscriptions) {
    while (subscription.reader->take(sample))
      keep({topic, subscription.type, time_from_nanoseconds(sample.source_timestamp), sample.cdr});
  }
  take_replies();
}

// The endpoints of ros2cli's own nodes and of this node are left out.
void GraphClient::Impl::rebuild() {
  topics.clear();
  services.clear();
  for (const GraphTopic& topic : graph->topics()) {
    Topic entry;
    const auto fill = [&](const std::vector<GraphEndpoint>& ends, std::vector<std::string>& nodes,
                          std::vector<Endpoint>& details) {
      for (const GraphEndpoint& end : ends) {
        if (is_own(end.gid)) continue;
        if (entry.type.empty()) entry.type = end.type;
        nodes.push_back(end.node);
        details.push_back(endpoint_of(end));
      }
    };
    fill(topic.publishers, entry.publishers, entry.publisher_ends);
    fill(topic.subscriptions, entry.subscribers, entry.subscriber_ends);
    if (!entry.publishers.empty() || !entry.subscribers.empty()) topics.emplace(topic.name, std::move(entry));
  }
  for (const GraphService& service : graph->services()) {
    Service entry;
    for (const GraphEndpoint& server : service.servers) {
      if (is_own(server.gid)) continue;
      if (entry.type.empty()) entry.type = server.type;
      entry.providers.push_back(server.node);
    }
    for (const GraphEndpoint& client : service.clients) {
      if (!is_own(client.gid)) entry.clients.push_back(client.node);
    }
    const auto fill = [this](const std::vector<GraphEndpoint>& ends, std::vector<Endpoint>& details) {
      for (const GraphEndpoint& end : ends) {
        if (!is_own(end.gid)) details.push_back(endpoint_of(end));
      }
    };
    fill(service.servers, entry.server_ends);
    fill(service.reply_servers, entry.server_ends);
    fill(service.clients, entry.client_ends);
    fill(service.reply_clients, entry.client_ends);
    if (!entry.providers.empty()) services.emplace(service.name, std::move(entry));
  }
  warn_of_incompatible_publishers();
}

// Announces the endpoints of this node.
void GraphClient::Impl::announce() {
  OwnNode node{.name = node_name, .readers = {}, .writers = {}};
  for (const auto& [topic, subscription] : subscriptions) node.readers.push_back(subscription.reader->gid());
  for (const auto& [key, writer] : writers) node.writers.push_back(writer->gid());
  for (const auto& [name, client] : clients) {
    node.writers.push_back(client->requests().gid());
    node.readers.push_back(client->replies().gid());
  }
  graph->set_own_nodes({std::move(node)});
}

GraphClient::GraphClient(GraphClientOptions options, const MakeParticipant& make)
    : impl_(std::make_unique<Impl>(std::move(options), make)) {}
GraphClient::~GraphClient() = default;

ReceiveBuffer& GraphClient::buffer() const {
  return *impl_;
}
void GraphClient::warn(const std::string& text) const {
  impl_->warn(text);
}

std::vector<std::string> GraphClient::nodes() {
  std::vector<std::string> names;
  for (const GraphNode& node : impl_->graph->nodes()) {
    if (node.participant != impl_->participant->gid()) names.push_back(node.name);
  }
  std::ranges::sort(names);
  return names;
}

bool GraphClient::wait_until(const std::function<bool()>& condition,
                             std::chrono::steady_clock::time_point until) {
  return impl_->wait(condition, until);
}

}  // namespace doppel::ros2
