// GraphClient's topics: readers, writers and types.

#include <algorithm>

#include "doppel/ros/client/detail/graph_client.h"
#include "doppel/ros/messages/described_type.h"
#include "doppel/ros/messages/type_description_interfaces.h"
#include "doppel/ros/network/names.h"

namespace doppel::ros2 {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kDepth = 100;  // a burst of a 1 kHz topic while this program prints
constexpr auto kMatching = 1s;

bool is_reliable(const QosProfile& qos) {
  return qos.reliability == Reliability::reliable;
}
bool is_latched(const QosProfile& qos) {
  return qos.durability == Durability::transient_local;
}
bool all_of(const std::vector<GraphEndpoint>& ends, bool (*has)(const QosProfile&)) {
  return std::ranges::all_of(ends, [&](const GraphEndpoint& end) { return has(end.qos); });
}
bool any_of(const std::vector<GraphEndpoint>& ends, bool (*has)(const QosProfile&)) {
  return std::ranges::any_of(ends, [&](const GraphEndpoint& end) { return has(end.qos); });
}

}  // namespace

// Without this node's own endpoints; a copy, because the graph changes during waits.
GraphTopic GraphClient::Impl::topic_of_others(const std::string& name) const {
  const auto& all = graph->topics();
  const auto found = std::ranges::find(all, name, &GraphTopic::name);
  GraphTopic topic;
  if (found != all.end()) topic = *found;
  const auto own = [this](const GraphEndpoint& end) { return is_own(end.gid); };
  std::erase_if(topic.publishers, own);
  std::erase_if(topic.subscriptions, own);
  return topic;
}

// Requests no more than all publishers offer, so that all match; without publishers, what any would offer.
QosProfile GraphClient::Impl::fitting(const GraphTopic& topic) const {
  QosProfile qos = sensor_data_qos();
  qos.depth = kDepth;
  if (topic.publishers.empty()) return qos;
  if (all_of(topic.publishers, is_reliable)) {
    qos.reliability = Reliability::reliable;
  } else if (any_of(topic.publishers, is_reliable)) {
    warn("some publishers of " + topic.name + " are best effort; the subscription is best effort");
  }
  if (all_of(topic.publishers, is_latched)) {
    qos.durability = Durability::transient_local;
  } else if (any_of(topic.publishers, is_latched)) {
    warn("some publishers of " + topic.name +
         " are volatile; latched messages of other publishers are not received");
  }
  return qos;
}

void GraphClient::subscribe(const std::string& name) {
  static_cast<void>(find_topic(name));
  if (impl_->subscriptions.contains(name)) return;
  const GraphTopic topic = impl_->topic_of_others(name);
  const auto& ends = topic.publishers.empty() ? topic.subscriptions : topic.publishers;
  Impl::Subscription made{.type = ends.front().type, .qos = impl_->fitting(topic), .reader = nullptr};
  made.reader = impl_->participant->make_reader({.topic = dds_name(NameKind::topic, name),
                                                 .type = dds_type(made.type),
                                                 .type_hash = ends.front().type_hash,
                                                 .qos = made.qos});
  impl_->subscriptions.emplace(name, std::move(made));
  impl_->announce();
}

void GraphClient::unsubscribe(const std::string& topic) {
  if (impl_->subscriptions.erase(topic) > 0) impl_->announce();
}

