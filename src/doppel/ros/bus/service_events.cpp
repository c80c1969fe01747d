// Service introspection: the topics <service>/_service_event of the bus's services.

#include "doppel/ros/bus/detail/bus_impl.h"
#include "doppel/ros/messages/service_event.h"
#include "doppel/ros/messages/service_msgs.h"

namespace doppel {
namespace {

using service_msgs::msg::ServiceEventInfo;

// The name is that of rcl.
std::string event_topic(const std::string& service) {
  return service + "/_service_event";
}

}  // namespace

namespace bus_detail {

class EventReply : public PendingReply {
 public:
  EventReply(Bus::Impl& impl, std::shared_ptr<const ServiceEntry> service, const CallOrigin& origin,
             std::shared_ptr<PendingReply> reply)
      : impl_(impl), service_(std::move(service)), origin_(origin), reply_(std::move(reply)) {}

  void answer(Status status, Bytes response) override {
    if (status) impl_.publish_event(*service_, ServiceEventInfo::RESPONSE_SENT, origin_, {}, response);
    reply_->answer(std::move(status), std::move(response));
  }

 private:
  Bus::Impl& impl_;
  std::shared_ptr<const ServiceEntry> service_;
  CallOrigin origin_;
  std::shared_ptr<PendingReply> reply_;  // its destructor reports a missing answer
};

}  // namespace bus_detail

void Bus::set_service_events(ServiceEvents what) {
  const ServiceEvents before = impl_->service_events.exchange(what);
  if ((before == ServiceEvents::off) == (what == ServiceEvents::off)) return;
  for (const auto& [name, service] : impl_->services) {
    if (what != ServiceEvents::off) {
      impl_->offer_events(*service);
    } else {
      impl_->remove_publisher(event_topic(name), service->node, service->node->name());
    }
  }
}

ServiceEvents Bus::service_events() const {
  return impl_->service_events.load();
}

void Bus::Impl::offer_events(const ServiceEntry& service) {
  const auto topic = topic_for_edge(event_topic(service.name), event_type(*service.support));
  if (topic != nullptr) add_endpoint(*topic, true, {service.node, {service.node->name(), "", {}}});
}

void Bus::Impl::publish_event(const ServiceEntry& service, std::uint8_t kind, const CallOrigin& origin,
                              std::span<const std::byte> request, std::span<const std::byte> response) {
  const auto found = by_name.find(event_topic(service.name));
  if (found == by_name.end() || !found->second->wanted.load(std::memory_order_relaxed)) return;
  // A client may have the name with another type.
  if (found->second->support->name != event_type(*service.support).name) return;
  ServiceEventInfo info;
  info.event_type = kind;
  info.stamp = to_time_msg(bus.ros_now());
  info.client_gid = origin.client;
  info.sequence_number = origin.sequence;
  const bool contents = service_events.load() == ServiceEvents::contents;
  const auto event = std::make_shared<Bytes>();
  const std::span<const std::byte> none;
  if (write_event(*service.support, info, contents ? request : none, contents ? response : none, *event))
    bus_detail::deliver_encoded(*found->second, event, bus.now());
}

std::shared_ptr<bus_detail::PendingReply> Bus::Impl::with_events(
    const std::shared_ptr<const ServiceEntry>& service, const CallOrigin& origin,
    std::span<const std::byte> request, std::shared_ptr<bus_detail::PendingReply> reply) {
  if (service_events.load() == ServiceEvents::off) return reply;
  publish_event(*service, ServiceEventInfo::REQUEST_RECEIVED, origin, request, {});
  return std::make_shared<bus_detail::EventReply>(*this, service, origin, std::move(reply));
}

}  // namespace doppel
