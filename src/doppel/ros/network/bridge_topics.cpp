#include "doppel/ros/network/detail/bridge_topics.h"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>

#include "doppel/ros/network/bridge_types.h"
#include "doppel/ros/network/names.h"

namespace doppel::ros2 {
namespace {

// A node's QoS depth is that of its own queue behind the bus; this one is for bursts until the
// bridge's thread runs.
constexpr std::size_t kReaderDepth = 100;
constexpr std::size_t kMaxAtOnce = 64;   // samples of one reader before the next reader
constexpr std::size_t kMaxLogged = 256;  // logged refusals; all are counted

// The part of a bus's topic for the network: its nodes, and messages of other edges (the page or a shell).
std::vector<doppel::EndpointInfo> for_network(std::vector<doppel::EndpointInfo> ends, bool edges_too) {
  std::erase_if(ends, [edges_too](const doppel::EndpointInfo& info) {
    return info.edge == kBridgeName || (!edges_too && !info.edge.empty());
  });
  return ends;
}

}  // namespace

void RejectionLog::add(const std::string& name, const Gid& sender, const std::string& reason) {
  ++status_.refused;
  auto& rejected = status_.rejections[name];
  ++rejected.count;
  rejected.reason = reason;
  if (logged_.size() >= kMaxLogged) return;
  if (!logged_.emplace(name, std::vector(sender.prefix().begin(), sender.prefix().end())).second) return;
  log_.warning(
      "ros2",
      fmt::format("{}: rejected a message from the network: {}; further ones are counted on /diagnostics",
                  name, reason));
}

void UnbridgedLog::log(const std::string& name, const std::string& reason) {
  if (logged_.size() < kMaxLogged && logged_.emplace(name, reason).second)
    log_.warning("ros2", fmt::format("{} cannot be offered on the network: {}", name, reason));
}

std::vector<OwnNode> Announcement::nodes() const {
  std::vector<OwnNode> nodes;
  for (const auto& [name, node] : nodes_) {
    nodes.push_back(node);
    std::ranges::sort(nodes.back().readers);
    std::ranges::sort(nodes.back().writers);
  }
  return nodes;
}

EndpointSpec BridgedTopics::spec(const Topic& topic, const Qos& qos) const {
  return {.topic = dds_name(NameKind::topic, topic.name),
          .type = dds_type(topic.type),
          .type_hash = message_hash(topic.type),
          .qos = to_profile(qos)};
}

// False: the network refused a part.
template <class End, class Make>
bool BridgedTopics::follow_ends(const Topic& topic, std::vector<Endpoint<End>>& ends,
                                const std::vector<doppel::EndpointInfo>& wanted, const Make& make) {
  bool all = true;
  for (auto& end : ends) end.seen = false;
  for (const doppel::EndpointInfo& info : wanted) {
    const auto found = std::ranges::find_if(
        ends, [&info](const auto& end) { return end.node == info.node && end.qos == info.qos; });
    if (found == ends.end()) {
      const auto add = [&] { ends.push_back({info.node, info.qos, make(spec(topic, info.qos))}); };
      all = unbridged_.attempt(topic.name, add) && all;
    } else {
      found->seen = true;
      found->gone_since = {};
    }
  }
  return all;
}

template <class End>
bool BridgedTopics::end_ends(std::vector<Endpoint<End>>& ends, SteadyTime now) {
  bool waits = false;
  for (auto& end : ends) {
    if (!end.seen && end.gone_since == SteadyTime{}) end.gone_since = now;
    waits = waits || !end.seen;
  }
  std::erase_if(ends, [&](const auto& end) {
    if (end.seen || now - end.gone_since < kGracePeriod) return false;
    if constexpr (std::is_same_v<End, Reader>) lost_by_gone_ += end.end->lost();
    return true;
  });
  return waits;
}

// The endpoint with the strongest offered QoS: readers that match another writer of the topic match it, too.
void BridgedTopics::choose_carrier(TopicId id, Topic& topic) {
  const auto offer = [](const Endpoint<Writer>& writer) {
    const Qos& qos = writer.qos;
    return std::tuple(!qos.best_effort, qos.transient_local(), qos.keep_all, qos.depth);
  };
  const auto strongest = std::ranges::max_element(topic.writers, {}, offer);
  Writer* const next = strongest == topic.writers.end() ? nullptr : strongest->end.get();
  // A new carrier of a latched topic needs the last message for late joiners: the bus delivers it again.
  if (topic.subscribed && topic.latched && next != topic.carrier) unsubscribe(id, topic);
  topic.carrier = next;
}

// The bus frees a topic with its last endpoint and gives the next one of that name another id. If the type is the
// same, the endpoints continue under the new id; otherwise they end at once, without a grace period, because on the
// network a name has only one type.
void BridgedTopics::follow_ids(const std::vector<TopicInfo>& infos) {
  std::map<std::string_view, const TopicInfo*> owners;
  for (const TopicInfo& info : infos) {
    if (!info.publishers.empty() || !info.subscribers.empty()) owners[info.name] = &info;
  }
  std::vector<decltype(topics_)::node_type> renumbered;
  for (auto it = topics_.begin(); it != topics_.end();) {
    const auto owner = owners.find(it->second.name);
    if (owner == owners.end() || owner->second->id == it->first) {
      ++it;
      continue;
    }
    auto entry = topics_.extract(it++);
    Topic& topic = entry.mapped();
    if (topic.type != owner->second->type) {
      for (const auto& reader : topic.readers) lost_by_gone_ += reader.end->lost();
      continue;
    }
    topic.subscribed = false;  // the subscription ended with the former id
    topic.listening = std::make_shared<std::atomic<bool>>(false);
    entry.key() = owner->second->id;
    renumbered.push_back(std::move(entry));
  }
  for (auto& entry : renumbered) topics_.insert(std::move(entry));
}

bool BridgedTopics::follow(const std::vector<TopicInfo>& infos, SteadyTime now) {
  follow_ids(infos);
  std::set<TopicId> seen;
  bool waits = false;
  for (const TopicInfo& info : infos) {
    auto writers = for_network(info.publishers, true);
    auto readers = for_network(info.subscribers, false);
    const auto known = topics_.find(info.id);
    if (writers.empty() && readers.empty() && known == topics_.end()) continue;
    Topic& topic = known != topics_.end() ? known->second : topics_[info.id];
    topic.name = info.name;
    topic.type = info.type;
    topic.latched = info.latched;
    seen.insert(info.id);
    const auto make_writer = [this](const EndpointSpec& spec) { return participant_.make_writer(spec); };
    const auto make_reader = [this](EndpointSpec spec) {
      spec.qos.depth = std::max(spec.qos.depth, kReaderDepth);
      return participant_.make_reader(spec);
    };
    waits = !follow_ends(topic, topic.writers, writers, make_writer) || waits;
    waits = !follow_ends(topic, topic.readers, readers, make_reader) || waits;
  }
  for (auto& [id, topic] : topics_) {
    if (!seen.contains(id)) {
      for (auto& writer : topic.writers) writer.seen = false;
      for (auto& reader : topic.readers) reader.seen = false;
    }
    waits = end_ends(topic.writers, now) || waits;
    waits = end_ends(topic.readers, now) || waits;
    choose_carrier(id, topic);
  }
  std::erase_if(topics_, [](const auto& entry) {
    return entry.second.writers.empty() && entry.second.readers.empty();
  });
  return waits;
}

void BridgedTopics::subscribe(TopicId id, Topic& topic) {
  topic.subscribed = true;
  edge_.subscribe(id);
  edge_.post([listening = topic.listening] { listening->store(true, std::memory_order_release); });
}

// Drops samples for late readers that would be outdated when these appear.
void BridgedTopics::unsubscribe(TopicId id, Topic& topic) {
  topic.subscribed = false;
  topic.listening = std::make_shared<std::atomic<bool>>(false);
  edge_.unsubscribe(id);
  for (const auto& writer : topic.writers) writer.end->forget();
}

// Topics that are latched or have a history (/rosout) are always subscribed to, because DDS needs their
// messages before the next reader appears.
bool BridgedTopics::match() {
  bool begins = false;
  for (auto& [id, topic] : topics_) {
    const auto needs_it = [](const Endpoint<Writer>& writer) {
      return writer.end->matched() > 0 || (writer.qos.latched_on_network && writer.qos.depth > 1);
    };
    const bool wanted =
        !topic.writers.empty() && (topic.latched || std::ranges::any_of(topic.writers, needs_it));
    if (wanted && !topic.subscribed) subscribe(id, topic);
    if (!wanted && topic.subscribed) unsubscribe(id, topic);
    begins = begins || (topic.subscribed && !topic.listening->load(std::memory_order_acquire));
  }
  return begins;
}

void BridgedTopics::pass(const Edge::Incoming& message) {
  const auto found = topics_.find(message.topic);
  if (found == topics_.end() || found->second.carrier == nullptr) return;
  if (found->second.carrier->write(message.cdr)) {
    ++status_.sent;
  } else {
    ++status_.lost;
  }
}

// If several nodes subscribe, each of their readers gets every sample; only the first one that is matched
// with the writer forwards it.
bool BridgedTopics::take_from(Topic& topic, std::size_t which) {
  Reader& reader = *topic.readers[which].end;
  if (!reader.is_ready()) return false;
  const auto share = backlog_.share();
  bool handed = false, more = true;
  for (std::size_t i = 0; i < kMaxAtOnce && !backlog_.is_full(); ++i) {
    more = reader.take(sample_);
    if (!more) break;
    const Gid& writer = sample_.identity.writer;
    const auto earlier = std::span(topic.readers).first(which);
    if (std::ranges::any_of(earlier, [&writer](const auto& other) { return other.end->is_matched(writer); }))
      continue;
    const Status status = edge_.publish(kBridgeName, topic.name, topic.type, sample_.cdr);
    if (status) {
      ++status_.received;
      share->add(sample_.cdr.size());
      handed = true;
    } else {
      rejections_.add(topic.name, writer, status.why());
    }
  }
  if (handed) edge_.post([share] { share->end(); });
  return more;
}

bool BridgedTopics::take() {
  bool more = false;
  for (auto& [id, topic] : topics_) {
    for (std::size_t i = 0; i < topic.readers.size(); ++i) {
      if (is_held_back()) return true;
      more = take_from(topic, i) || more;
    }
  }
  return more;
}

void BridgedTopics::announce(Announcement& announcement) const {
  for (const auto& [id, topic] : topics_) {
    for (const auto& writer : topic.writers) announcement.add_writer(writer.node, writer.end->gid());
    for (const auto& reader : topic.readers) announcement.add_reader(reader.node, reader.end->gid());
  }
}

std::map<std::string, Matches, std::less<>> BridgedTopics::matches() const {
  std::map<std::string, Matches, std::less<>> all;
  for (const auto& [id, topic] : topics_) {
    Matches& matches = all[topic.name];
    if (topic.carrier != nullptr && topic.listening->load(std::memory_order_acquire))
      matches.readers = topic.carrier->matched();
    for (const auto& reader : topic.readers)
      matches.writers = std::max(matches.writers, reader.end->matched());
  }
  return all;
}

std::uint64_t BridgedTopics::lost() const {
  std::uint64_t lost = lost_by_gone_;
  for (const auto& [id, topic] : topics_) {
    for (const auto& reader : topic.readers) lost += reader.end->lost();
  }
  return lost;
}

}  // namespace doppel::ros2