// A reader that requests transient local gets it; otherwise the defaults, as any ROS 2 publisher.
Writer& GraphClient::Impl::writer(const std::string& topic, const std::string& type) {
  if (const auto found = writers.find({topic, type}); found != writers.end()) return *found->second;
  QosProfile qos = default_qos();
  const GraphTopic known = topic_of_others(topic);
  if (any_of(known.subscriptions, is_latched)) qos.durability = Durability::transient_local;
  const TypeSupport* support = find_type(type);
  const auto described_here = described.find(topic);
  if (support == nullptr && described_here != described.end()) support = described_here->second.get();
  auto made = participant->make_writer({.topic = dds_name(NameKind::topic, topic),
                                        .type = dds_type(type),
                                        .type_hash = support != nullptr ? support->hash() : "",
                                        .qos = qos});
  Writer& ours = *writers.emplace(std::pair(topic, type), std::move(made)).first->second;
  announce();
  std::vector<Gid> expected;
  for (const GraphEndpoint& end : known.subscriptions) {
    const std::string why = incompatibility(qos, end.qos);
    if (why.empty() && end.type == type) expected.push_back(end.gid);
    if (!why.empty()) warn(end.node + " does not receive what is published on " + topic + ": " + why);
  }
  const auto all_matched = [&] {
    return std::ranges::all_of(expected, [&](const Gid& gid) { return ours.is_matched(gid); });
  };
  wait(all_matched, Clock::now() + kMatching);
  return ours;
}

void GraphClient::publish(const std::string& topic, const std::string& type, std::span<const std::byte> cdr) {
  if (!impl_->writer(topic, type).write(cdr))
    throw ClientError("the message for " + topic +
                      " could not be sent: it is too large, or no reader accepts it");
  impl_->last_published = Impl::Clock::now();
}

// Publishers that were discovered later and offer less than requested.
void GraphClient::Impl::warn_of_incompatible_publishers() {
  for (const auto& [name, subscription] : subscriptions) {
    const GraphTopic topic = topic_of_others(name);
    for (const GraphEndpoint& end : topic.publishers) {
      const std::string why = incompatibility(end.qos, subscription.qos);
      if (why.empty() || !warned_of.insert(end.gid).second) continue;
      warn(end.node + " is not received on " + name + ": " + why);
    }
  }
}

std::shared_ptr<const TypeSupport> GraphClient::Impl::ask_for_type(const std::string& node,
                                                                   const std::string& type,
                                                                   const std::string& hash,
                                                                   std::string& why) {
  using type_description_interfaces::srv::GetTypeDescription;
  const std::string service = node + "/get_type_description";
  if (!services.contains(service)) {
    why = node + " does not offer get_type_description";
    return nullptr;
  }
  GetTypeDescription::Request request;
  request.type_name = type;
  request.type_hash = hash;
  request.include_type_sources = false;
  const Answer answer = ask(service, to_cdr(request));
  GetTypeDescription::Response response;
  Status status = answer.ok ? from_cdr(std::span(answer.response), response) : Status::refused(answer.why);
  if (status && !response.successful) status = Status::refused(response.failure_reason);
  std::shared_ptr<const TypeSupport> support;
  if (status) support = described_type(response.type_description, status);
  if (support == nullptr) {
    why = node + " does not describe it: " + status.why();
  } else if (!hash.empty() && support->hash() != hash) {
    why = "what " + node + " describes a different type";
    support = nullptr;
  }
  return support;
}

const TypeSupport& GraphClient::message_type(const std::string& name) {
  static_cast<void>(find_topic(name));
  const GraphTopic topic = impl_->topic_of_others(name);
  const auto& ends = topic.publishers.empty() ? topic.subscriptions : topic.publishers;
  const std::string& type = ends.front().type;
  const std::string& hash = ends.front().type_hash;
  const TypeSupport* known = find_type(type);
  if (known != nullptr && (hash.empty() || hash == known->hash())) return *known;
  if (const auto found = impl_->described.find(name); found != impl_->described.end()) return *found->second;
  std::string why;
  for (const GraphEndpoint& end : ends) {
    if (end.type != type || end.type_hash != hash) continue;
    if (auto support = impl_->ask_for_type(end.node, type, hash, why))
      return *(impl_->described[name] = std::move(support));
  }
  if (known == nullptr) throw ClientError(name + " is a " + type + ", a type unknown to doppel, and " + why);
  throw ClientError(name + " is a " + type + " of another definition (" + hash + ") than this program's (" +
                    known->hash() + "), so its fields would be decoded wrongly, and " + why);
}

}  // namespace doppel::ros2
