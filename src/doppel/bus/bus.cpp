#include "doppel/bus/bus.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "doppel/bus/detail/bus_impl.h"
#include "doppel/bus/topic_conflict.h"
#include "doppel/bus/twist_conversion.h"
#include "doppel/core/thrown.h"

namespace doppel {
namespace bus_detail {
namespace {

// Sends a message to one link, or copies it from the first to the others: it is encoded once, directly
// into a ring.
void write_to_links(Topic& topic, const void* message, Time stamp, const EdgeLink* from) {
  const std::size_t size = topic.ops->size(message);
  std::span<const std::byte> encoded;
  if (topic.latched) {
    topic.last.resize(size);
    topic.ops->write(message, topic.last);
    topic.last_stamp = stamp;
    topic.last_from = from;
    encoded = topic.last;
  }
  for (const auto& link : topic.links) {
    if (!link->wants_from(from)) continue;
    const auto room = link->begin(topic, stamp, size);
    if (room.empty()) continue;
    if (encoded.empty()) {
      topic.ops->write(message, room);
    } else {
      std::memcpy(room.data(), encoded.data(), size);
    }
    encoded = room;  // only this thread writes to rings, so the bytes stay until this link's next message
    link->commit(size);
  }
}

void report_failure(Topic& topic, const std::string& why) {
  if (topic.has_failed) return;
  topic.has_failed = true;
  (*topic.report)("a subscriber of " + topic.name +
                  " failed; further failures of it are not reported: " + why);
}

void deliver_locally(Topic& topic, const void* message) {
  ++topic.delivering;
  for (std::size_t i = 0; i < topic.locals.size(); ++i) {
    const auto callback = topic.locals[i].callback;  // a copy, because the callback may destroy its own node
    if (!callback) continue;
    if (!*topic.report) {
      (*callback)(message);
      continue;
    }
    try {
      (*callback)(message);
    } catch (...) {
      report_failure(topic, thrown_text());
    }
  }
  --topic.delivering;
  if (topic.delivering > 0) return;
  std::erase_if(topic.locals, [](const LocalSubscriber& local) { return !local.callback; });
}

}  // namespace

// Edges first, so that they get a message before those that its subscribers publish in response.
void deliver(Topic& topic, const void* message, Time stamp, const EdgeLink* from) {
  if (!topic.links.empty() || topic.latched) write_to_links(topic, message, stamp, from);
  if (!topic.locals.empty()) deliver_locally(topic, message);
}

void deliver_encoded(Topic& topic, const std::shared_ptr<const Bytes>& cdr, Time stamp) {
  if (topic.latched) {
    topic.last = *cdr;
    topic.last_stamp = stamp;
    topic.last_from = nullptr;
  }
  for (const auto& link : topic.links) link->push_shared(topic, stamp, cdr);
  if (topic.locals.empty()) return;
  std::shared_ptr<const void> message;
  if (topic.ops->decode(*cdr, message).ok()) deliver_locally(topic, message.get());
}

}  // namespace bus_detail

using bus_detail::Endpoint;
using bus_detail::Topic;

Topic& Bus::Impl::make_topic(const std::string& name, const TypeSupport& support) {
  auto topic = std::make_unique<Topic>();
  topic->report = &report;
  topic->id = static_cast<TopicId>(topics.size() + 1);
  topic->name = name;
  topic->support = &support;
  by_name[name] = topic.get();
  topics.push_back(std::move(topic));
  return *topics.back();
}

// An edge's type of a topic is replaced if a node uses another one, because external messages must not
// prevent a node.
Topic& Bus::Impl::topic_for_node(const std::string& name, const bus_detail::TopicOps& ops,
                                 const std::string& node) {
  const TypeSupport& support = ops.support();
  register_type(support);
  const std::lock_guard lock(mutex);
  const auto found = by_name.find(name);
  Topic* topic = found == by_name.end() ? nullptr : found->second;
  if (topic != nullptr && topic->support->name != support.name) {
    for (const auto* endpoints : {&topic->publishers, &topic->subscribers}) {
      const auto holder = std::ranges::find_if(*endpoints, &Endpoint::is_node);
      if (holder == endpoints->end()) continue;
      throw TopicConflict(fmt::format("topic {} has type {} in node {}; node {} cannot use it with type {}",
                                      name, topic->support->name, holder->info.node, node, support.name),
                          name, std::string(support.name), std::string(topic->support->name));
    }
    if (is_listed(*topic)) graph_changed();
    topic = nullptr;
  }
  if (topic == nullptr) topic = &make_topic(name, support);
  topic->ops = &ops;
  return *topic;
}

Topic* Bus::Impl::topic_for_edge(const std::string& name, const TypeSupport& support) {
  const std::lock_guard lock(mutex);
  const auto found = by_name.find(name);
  if (found == by_name.end()) return &make_topic(name, support);
  if (found->second->support->name == support.name) return found->second;
  if (is_listed(*found->second)) return nullptr;
  return &make_topic(name, support);
}

template <class Change>
void Bus::Impl::change_endpoints(Topic& topic, Change change) {
  const std::size_t before = topic.publishers.size() + topic.subscribers.size();
  change();
  if (topic.publishers.empty()) {
    topic.latched = false;
    topic.last.clear();
  }
  update_wanted(topic);
  if (topic.publishers.size() + topic.subscribers.size() != before) graph_changed();
}

void Bus::Impl::update_wanted(Topic& topic) {
  const bool local = std::ranges::any_of(topic.locals, [](const auto& l) { return l.callback != nullptr; });
  topic.wanted.store(local || !topic.links.empty() || topic.latched, std::memory_order_relaxed);
}

void Bus::Impl::add_endpoint(Topic& topic, bool publishes, Endpoint endpoint) {
  const std::lock_guard lock(mutex);
  auto& endpoints = publishes ? topic.publishers : topic.subscribers;
  const bool known = std::ranges::any_of(endpoints, [&endpoint](const Endpoint& e) {
    return e.owner == endpoint.owner && e.info.node == endpoint.info.node;
  });
  change_endpoints(topic, [&] {
    if (!known) endpoints.push_back(std::move(endpoint));
  });
}

void Bus::Impl::subscribe_link(TopicId id, const std::shared_ptr<bus_detail::EdgeLink>& link) {
  if (id == 0 || id > topics.size()) return;
  Topic& topic = *topics[id - 1];
  if (std::ranges::find(topic.links, link) != topic.links.end()) return;
  topic.links.push_back(link);
  add_endpoint(topic, false, {link.get(), {link->name(), link->name(), {}}});
  deliver_last(topic, link);
}

// A latched message that finds the ring full is sent again at the next step, because it is
// published only once.
void Bus::Impl::deliver_last(Topic& topic, const std::shared_ptr<bus_detail::EdgeLink>& link) {
  const bool subscribed = std::ranges::find(topic.links, link) != topic.links.end();
  if (topic.last.empty() || !subscribed || !link->wants_from(topic.last_from)) return;
  const auto room = link->begin(topic, topic.last_stamp, topic.last.size());
  if (!room.empty()) {
    std::ranges::copy(topic.last, room.begin());
    link->commit(topic.last.size());
  } else if (link->fits_in_ring(topic.last.size())) {
    bus.post([this, &topic, link] { deliver_last(topic, link); });
  }
}

void Bus::Impl::unsubscribe_link(TopicId id, const bus_detail::EdgeLink* link) {
  if (id == 0 || id > topics.size()) return;
  Topic& topic = *topics[id - 1];
  const std::lock_guard lock(mutex);
  change_endpoints(topic, [&] {
    std::erase_if(topic.links, [link](const auto& l) { return l.get() == link; });
    std::erase_if(topic.subscribers, [link](const Endpoint& e) { return e.owner == link; });
  });
}

void Bus::Impl::remove_owner(const void* owner) {
  // Handlers are destroyed outside of the lock, because destructors of their captures may call the bus.
  std::vector<std::shared_ptr<const void>> garbage;
  const std::lock_guard lock(mutex);
  const auto owned = [owner](const Endpoint& e) { return e.owner == owner; };
  for (const auto& topic : topics) {
    if (std::ranges::none_of(topic->publishers, owned) && std::ranges::none_of(topic->subscribers, owned))
      continue;
    change_endpoints(*topic, [&] {
      std::erase_if(topic->publishers, owned);
      std::erase_if(topic->subscribers, owned);
      std::erase_if(topic->links, [owner](const auto& link) { return link.get() == owner; });
      if (topic->last_from == owner) topic->last_from = nullptr;
      for (auto& local : topic->locals) {
        if (local.node == owner) garbage.push_back(std::exchange(local.callback, nullptr));
      }
      if (topic->delivering == 0)
        std::erase_if(topic->locals, [](const auto& local) { return !local.callback; });
    });
  }
  for (const auto& [name, entry] : services) {
    if (entry->node == owner) garbage.push_back(entry);
  }
  const std::size_t gone =
      std::erase_if(services, [owner](const auto& s) { return s.second->node == owner; }) +
      std::erase_if(nodes, [owner](const Node* node) { return node == owner; });
  for (std::size_t i = 0; i < gone; ++i) graph_changed();
}

void Bus::Impl::receive(Topic& topic, std::span<const std::byte> cdr, std::shared_ptr<const void> message,
                        const bus_detail::EdgeLink* from) {
  topic.received.fetch_add(1, std::memory_order_relaxed);
  if (!topic.wanted.load(std::memory_order_relaxed)) return;
  if (topic.ops != nullptr) {  // a node may have used the topic since the edge's check
    if (message != nullptr || topic.ops->decode(cdr, message))
      bus_detail::deliver(topic, message.get(), bus.now(), from);
    return;
  }
  for (const auto& link : topic.links) {
    if (!link->wants_from(from)) continue;
    const auto room = link->begin(topic, bus.now(), cdr.size());
    if (room.empty()) continue;
    std::ranges::copy(cdr, room.begin());
    link->commit(cdr.size());
  }
}

void Bus::Impl::explain_twist(const std::string& who, const std::string& topic, std::string_view came) {
  constexpr std::size_t kMaxAdvised = 1000;  // names are chosen by clients
  if (!advise || advised.size() >= kMaxAdvised || !advised.emplace(topic, who).second) return;
  advise(twist_conversion_text(who, topic, came, bus.twists() == TwistPolicy::explain));
}

std::shared_ptr<const bus_detail::ServiceEntry> Bus::Impl::serving(
    const std::string& name, const std::weak_ptr<const ServiceEntry>& found,
    decltype(ServiceEntry::decode) decode) const {
  if (auto entry = found.lock()) return entry;
  const auto next = services.find(name);
  return next != services.end() && next->second->decode == decode ? next->second : nullptr;
}

Node* Bus::Impl::find_node(std::string_view name, std::string_view parameter) const {
  Node* any = nullptr;
  for (Node* node : nodes) {
    if (node->name() != name) continue;
    if (node->parameters().find(parameter) != nullptr) return node;
    any = node;
  }
  return any;
}

Bus::Bus(BusOptions options)
    : names_(std::move(options.names)),
      sim_time_(options.sim_time),
      twists_(options.twists),
      impl_(std::make_unique<Impl>(*this, std::move(options))) {}
Bus::~Bus() = default;

namespace {

// A node may consist of several parts; it is announced once, with the QoS of its first part.
std::vector<EndpointInfo> endpoint_infos(const std::vector<Endpoint>& endpoints) {
  std::vector<EndpointInfo> infos;
  for (const Endpoint& endpoint : endpoints) {
    const bool known = std::ranges::any_of(infos, [&endpoint](const EndpointInfo& info) {
      return info.node == endpoint.info.node && info.edge == endpoint.info.edge;
    });
    if (!known) infos.push_back(endpoint.info);
  }
  return infos;
}

std::vector<TopicInfo> topics_of(const Bus::Impl& impl) {
  std::vector<TopicInfo> infos;
  for (const auto& [name, topic] : impl.by_name) {
    if (topic->publishers.empty() && topic->subscribers.empty()) continue;
    infos.push_back({topic->id, name, topic->support->name, topic->latched, endpoint_infos(topic->publishers),
                     endpoint_infos(topic->subscribers), topic->received.load(std::memory_order_relaxed)});
  }
  return infos;
}

std::vector<ServiceInfo> services_of(const Bus::Impl& impl) {
  std::vector<ServiceInfo> infos;
  for (const auto& [name, entry] : impl.services) {
    infos.push_back({entry->id, name, entry->support->name, entry->node->name()});
  }
  return infos;
}

std::vector<std::string> nodes_of(const Bus::Impl& impl) {
  std::vector<std::string> names;
  for (const Node* node : impl.nodes) names.push_back(node->name());
  std::ranges::sort(names);
  names.erase(std::unique(names.begin(), names.end()),
              names.end());  // a node may consist of several parts
  return names;
}

}  // namespace

Bus::Impl::GraphReport Bus::Impl::graph_report() const {
  return {topics_of(*this), services_of(*this), nodes_of(*this), services};
}

std::vector<TopicInfo> Bus::topics() const {
  const std::lock_guard lock(impl_->mutex);
  const Impl::GraphReport* const before = impl_->graph_before_stage();
  return before != nullptr ? before->topics : topics_of(*impl_);
}

std::vector<ServiceInfo> Bus::services() const {
  const std::lock_guard lock(impl_->mutex);
  const Impl::GraphReport* const before = impl_->graph_before_stage();
  return before != nullptr ? before->services : services_of(*impl_);
}

std::vector<std::string> Bus::nodes() const {
  const std::lock_guard lock(impl_->mutex);
  const Impl::GraphReport* const before = impl_->graph_before_stage();
  return before != nullptr ? before->nodes : nodes_of(*impl_);
}

void Bus::each_node(const std::function<void(Node&)>& visit) const {
  const std::vector<Node*> nodes = impl_->nodes;
  for (Node* node : nodes) visit(*node);
}

std::unique_ptr<Edge> Bus::attach(std::string name, EdgeOptions options) {
  return make_edge(*this, *impl_, std::move(name), options);
}

}  // namespace doppel
