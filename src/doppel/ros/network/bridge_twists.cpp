#include "doppel/ros/network/detail/bridge_twists.h"

#include <fmt/format.h>

#include <algorithm>

#include "doppel/ros/bus/twist_conversion.h"
#include "doppel/ros/network/bridge_types.h"
#include "doppel/ros/network/detail/bridge_warnings.h"
#include "doppel/ros/network/names.h"

namespace doppel::ros2 {
namespace {

constexpr std::size_t kMaxTwistsAtOnce = 64;                  // of one reader before the next one
constexpr std::size_t kMaxTwistsReported = 256;               // publishers; their number is chosen by others
constexpr auto kNameTime = std::chrono::seconds(1);           // for which a publisher's node is awaited
constexpr Qos kAnyWriter{.depth = 100, .best_effort = true};  // matches every publisher

}  // namespace

void BridgedTwists::look_at(const std::vector<GraphTopic>& topics, const Gid& own, SteadyTime now) {
  if (bus_.twists() == TwistPolicy::refuse) return;
  const auto before = std::exchange(unnamed_, {});
  std::set<std::pair<std::string, std::string>> wanted;
  for (const GraphTopic& topic : topics) {
    const auto is_read_as = [&](const GraphEndpoint& publisher) {
      return std::ranges::any_of(topic.subscriptions, [&](const GraphEndpoint& subscription) {
        return is_same_participant(subscription.gid, own) &&
               is_convertible_twist(publisher.type, subscription.type);
      });
    };
    for (const GraphEndpoint& publisher : topic.publishers) {
      if (is_same_participant(publisher.gid, own) || !is_read_as(publisher)) continue;
      if (publisher.node == kUnknownNode && unnamed_.size() < kMaxTwistsReported) {
        const auto known = before.find({topic.name, publisher.gid});
        unnamed_[{topic.name, publisher.gid}] = {publisher,
                                                 known == before.end() ? now : known->second.since};
      } else {
        report(topic.name, publisher, own);
      }
      wanted.emplace(topic.name, publisher.type);
    }
  }
  std::erase_if(readers_, [&](const auto& reader) { return !wanted.contains(reader.first); });
  if (bus_.twists() != TwistPolicy::convert) return;
  for (const auto& [topic, type] : wanted) {
    if (!readers_.contains({topic, type})) read(topic, type);
  }
}

void BridgedTwists::report(const std::string& topic, const GraphEndpoint& publisher, const Gid& own) {
  if (reported_.size() >= kMaxTwistsReported || !reported_.emplace(topic, publisher.gid).second) return;
  log_.warning("ros2",
               twist_conversion_text(fmt::format("{} ({})", publisher.node, place_of(publisher.gid, own)),
                                     topic, publisher.type, bus_.twists() == TwistPolicy::explain));
}

void BridgedTwists::report_unnamed(const Gid& own, SteadyTime now) {
  std::erase_if(unnamed_, [&](const auto& each) {
    if (now - each.second.since < kNameTime) return false;
    report(each.first.first, each.second.publisher, own);
    return true;
  });
}

void BridgedTwists::read(const std::string& topic, const std::string& type) {
  if (failed_) return;
  try {
    if (participant_ == nullptr) participant_ = join_();
    readers_[{topic, type}] = participant_->make_reader({.topic = dds_name(NameKind::topic, topic),
                                                         .type = dds_type(type),
                                                         .type_hash = message_hash(type),
                                                         .qos = to_profile(kAnyWriter)});
  } catch (const NetworkError& error) {
    failed_ = true;
    readers_.erase({topic, type});
    log_.warning("ros2",
                 fmt::format("messages of type {} on {} are not received: {}", type, topic, error.what()));
  }
}

bool BridgedTwists::take() {
  bool more = false;
  for (auto& [key, reader] : readers_) {
    const auto share = backlog_.share();
    bool handed = false, left = reader->is_ready();
    for (std::size_t i = 0; i < kMaxTwistsAtOnce && left && !backlog_.is_full(); ++i) {
      left = reader->take(sample_);
      if (!left) break;
      const Status status = edge_.publish(kBridgeName, key.first, key.second, sample_.cdr);
      if (status) {
        ++status_.received;
        share->add(sample_.cdr.size());
        handed = true;
      } else {
        rejections_.add(key.first, sample_.identity.writer, status.why());
      }
    }
    if (handed) edge_.post([share] { share->end(); });
    more = more || left;
  }
  return more;
}

}  // namespace doppel::ros2
