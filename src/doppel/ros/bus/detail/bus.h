#pragma once
// The typed interface of the bus over its type-erased implementation: one table of functions
// per message type.

#include <memory>
#include <utility>

#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"

namespace doppel::bus_detail {

// The functions of a message type that the bus uses.
struct DOPPEL_API TopicOps {
  const TypeSupport& (*support)();
  std::size_t (*size)(const void* message);
  void (*write)(const void* message, std::span<std::byte> out);
  Status (*decode)(std::span<const std::byte> cdr, std::shared_ptr<const void>& message);
};

template <Message M>
inline constexpr TopicOps kTopicOps{
    .support = &type_support<M>,
    .size = [](const void* message) { return cdr_size(*static_cast<const M*>(message)); },
    .write = [](const void* message,
                std::span<std::byte> out) { write_cdr(*static_cast<const M*>(message), out); },
    .decode =
        [](std::span<const std::byte> cdr, std::shared_ptr<const void>& message) {
          auto typed = std::make_shared<M>();
          Status status = from_cdr(cdr, *typed);
          message = std::move(typed);
          return status;
        },
};

class EdgeLink;

// A publisher or subscriber, by the address of its node or edge.
struct DOPPEL_API Endpoint {
  const void* owner = nullptr;
  EndpointInfo info;
  // The loop's thread only: the last message of a latched publisher, which ends with it; empty: none.
  bool latched = false;
  Bytes last{};
  Time last_stamp{};
  std::uint32_t last_sequence = 0;
  [[nodiscard]] bool is_node() const { return info.edge.empty(); }
};

struct LocalSubscriber {
  const Node* node = nullptr;
  std::shared_ptr<std::function<void(const void*)>> callback;  // empty: unsubscribed during a delivery
};

struct Topic {
  // Read by every publish(): whether there are subscribers or the last message is kept.
  std::atomic<bool> wanted{false};
  std::atomic<std::uint64_t> received{0};
  const TypeSupport* support = nullptr;

  // Changed by the loop's thread under the graph's mutex; others read under it.
  TopicId id = 0;
  std::string name;
  bool latched = false;           // by one of its publishers
  const TopicOps* ops = nullptr;  // nullptr: only edges have used the topic
  std::vector<Endpoint> publishers, subscribers;

  // The loop's thread only.
  std::vector<LocalSubscriber> locals;
  std::vector<std::shared_ptr<EdgeLink>> links;
  int delivering = 0;                                               // depth of deliver() on this topic
  const std::function<void(const std::string&)>* report = nullptr;  // BusOptions::report
  bool has_failed = false;                                          // and was reported
  std::uint32_t sequence = 0;                                       // of the newest message
};

// Keeps the next message of a node for late joiners, if the node's publisher is latched; before deliver().
// The loop's thread.
DOPPEL_API void keep(Topic& topic, const Node* sender, const void* message, Time stamp);
DOPPEL_API void keep_encoded(Topic& topic, const Node* sender, const Bytes& cdr, Time stamp);

// Delivers a message to all subscribers; the loop's thread. `from`: the edge that sent it.
DOPPEL_API void deliver(Topic& topic, const void* message, Time stamp, const EdgeLink* from = nullptr);

// The same for a message that is encoded already: edges share the bytes.
DOPPEL_API void deliver_encoded(Topic& topic, const std::shared_ptr<const Bytes>& cdr, Time stamp);

// A pending request, responded to once; if it is destroyed before, the caller gets an error.
class DOPPEL_API PendingReply {
 public:
  virtual ~PendingReply() = default;
  virtual void answer(Status status, Bytes response) = 0;
};

struct DOPPEL_API ServiceEntry {
  ServiceId id = 0;
  std::string name;
  const ServiceSupport* support = nullptr;
  const Node* node = nullptr;
  Status (*decode)(std::span<const std::byte> cdr, std::shared_ptr<const void>& request) = nullptr;
  std::function<void(const void* request, std::shared_ptr<PendingReply> reply)> handle;
};

}  // namespace doppel::bus_detail

namespace doppel {

template <Message M>
void Publisher<M>::publish(const M& message, Time stamp) const {
  if (!has_listeners()) return;
  if (topic_->latched) bus_detail::keep(*topic_, node_, &message, stamp);
  bus_detail::deliver(*topic_, &message, stamp);
}

template <Message M>
void Publisher<M>::publish_encoded(const std::shared_ptr<const Bytes>& cdr, Time stamp) const {
  if (!has_listeners()) return;
  if (topic_->latched) bus_detail::keep_encoded(*topic_, node_, *cdr, stamp);
  bus_detail::deliver_encoded(*topic_, cdr, stamp);
}

template <Message M>
bool Publisher<M>::has_listeners() const {
  return topic_ != nullptr && topic_->wanted.load(std::memory_order_relaxed);
}

template <Message M>
Publisher<M> Node::advertise(std::string_view topic, Qos qos) {
  return Publisher<M>(advertise_topic(topic, bus_detail::kTopicOps<M>, qos), this);
}

template <Message M>
void Node::subscribe(std::string_view topic, std::function<void(const M&)> callback, Qos qos) {
  subscribe_topic(
      topic, bus_detail::kTopicOps<M>,
      [call = std::move(callback)](const void* message) { call(*static_cast<const M*>(message)); }, qos);
}

template <Service S>
void Node::serve(std::string_view service,
                 std::function<void(const typename S::Request&, Responder<typename S::Response>)> handler) {
  serve_encoded<S>(service, [call = std::move(handler)](const typename S::Request& request,
                                                        const EncodedResponder& respond) {
    call(request, [respond](const typename S::Response& response) { respond(to_cdr(response)); });
  });
}

template <Service S>
void Node::serve_encoded(std::string_view service,
                         std::function<void(const typename S::Request&, EncodedResponder)> handler) {
  bus_detail::ServiceEntry entry;
  entry.support = &service_support<S>();
  entry.decode = bus_detail::kTopicOps<typename S::Request>.decode;
  entry.handle = [call = std::move(handler)](const void* request,
                                             const std::shared_ptr<bus_detail::PendingReply>& reply) {
    call(*static_cast<const typename S::Request*>(request),
         [reply](Bytes response) { reply->answer({}, std::move(response)); });
  };
  serve_entry(service, std::move(entry));
}

}  // namespace doppel
