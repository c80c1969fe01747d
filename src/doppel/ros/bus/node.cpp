#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "doppel/ros/bus/detail/bus_impl.h"

namespace doppel {

Node::Node(Bus& bus, std::string_view name) : bus_(bus), given_name_(name), name_(bus.names().node(name)) {
  if (!name.starts_with('/'))
    throw std::logic_error(fmt::format("node name '{}' needs its leading slash", name));
  const std::lock_guard lock(bus_.impl_->mutex);
  bus_.impl_->nodes.push_back(this);
  bus_.impl_->graph_changed();
}

Node::~Node() {
  bus_.impl_->remove_owner(this);
}

std::shared_ptr<bus_detail::Topic> Node::advertise_topic(std::string_view name,
                                                         const bus_detail::TopicOps& ops, Qos qos) {
  Bus::Impl& impl = *bus_.impl_;
  auto topic = impl.topic_for_node(bus_.names().resolve(NameKind::topic, name, name_), ops, name_);
  impl.advertise(*topic, {this, {name_, "", qos}});
  return topic;
}

void Node::subscribe_topic(std::string_view name, const bus_detail::TopicOps& ops,
                           std::function<void(const void*)> callback, Qos qos) {
  Bus::Impl& impl = *bus_.impl_;
  const auto held = impl.topic_for_node(bus_.names().resolve(NameKind::topic, name, name_), ops, name_);
  bus_detail::Topic& topic = *held;
  auto shared = std::make_shared<std::function<void(const void*)>>(std::move(callback));
  topic.locals.push_back({this, shared});
  impl.add_endpoint(topic, false, {this, {name_, "", qos}});
  std::vector<std::shared_ptr<const void>> kept;  // complete before a callback may change the publishers
  for (const bus_detail::Endpoint* publisher : bus_detail::latched_messages(topic, 0)) {
    std::shared_ptr<const void> last;
    if (ops.decode(publisher->last, last)) kept.push_back(std::move(last));
  }
  for (const auto& last : kept) (*shared)(last.get());
}

void Node::serve_entry(std::string_view name, bus_detail::ServiceEntry entry) {
  Bus::Impl& impl = *bus_.impl_;
  register_service(*entry.support);
  entry.name = bus_.names().resolve(NameKind::service, name, name_);
  entry.node = this;
  std::shared_ptr<const bus_detail::ServiceEntry> replaced;  // freed outside the lock
  std::shared_ptr<const bus_detail::ServiceEntry> offered;
  {
    const std::lock_guard lock(impl.mutex);
    auto& slot = impl.services[entry.name];
    if (slot != nullptr && slot->node != this) {
      throw std::logic_error(
          fmt::format("service {} is already offered by node {}; node {} cannot offer it too", entry.name,
                      slot->node->name(), name_));
    }
    replaced = slot;
    entry.id = impl.next_service++;
    offered = slot = std::make_shared<const bus_detail::ServiceEntry>(std::move(entry));
    impl.graph_changed();
  }
  if (bus_.service_events() != ServiceEvents::off) impl.offer_events(*offered);
}

}  // namespace doppel
