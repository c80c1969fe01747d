#include "doppel/ros/bus/bus.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "doppel/base/core/thrown.h"
#include "doppel/ros/bus/detail/bus_impl.h"
#include "doppel/ros/bus/topic_conflict.h"
#include "doppel/ros/bus/twist_conversion.h"

namespace doppel {
namespace bus_detail {
namespace {

// Sends a message to one link, or copies it from the first to the others: it is encoded once, directly
// into a ring.
void write_to_links(Topic& topic, const void* message, Time stamp, const EdgeLink* from) {
  const std::size_t size = topic.ops->size(message);
  std::span<const std::byte> encoded;
  for (const auto& link : topic.links) {
    if (!link->wants_from(from)) continue;
    const auto room = link->begin(stamp, size, {.topic = topic.id, .sequence = topic.sequence});
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

// The latched publisher of a node or, behind an edge, of that name; nullptr: it is not latched, or has gone.
Endpoint* latched_publisher(Topic& topic, const void* owner, const std::string* name = nullptr) {
  const auto found = std::ranges::find_if(topic.publishers, [&](const Endpoint& e) {
    return e.latched && e.owner == owner && (name == nullptr || e.info.node == *name);
  });
  return found == topic.publishers.end() ? nullptr : &*found;
}

void keep_cdr(Topic& topic, Endpoint& publisher, std::span<const std::byte> cdr, Time stamp) {
  publisher.last.assign(cdr.begin(), cdr.end());
  publisher.last_stamp = stamp;
  publisher.last_sequence = topic.sequence + 1;
}

// Another robot's program may have the same names: a client would see a mixture of both.
bool is_foreign(const Topic& topic, const EdgeLink* sender) {
  return sender != nullptr && sender->is_network() &&
         std::ranges::any_of(topic.publishers, &Endpoint::is_node);
}

}  // namespace

void keep(Topic& topic, const Node* sender, const void* message, Time stamp) {
  Endpoint* const publisher = latched_publisher(topic, sender);
  if (publisher == nullptr) return;
  publisher->last.resize(topic.ops->size(message));
  topic.ops->write(message, publisher->last);
  publisher->last_stamp = stamp;
  publisher->last_sequence = topic.sequence + 1;
}

void keep_encoded(Topic& topic, const Node* sender, const Bytes& cdr, Time stamp) {
  if (Endpoint* const publisher = latched_publisher(topic, sender)) keep_cdr(topic, *publisher, cdr, stamp);
}

std::vector<const Endpoint*> latched_messages(const Topic& topic, std::uint32_t after) {
  std::vector<const Endpoint*> kept;
  for (const Endpoint& publisher : topic.publishers) {
    if (!publisher.last.empty() && publisher.last_sequence > after) kept.push_back(&publisher);
  }
  std::ranges::sort(kept, {}, &Endpoint::last_sequence);
  return kept;
}

// Edges first, so that they get a message before those that its subscribers publish in response.
void deliver(Topic& topic, const void* message, Time stamp, const EdgeLink* from) {
  if (!is_foreign(topic, from)) {
    ++topic.sequence;
    if (!topic.links.empty()) write_to_links(topic, message, stamp, from);
  }
  if (!topic.locals.empty()) deliver_locally(topic, message);
}

void deliver_encoded(Topic& topic, const std::shared_ptr<const Bytes>& cdr, Time stamp) {
  ++topic.sequence;
  for (const auto& link : topic.links) link->push_shared(topic, stamp, cdr);
  if (topic.locals.empty()) return;
  std::shared_ptr<const void> message;
  if (topic.ops->decode(*cdr, message).ok()) deliver_locally(topic, message.get());
}

}  // namespace bus_detail

using bus_detail::Endpoint;
using bus_detail::Topic;

std::shared_ptr<Topic> Bus::Impl::make_topic(const std::string& name, const TypeSupport& support) {
  auto topic = std::make_shared<Topic>();
  topic->report = &report;
  topic->id = next_topic++;
  topic->name = name;
  topic->support = &support;
  by_name[name] = topic;
  topics[topic->id] = topic;
  return topic;
}

void Bus::Impl::free_if_unused(TopicId id) {
  const auto found = topics.find(id);
  if (found == topics.end() || before_stage != nullptr) return;
  const Topic& topic = *found->second;
  if (is_listed(topic) || topic.delivering > 0 || !topic.links.empty() || !topic.locals.empty()) return;
  const auto named = by_name.find(topic.name);
  const bool is_present = named != by_name.end() && named->second == found->second;
  if (found->second.use_count() > (is_present ? 2 : 1)) return;  // a publisher may outlive its node
  if (is_present) by_name.erase(named);
  topics.erase(found);
}

// An edge's type of a topic is replaced if a node uses another one, because external messages must not
// prevent a node.
std::shared_ptr<Topic> Bus::Impl::topic_for_node(const std::string& name, const bus_detail::TopicOps& ops,
                                                 const std::string& node) {
  const TypeSupport& support = ops.support();
  register_type(support);
  const std::lock_guard lock(mutex);
  const auto found = by_name.find(name);
  std::shared_ptr<Topic> topic = found == by_name.end() ? nullptr : found->second;
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
  if (topic == nullptr) topic = make_topic(name, support);
  topic->ops = &ops;
  return topic;
}

std::shared_ptr<Topic> Bus::Impl::topic_for_edge(const std::string& name, const TypeSupport& support) {
  const std::lock_guard lock(mutex);
  const auto found = by_name.find(name);
  if (found == by_name.end()) return make_topic(name, support);
  if (found->second->support->name == support.name) return found->second;
  if (is_listed(*found->second)) return nullptr;
  return make_topic(name, support);
}

template <class Change>
void Bus::Impl::change_endpoints(Topic& topic, Change change) {
  const std::size_t before = topic.publishers.size() + topic.subscribers.size();
  change();
  topic.latched = std::ranges::any_of(topic.publishers, &Endpoint::latched);
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
  const auto found = std::ranges::find_if(endpoints, [&endpoint](const Endpoint& e) {
    return e.owner == endpoint.owner && e.info.node == endpoint.info.node;
  });
  const bool latched = endpoint.latched;
  change_endpoints(topic, [&] {
    Endpoint& kept = found == endpoints.end() ? endpoints.emplace_back(std::move(endpoint)) : *found;
    kept.latched = kept.latched || latched;
  });
}

void Bus::Impl::advertise(Topic& topic, Endpoint publisher) {
  publisher.latched = publisher.info.qos.latched;
  add_endpoint(topic, true, std::move(publisher));
}

void Bus::Impl::subscribe_link(TopicId id, const std::shared_ptr<bus_detail::EdgeLink>& link) {
  const auto found = topics.find(id);
  if (found == topics.end() || !link->is_wanted(id) || link->is_removed()) return;
  const std::shared_ptr<Topic> topic = found->second;
  if (std::ranges::find(topic->links, link) == topic->links.end()) {
    topic->links.push_back(link);
    if (link->is_listed()) {
      add_endpoint(*topic, false, {link.get(), {link->name(), link->name(), {}}});
    } else {
      const std::lock_guard lock(mutex);
      update_wanted(*topic);
    }
  }
  deliver_last(id, link);
}

void Bus::Impl::deliver_last(TopicId id, const std::shared_ptr<bus_detail::EdgeLink>& link) {
  deliver_last_after(id, link, 0);
}

// A latched message that finds the ring full is sent again at the next step, because it is published only
// once. Their numbers end with the newest one of the topic, so that no reader finds a gap.
void Bus::Impl::deliver_last_after(TopicId id, const std::shared_ptr<bus_detail::EdgeLink>& link,
                                   std::uint32_t after) {
  const auto found = topics.find(id);
  if (found == topics.end()) return;
  const Topic& topic = *found->second;
  if (std::ranges::find(topic.links, link) == topic.links.end()) return;
  std::vector<const Endpoint*> kept = bus_detail::latched_messages(topic, after);
  std::erase_if(kept, [&link](const Endpoint* publisher) {
    return !link->wants_from(publisher->owner) || !link->fits_in_ring(publisher->last.size());
  });
  auto left = static_cast<std::uint32_t>(kept.size());
  for (const Endpoint* const publisher : kept) {
    const Bytes& last = publisher->last;
    const auto room =
        link->begin(publisher->last_stamp, last.size(),
                    {.topic = topic.id, .sequence = topic.sequence - (left - 1), .latched = left});
    if (room.empty()) {
      bus.post([this, id, link, after] { deliver_last_after(id, link, after); });
      return;
    }
    std::ranges::copy(last, room.begin());
    link->commit(last.size());
    after = publisher->last_sequence;
    --left;
  }
}

void Bus::Impl::unsubscribe_link(TopicId id, const std::shared_ptr<bus_detail::EdgeLink>& link) {
  const auto found = topics.find(id);
  if (found == topics.end() || link->is_wanted(id)) return;
  Topic& topic = *found->second;
  const std::lock_guard lock(mutex);
  change_endpoints(topic, [&] {
    std::erase_if(topic.links, [&link](const auto& l) { return l == link; });
    std::erase_if(topic.subscribers, [&link](const Endpoint& e) { return e.owner == link.get(); });
  });
  free_if_unused(id);
}

void Bus::Impl::remove_publisher(const std::string& topic, const void* owner, const std::string& node) {
  const std::lock_guard lock(mutex);
  const auto found = by_name.find(topic);
  if (found == by_name.end()) return;
  const TopicId id = found->second->id;
  Topic& left = *found->second;
  change_endpoints(left, [&] {
    std::erase_if(left.publishers,
                  [&](const Endpoint& e) { return e.owner == owner && e.info.node == node; });
  });
  free_if_unused(id);
}

void Bus::Impl::remove_owner(const void* owner) {
  // Handlers are destroyed outside of the lock, because destructors of their captures may call the bus.
  std::vector<std::shared_ptr<const void>> garbage;
  const std::lock_guard lock(mutex);
  const auto owned = [owner](const Endpoint& e) { return e.owner == owner; };
  std::vector<TopicId> unused;  // also those whose publishers have outlived an earlier owner
  for (const auto& entry : topics) {
    const auto& topic = entry.second;
    const bool is_link =
        std::ranges::any_of(topic->links, [owner](const auto& link) { return link.get() == owner; });
    if (is_link || std::ranges::any_of(topic->publishers, owned) ||
        std::ranges::any_of(topic->subscribers, owned)) {
      change_endpoints(*topic, [&] {
        std::erase_if(topic->publishers, owned);
        std::erase_if(topic->subscribers, owned);
        std::erase_if(topic->links, [owner](const auto& link) { return link.get() == owner; });
        for (auto& local : topic->locals) {
          if (local.node == owner) garbage.push_back(std::exchange(local.callback, nullptr));
        }
        if (topic->delivering == 0)
          std::erase_if(topic->locals, [](const auto& local) { return !local.callback; });
      });
    }
    if (!is_listed(*topic)) unused.push_back(entry.first);
  }
  for (const TopicId id : unused) free_if_unused(id);
  for (const auto& [name, entry] : services) {
    if (entry->node == owner) garbage.push_back(entry);
  }
  const std::size_t gone =
      std::erase_if(services, [owner](const auto& s) { return s.second->node == owner; }) +
      std::erase_if(nodes, [owner](const Node* node) { return node == owner; });
  for (std::size_t i = 0; i < gone; ++i) graph_changed();
}

void Bus::Impl::keep(Topic& topic, const bus_detail::EdgeLink* sender, const std::string& node,
                     std::span<const std::byte> cdr) {
  if (Endpoint* const publisher = bus_detail::latched_publisher(topic, sender, &node))
    bus_detail::keep_cdr(topic, *publisher, cdr, bus.now());
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
  ++topic.sequence;
  for (const auto& link : topic.links) {
    if (!link->wants_from(from)) continue;
    const auto room = link->begin(bus.now(), cdr.size(), {.topic = topic.id, .sequence = topic.sequence});
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

Edge::SharedParameters Bus::Impl::all_parameters() {
  const std::uint64_t graph = bus.graph_version(), changes = Parameters::changes();
  if (parameters_ == nullptr || graph != graph_of_parameters_ || changes != changes_of_parameters_) {
    auto all = std::make_shared<std::vector<NamedParameter>>();
    for (Node* node : nodes) {
      for (const auto& declared : node->parameters().all())
        all->push_back({node->name(), declared.name, declared.value});
    }
    parameters_ = std::move(all);
    graph_of_parameters_ = graph;
    changes_of_parameters_ = changes;
  }
  return parameters_;
}

Bus::Bus(BusOptions options)
    : names_(std::move(options.names)),
      sim_time_(options.sim_time),
      twists_(options.twists),
      impl_(std::make_unique<Impl>(*this, std::move(options))) {}
Bus::~Bus() = default;

std::size_t Bus::run_tasks() {
  if (edge_share_ <= 0) return inbox_.run();
  // Unused time is not saved up, so that a burst of requests delays no step by more than the former; and a
  // request that took long delays the others no longer than the latter.
  constexpr std::chrono::milliseconds kMaxUnused{2}, kMaxDelay{50};
  const auto share = [this](std::chrono::nanoseconds time) {
    return std::chrono::nanoseconds(
        static_cast<std::int64_t>(edge_share_ * static_cast<double>(time.count())));
  };
  const auto now = std::chrono::steady_clock::now();
  const auto since = std::min<std::chrono::nanoseconds>(now - allowed_until_, kMaxUnused + kMaxDelay);
  allowed_until_ = now;
  allowance_ = std::clamp(allowance_ + share(since), -share(kMaxDelay), share(kMaxUnused));
  return inbox_.run(&allowance_);
}

void Bus::complete(std::string work, Inbox::Task task) {
  const auto outcome = [this, work, task = std::move(task)] {
    report_input({BusInput::Kind::outcome, "", work, "", {}});
    task();
  };
  {
    const std::lock_guard lock(impl_->outcomes_mutex);
    if (impl_->holds_outcomes) {
      impl_->outcomes.emplace(work, outcome);
      impl_->outcome_came.notify_all();
      return;
    }
  }
  post(outcome);
}

void Bus::hold_outcomes() {
  const std::lock_guard lock(impl_->outcomes_mutex);
  impl_->holds_outcomes = true;
}

bool Bus::run_outcome(const std::string& work, std::chrono::milliseconds at_most) {
  Inbox::Task task;
  {
    std::unique_lock lock(impl_->outcomes_mutex);
    const auto has_come = [&] { return impl_->outcomes.contains(work); };
    if (!impl_->outcome_came.wait_for(lock, at_most, has_come)) return false;
    const auto found = impl_->outcomes.find(work);
    task = std::move(found->second);
    impl_->outcomes.erase(found);
  }
  task();
  return true;
}

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
    infos.push_back({entry->id, name, entry->support->name, entry->node->name(), entry->node->is_yielding()});
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
