#include <algorithm>

#include "doppel/ros/server/hub.h"

// The bus's graph in the Foxglove protocol: channels, services and their nodes; the clock.

namespace doppel {
namespace {

constexpr std::uint64_t kTicksPerGraph = 2, kTicksPerParameters = 5;
constexpr std::size_t kMaxGraphsPerTick = 4;  // comparisons with the bus, for requests of clients

foxglove::Channel describe(const TopicInfo& topic) {
  const TypeSupport* type = find_type(topic.type);
  return {
      .id = topic.id, .topic = topic.name, .schema_name = topic.type, .schema = type ? type->schema() : ""};
}

foxglove::ServiceOffer describe(const ServiceInfo& service, const ServiceSupport& support) {
  return {.id = service.id,
          .name = service.name,
          .type = service.type,
          .request_schema = support.request->schema(),
          .response_schema = support.response->schema()};
}

using Endpoints = std::map<std::string, std::vector<std::string>>;

// The entries of `now` that are new or different from `before`.
std::vector<foxglove::NamedIds> changes(const Endpoints& before, const Endpoints& now) {
  std::vector<foxglove::NamedIds> out;
  for (const auto& [name, ids] : now) {
    const auto found = before.find(name);
    if (found == before.end() || found->second != ids) out.push_back({name, ids});
  }
  return out;
}

// Names that have lost their last owner, but still exist in another list.
void add_emptied(const Endpoints& before, const Endpoints& now, std::vector<foxglove::NamedIds>& out) {
  for (const auto& [name, ids] : before) {
    if (!now.contains(name)) out.push_back({name, {}});
  }
}

}  // namespace

void Hub::broadcast(std::string text) {
  const OutgoingFrame frame = make_frame(std::move(text));
  for (auto& [id, client] : clients_) client.link->send(frame);
}

void Hub::refresh_offers() {
  const std::uint64_t version =
      bus_.graph_version();  // read first, so that later changes are found next time
  if (version == seen_version_) return;
  seen_version_ = version;
  refresh_channels();
  refresh_services();
}

void Hub::refresh_channels() {
  for (auto& [id, channel] : channels_) channel.seen = false;
  foxglove::Channels added;
  for (const TopicInfo& topic : bus_.topics()) {
    const auto [entry, is_new] = channels_.try_emplace(topic.id);
    entry->second.seen = true;
    entry->second.latched = topic.latched;
    if (!is_new) continue;
    entry->second.offer = describe(topic);
    added.channels.push_back(entry->second.offer);
  }
  foxglove::RemovedChannels removed;
  for (auto& [id, channel] : channels_) {
    if (channel.seen) continue;
    removed.ids.push_back(id);
    for (const auto& [client, subscription] : channel.subscribers)
      clients_.at(client).subscriptions.erase(subscription);
    if (channel.from_bus) edge_->unsubscribe(id);
    if (id == clock_) clock_ = 0;
  }
  std::erase_if(channels_, [](const auto& channel) { return !channel.second.seen; });
  if (!removed.ids.empty()) broadcast(foxglove::to_frame(removed));
  if (!added.channels.empty()) broadcast(foxglove::to_frame(added));
  foxglove::Channels all;
  for (const auto& [id, channel] : channels_) all.channels.push_back(channel.offer);
  channels_frame_ = make_frame(foxglove::to_frame(all));
}

void Hub::refresh_services() {
  for (auto& [id, service] : services_) service.seen = false;
  foxglove::Services added;
  for (const ServiceInfo& info : bus_.services()) {
    const auto [entry, is_new] = services_.try_emplace(info.id);
    entry->second.seen = true;
    if (!is_new) continue;
    entry->second.support = find_service(info.type);  // the bus registers the types of all services
    entry->second.offer = describe(info, *entry->second.support);
    added.services.push_back(entry->second.offer);
  }
  foxglove::RemovedServices removed;
  for (const auto& [id, service] : services_) {
    if (!service.seen) removed.ids.push_back(id);
  }
  std::erase_if(services_, [](const auto& service) { return !service.second.seen; });
  if (!removed.ids.empty()) broadcast(foxglove::to_frame(removed));
  if (!added.services.empty()) broadcast(foxglove::to_frame(added));
  foxglove::Services all;
  for (const auto& [id, service] : services_) all.services.push_back(service.offer);
  services_frame_ = make_frame(foxglove::to_frame(all));
}

// The server itself is not a participant: its clients represent it.
Hub::Graph Hub::read_graph() const {
  Graph graph;
  const auto names = [](const std::vector<EndpointInfo>& endpoints) {
    std::vector<std::string> others;
    for (const EndpointInfo& endpoint : endpoints) {
      if (endpoint.edge != kEdgeName) others.push_back(endpoint.node);
    }
    return others;
  };
  for (const TopicInfo& topic : bus_.topics()) {
    graph.published[topic.name] = names(topic.publishers);
    graph.subscribed[topic.name] = names(topic.subscribers);
  }
  for (const auto& [id, client] : clients_) {
    for (const auto& [channel_id, channel] : client.advertised)
      graph.published[channel.topic].push_back(client.node);
    for (const auto& [subscription, channel] : client.subscriptions) {
      graph.subscribed[channels_.at(channel).offer.topic].push_back(client.node);
    }
  }
  for (const ServiceInfo& service : bus_.services()) graph.services[service.name].push_back(service.node);
  std::erase_if(graph.published, [](const auto& entry) { return entry.second.empty(); });
  std::erase_if(graph.subscribed, [](const auto& entry) { return entry.second.empty(); });
  return graph;
}

void Hub::refresh_graph() {
  Graph now = read_graph();
  foxglove::GraphUpdate update;
  update.published = changes(graph_.published, now.published);
  update.subscribed = changes(graph_.subscribed, now.subscribed);
  update.services = changes(graph_.services, now.services);
  add_emptied(graph_.published, now.published, update.published);
  add_emptied(graph_.subscribed, now.subscribed, update.subscribed);
  for (const auto* endpoints : {&graph_.published, &graph_.subscribed}) {
    for (const auto& [name, ids] : *endpoints) {
      if (!now.published.contains(name) && !now.subscribed.contains(name))
        update.removed_topics.push_back(name);
    }
  }
  for (const auto& [name, ids] : graph_.services) {
    if (!now.services.contains(name)) update.removed_services.push_back(name);
  }
  graph_ = std::move(now);
  graph_frame_ = {};
  const bool changed = !update.published.empty() || !update.subscribed.empty() || !update.services.empty() ||
                       !update.removed_services.empty();
  if (!changed) return;
  const OutgoingFrame frame = make_frame(foxglove::to_frame(update));
  for (auto& [id, client] : clients_) {
    if (client.watches_graph) client.link->send(frame);
  }
}

void Hub::handle(Client& client, ClientId, const foxglove::WatchGraph& watch) {
  client.watches_graph = client.waits_for_graph = false;
  if (!watch.on) return;
  if (++graphs_ > kMaxGraphsPerTick) {  // many requests at once are answered by the next tick
    client.waits_for_graph = true;
    return;
  }
  refresh_offers();
  refresh_graph();  // for the others; the new client gets the whole graph
  send_graph(client);
}

void Hub::send_graph(Client& client) {
  if (graph_frame_.size() == 0) {
    foxglove::GraphUpdate all;
    all.published = changes({}, graph_.published);
    all.subscribed = changes({}, graph_.subscribed);
    all.services = changes({}, graph_.services);
    graph_frame_ = make_frame(foxglove::to_frame(all));
  }
  client.link->send(graph_frame_);
  client.watches_graph = true;
  client.waits_for_graph = false;
}

void Hub::subscribe_on_bus(std::uint32_t id, ChannelState& channel) {
  if (std::exchange(channel.from_bus, true)) return;
  edge_->subscribe(id);
}

// A client that subscribes and unsubscribes continuously costs the loop no more than two requests a tick.
void Hub::end_unused_subscriptions() {
  for (auto& [id, channel] : channels_) {
    if (!channel.from_bus || id == clock_ || !channel.subscribers.empty()) continue;
    channel.from_bus = channel.asks_at_tick = false;
    edge_->unsubscribe(id);
  }
}

// The bus sends the latched messages once more. However many clients come, a tick has two requests at most.
void Hub::ask_for_latched(std::uint32_t id, ChannelState& channel) {
  channel.asks_at_tick = std::exchange(channel.has_asked, true);
  if (!channel.asks_at_tick) edge_->subscribe(id);
}

// Subscribes to the clock while a client is subscribed to any topic: without subscribers the loop does
// not publish it.
void Hub::follow_clock() {
  const bool wanted =
      std::ranges::any_of(clients_, [](const auto& client) { return !client.second.subscriptions.empty(); });
  if (wanted == (clock_ != 0)) return;
  if (!wanted) {
    clock_ = 0;
    return;
  }
  const auto found = std::ranges::find_if(
      channels_, [](const auto& channel) { return channel.second.offer.topic == "/clock"; });
  if (found == channels_.end()) return;
  clock_ = found->first;
  subscribe_on_bus(clock_, found->second);
}

void Hub::send_time() {
  if (now_ == time_sent_) return;
  time_sent_ = now_;
  OutgoingFrame frame = make_frame(foxglove::to_frame(foxglove::TimeMessage{now_}));
  frame.kind = OutgoingFrame::Kind::message;
  for (auto& [id, client] : clients_) {
    if (!client.subscriptions.empty()) client.link->send(frame);
  }
}

void Hub::tick() {
  ++ticks_;
  graphs_ = 0;
  for (auto& [id, client] : clients_) client.messages = 0;
  refresh_offers();
  follow_clock();
  end_unused_subscriptions();
  for (auto& [id, channel] : channels_) {
    channel.has_asked = false;
    if (std::exchange(channel.asks_at_tick, false)) ask_for_latched(id, channel);
  }
  send_time();
  const auto watches = [](const auto& client) { return client.second.watches_graph; };
  const auto waits = [](const auto& client) { return client.second.waits_for_graph; };
  const bool waited_for = std::ranges::any_of(clients_, waits);
  if (waited_for || (std::ranges::any_of(clients_, watches) && ticks_ % kTicksPerGraph == 0)) refresh_graph();
  for (auto& [id, client] : clients_) {
    if (client.waits_for_graph) send_graph(client);
  }
  if (poll_again_ || ticks_ % kTicksPerParameters == 0) poll_parameters();
}

}  // namespace doppel
