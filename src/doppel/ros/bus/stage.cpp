#include "doppel/ros/bus/stage.h"

#include <algorithm>

#include "doppel/ros/bus/detail/bus_impl.h"

namespace doppel {
namespace bus_detail {

// The nodes and edges of a topic, without its links.
struct NodesOfTopic {
  std::vector<Endpoint> publishers, subscribers;
  std::vector<LocalSubscriber> locals;
  const TopicOps* ops = nullptr;
};

}  // namespace bus_detail

namespace {

using bus_detail::Endpoint;
using bus_detail::LocalSubscriber;
using bus_detail::NodesOfTopic;
using bus_detail::Topic;

std::vector<Endpoint> of_nodes(const std::vector<Endpoint>& endpoints) {
  std::vector<Endpoint> out;
  std::ranges::copy_if(endpoints, std::back_inserter(out), &Endpoint::is_node);
  return out;
}

NodesOfTopic nodes_of(const Topic& topic) {
  return {topic.publishers, topic.subscribers, topic.locals, topic.ops};
}

template <typename T>
std::vector<T> joined(const std::vector<T>& a, const std::vector<T>& b) {
  std::vector<T> out = a;
  out.insert(out.end(), b.begin(), b.end());
  return out;
}

// Merges the state since the stage was opened.
NodesOfTopic joined(const NodesOfTopic& before, const Topic& topic) {
  NodesOfTopic out = before;
  out.publishers = joined(before.publishers, of_nodes(topic.publishers));
  out.subscribers = joined(before.subscribers, of_nodes(topic.subscribers));
  out.locals = joined(before.locals, topic.locals);
  out.ops = topic.ops;
  return out;
}

// Does not throw.
void put(NodesOfTopic& nodes, Topic& topic) {
  std::swap(topic.publishers, nodes.publishers);
  std::swap(topic.subscribers, nodes.subscribers);
  std::swap(topic.locals, nodes.locals);
  topic.ops = nodes.ops;
  topic.latched = std::ranges::any_of(topic.publishers, &Endpoint::latched);
  Bus::Impl::update_wanted(topic);
}

}  // namespace

struct BusStage::Saved {
  std::vector<std::pair<std::shared_ptr<Topic>, NodesOfTopic>> topics;
  decltype(Bus::Impl::by_name) by_name;
  decltype(Bus::Impl::services) services;
  std::vector<Node*> nodes;
};

BusStage::BusStage(Bus& bus) : bus_(bus), saved_(std::make_unique<Saved>()) {
  Bus::Impl& impl = *bus.impl_;
  const std::lock_guard lock(impl.mutex);
  std::vector<NodesOfTopic> only_edges;
  for (const auto& [id, topic] : impl.topics) {
    saved_->topics.emplace_back(topic, nodes_of(*topic));
    NodesOfTopic& rest = only_edges.emplace_back();
    rest.ops = topic->ops;
    std::ranges::remove_copy_if(topic->publishers, std::back_inserter(rest.publishers), &Endpoint::is_node);
    std::ranges::remove_copy_if(topic->subscribers, std::back_inserter(rest.subscribers), &Endpoint::is_node);
  }
  saved_->by_name = impl.by_name;
  saved_->services = impl.services;
  saved_->nodes = impl.nodes;
  impl.before_stage = std::make_unique<const Bus::Impl::GraphReport>(impl.graph_report());
  impl.stages = std::this_thread::get_id();
  for (std::size_t i = 0; i < only_edges.size(); ++i) put(only_edges[i], *saved_->topics[i].first);
  impl.services.clear();
  impl.nodes.clear();
  impl.graph_changed();
}

BusStage::~BusStage() {
  if (saved_ == nullptr) return;
  Bus::Impl& impl = *bus_.impl_;
  const std::lock_guard lock(impl.mutex);
  // No edge was added or removed meanwhile, because their requests run in spin().
  for (auto& [topic, nodes] : saved_->topics) put(nodes, *topic);
  impl.by_name.swap(saved_->by_name);
  impl.services.swap(saved_->services);
  impl.nodes.swap(saved_->nodes);
  impl.before_stage.reset();
  impl.graph_changed();
}

void BusStage::commit() {
  Bus::Impl& impl = *bus_.impl_;
  std::unique_ptr<Saved> replaced = std::make_unique<Saved>(), former;  // freed outside the lock
  std::unique_ptr<const Bus::Impl::GraphReport> graph;
  const std::lock_guard lock(impl.mutex);
  for (const auto& [topic, before] : saved_->topics)
    replaced->topics.emplace_back(topic, joined(before, *topic));
  replaced->services = impl.services;
  for (const auto& [name, entry] : saved_->services) replaced->services.try_emplace(name, entry);
  replaced->nodes = joined(saved_->nodes, impl.nodes);
  for (auto& [topic, all] : replaced->topics) put(all, *topic);
  impl.services.swap(replaced->services);
  impl.nodes.swap(replaced->nodes);
  graph = std::move(impl.before_stage);
  impl.graph_changed();
  former = std::move(saved_);
}

}  // namespace doppel
