// The bus of a SteppedTwin: messages are JSON in both directions.
#include <fmt/format.h>

#include <chrono>
#include <utility>

#include "doppel/base/core/names.h"
#include "doppel/ros/messages/codec.h"
#include "python/stepped_twin.h"

namespace doppel::python {
namespace {

constexpr const char* kNode = "/python";
constexpr std::chrono::seconds kMaxWait{10};

std::vector<std::string> names_of(const auto& list) {
  std::vector<std::string> out;
  for (const auto& one : list) out.push_back(one.name);
  return out;
}

Bytes encode(const TypeSupport& type, const std::string& json, const std::string& subject) {
  Bytes out;
  if (const Status encoded = type.json_to_cdr(json, out); !encoded)
    throw InputError("python.message", {}, fmt::format("{}: {}", subject, encoded.why()),
                     fmt::format("the fields are those of {}", type.name));
  return out;
}

std::string decode(const TypeSupport& type, std::span<const std::byte> cdr) {
  std::string out;
  if (const Status decoded = type.cdr_to_json(cdr, out); !decoded)
    throw InputError("python.message", {}, fmt::format("a {} cannot be read: {}", type.name, decoded.why()));
  return out;
}

const TypeSupport& type_named(const std::string& name) {
  const TypeSupport* const found = find_type(name);
  if (found == nullptr)
    throw InputError("python.type", {},
                     fmt::format("'{}' is no type of messages{}", name, did_you_mean(name, type_names())),
                     "write for example std_msgs/msg/Float64");
  return *found;
}

}  // namespace

void SteppedTwin::publish(const std::string& topic, const std::string& type, const std::string& json) {
  const auto lock = hold();
  const std::vector<TopicInfo> topics = twin().bus().topics();
  std::string type_name = type;
  if (type_name.empty()) {
    for (const TopicInfo& topic_info : topics) {
      if (topic_info.name == topic) type_name = topic_info.type;
    }
    if (type_name.empty())
      throw InputError("python.unknown_topic", {},
                       fmt::format("there is no topic '{}'{}", topic, did_you_mean(topic, names_of(topics))),
                       "pass its type to publish on a new one");
  }
  const Bytes cdr = encode(type_named(type_name), json, topic);
  if (const Status published = edge_->publish(kNode, topic, type_name, cdr); !published)
    throw InputError("python.publish", {}, fmt::format("{}: {}", topic, published.why()));
}

void SteppedTwin::subscribe(const std::string& topic, std::size_t depth) {
  const auto lock = hold();
  const std::vector<TopicInfo> topics = twin().bus().topics();
  for (const TopicInfo& topic_info : topics) {
    if (topic_info.name != topic) continue;
    Subscription& added = subscriptions_[topic];
    added.topic = topic_info.id;
    added.type = topic_info.type;
    added.depth = depth;
    edge_->subscribe(topic_info.id);
    twin().between_steps();
    receive();
    return;
  }
  throw InputError("python.unknown_topic", {},
                   fmt::format("there is no topic '{}'{}", topic, did_you_mean(topic, names_of(topics))),
                   "twin.topics() lists them");
}

void SteppedTwin::unsubscribe(const std::string& topic) {
  if (!process_.is_this_one()) return;
  const auto lock = hold();
  const auto found = subscriptions_.find(topic);
  if (found == subscriptions_.end()) return;
  edge_->unsubscribe(found->second.topic);
  subscriptions_.erase(found);
}

SteppedTwin::Subscription& SteppedTwin::subscription(const std::string& topic) {
  const auto found = subscriptions_.find(topic);
  if (found == subscriptions_.end())
    throw InputError("python.not_subscribed", {}, fmt::format("'{}' is not subscribed", topic),
                     "keep the object that twin.subscribe() returns");
  return found->second;
}

// After each step, so that the ring of the edge never fills.
void SteppedTwin::receive() {
  Edge::Incoming incoming;
  while (edge_->next(incoming)) {
    for (auto& [name, subscription] : subscriptions_) {
      if (subscription.topic != incoming.topic) continue;
      Bytes bytes(incoming.cdr.begin(), incoming.cdr.end());
      if (subscription.depth > 0) {
        subscription.messages.emplace_back(incoming.stamp, bytes);
        if (subscription.messages.size() > subscription.depth) subscription.messages.pop_front();
      }
      subscription.newest = {incoming.stamp, std::move(bytes)};
    }
  }
}

std::vector<TextMessage> SteppedTwin::take_messages(const std::string& topic) {
  const auto lock = hold();
  Subscription& source = subscription(topic);
  const TypeSupport& type = type_named(source.type);
  std::vector<TextMessage> out;
  for (const auto& [stamp, cdr] : source.messages) out.push_back({to_seconds(stamp), decode(type, cdr)});
  source.messages.clear();
  return out;
}

Bytes SteppedTwin::newest(const std::string& topic, double& time) {
  const auto lock = hold();
  const Subscription& source = subscription(topic);
  time = to_seconds(source.newest.first);
  return source.newest.second;
}

std::uint32_t SteppedTwin::begin_call(const std::string& service, const std::string& json) {
  const auto lock = hold();
  const std::vector<ServiceInfo> services = twin().bus().services();
  for (const ServiceInfo& info : services) {
    if (info.name != service) continue;
    const ServiceSupport* const support = find_service(info.type);
    if (support == nullptr)
      throw InputError("python.type", {},
                       fmt::format("the type {} of '{}' is not known", info.type, service));
    const Bytes request = encode(*support->request, json, service);
    const auto answer = std::make_shared<Answer>();
    answer->type = support->response;
    edge_->call(service, request, [answer](Status status, Bytes cdr) {
      answer->status = std::move(status);
      answer->cdr = std::move(cdr);
      answer->is_there = true;
    });
    answers_[next_call_] = answer;
    twin().between_steps();
    return next_call_++;
  }
  throw InputError(
      "python.unknown_service", {},
      fmt::format("there is no service '{}'{}", service, did_you_mean(service, names_of(services))),
      "twin.services() lists them");
}

bool SteppedTwin::step_until_answered(std::uint32_t call, std::uint64_t steps) {
  const auto lock = hold();
  const std::shared_ptr<const Answer> answer = answers_.at(call);
  take_steps(steps, &answer->is_there);
  twin().between_steps();
  return answer->is_there;
}

std::optional<std::string> SteppedTwin::take_answer(std::uint32_t call) {
  const auto lock = hold();
  twin().between_steps();
  const std::shared_ptr<const Answer> answer = answers_.at(call);
  if (!answer->is_there) return std::nullopt;
  answers_.erase(call);
  copy_state();  // a service may have changed it
  if (!answer->status) throw InputError("service.refused", {}, answer->status.why());
  return decode(*answer->type, answer->cdr);
}

std::vector<NamedParameter> SteppedTwin::parameters() {
  const auto lock = hold();
  twin().between_steps();
  const auto out = std::make_shared<Edge::SharedParameters>();
  edge_->get_parameters([out](const Edge::SharedParameters& list) { *out = list; });
  for (const auto until = std::chrono::steady_clock::now() + kMaxWait;
       !*out && std::chrono::steady_clock::now() < until;)
    twin().between_steps();
  if (!*out) throw InputError("service.refused", {}, "the parameters were not read within 10 s");
  return **out;
}

void SteppedTwin::set_parameter(const std::string& node, const std::string& name,
                                const ParameterValue& value) {
  const auto lock = hold();
  const auto out = std::make_shared<std::optional<Status>>();
  edge_->set_parameter(node, name, value, [out](Status status) { *out = std::move(status); });
  for (const auto until = std::chrono::steady_clock::now() + kMaxWait;
       !*out && std::chrono::steady_clock::now() < until;)
    twin().between_steps();
  if (!*out) throw InputError("service.refused", {}, "the parameter was not set within 10 s");
  if (!**out)
    throw InputError("python.parameter", {}, fmt::format("{} of {}: {}", name, node, (*out)->why()));
}

}  // namespace doppel::python
