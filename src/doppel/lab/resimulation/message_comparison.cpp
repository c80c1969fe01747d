#include "doppel/lab/resimulation/detail/message_comparison.h"

#include <algorithm>

#include "doppel/lab/resimulation/detail/own_names.h"

namespace doppel {
namespace {

constexpr std::size_t kRing = std::size_t{64} << 20;

// Their samples depend on the time that they take, unless the loop waits for them.
const std::vector<std::string> kOfLight = {"sensor_msgs/msg/Image",      "sensor_msgs/msg/CompressedImage",
                                           "sensor_msgs/msg/CameraInfo", "sensor_msgs/msg/PointCloud2",
                                           "sensor_msgs/msg/LaserScan",  "sensor_msgs/msg/Range"};

TopicSelection compared_topics(NameRules& rules, bool lockstep) {
  TopicSelection out;
  out.all_topics = true;
  out.exclude_topics = topics_of_wall_clock(rules);
  out.exclude_regex = "robot_description";  // it has paths of files, which are elsewhere now
  if (!lockstep) out.exclude_types = kOfLight;
  return out;
}

}  // namespace

MessageComparison::MessageComparison(Bus& bus, BagReader& recorded, bool lockstep, std::uint64_t first_step)
    : bus_(bus),
      recorded_(recorded),
      compared_(compared_topics(bus.names(), lockstep)),
      first_step_(first_step),
      edge_(bus.attach("comparison", {.ring_bytes = kRing})) {
  recorded_.seek(0, UINT64_MAX, compared_);
  ahead_ = recorded_.next();
  subscribe();
}

void MessageComparison::subscribe() {
  graph_ = bus_.graph_version();
  for (const TopicInfo& topic : bus_.topics()) {
    if (names_.contains(topic.id) || topic.publishers.empty() || !compared_.selects(topic.name, topic.type))
      continue;
    names_[topic.id] = topic.name;
    edge_->subscribe(topic.id);
  }
}

void MessageComparison::read_one() {
  const std::string& name = recorded_.contents().topics[ahead_->topic].name;
  expected_[name].push_back({ahead_->publish_time, {ahead_->data.begin(), ahead_->data.end()}});
  ahead_ = recorded_.next();
}

// After a reset of this run the recorded one goes on behind its own reset, in the next file.
void MessageComparison::read_until(Time now) {
  const auto time = static_cast<std::uint64_t>(std::max<std::int64_t>(0, nanoseconds_of(now)));
  if (time < time_) {
    for (std::uint64_t before = 0; ahead_ && ahead_->log_time >= before;) {
      before = ahead_->log_time;
      read_one();
    }
  }
  time_ = time;
  while (ahead_ && ahead_->log_time <= time) read_one();
}

void MessageComparison::compare(const Edge::Incoming& message, std::uint64_t step) {
  const auto time = static_cast<std::uint64_t>(std::max<std::int64_t>(0, nanoseconds_of(message.stamp)));
  std::deque<Expected>& expected = expected_[names_[message.topic]];
  const auto found = std::ranges::find(expected, time, &Expected::time);
  if (found == expected.end()) return;
  const bool equal = std::ranges::equal(found->data, message.cdr);
  expected.erase(expected.begin(), found + 1);
  if (!equal && !first_) first_ = FirstDifference{step, names_[message.topic], message.stamp};
}

void MessageComparison::look(std::uint64_t step, Time now) {
  const bool is_recorded = step >= first_step_;
  if (is_recorded) read_until(now);
  Edge::Incoming message;
  while (edge_->next(message)) {
    if (is_recorded && !first_) compare(message, step);
  }
  if (graph_ != bus_.graph_version()) subscribe();
}

}  // namespace doppel
