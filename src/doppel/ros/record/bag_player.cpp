#include "doppel/ros/record/bag_player.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>

#include "doppel/ros/messages/rosgraph_msgs.h"
#include "doppel/ros/messages/schema_reader.h"

namespace doppel {
namespace {

constexpr const char* kClock = "/clock";
constexpr std::size_t kBatch = 1000;  // messages of one play(), so that requests are answered meanwhile

// The type of a topic's messages: this program's, or one that is made of the schema and known from now on.
const TypeSupport* type_of(const BagTopic& topic, std::string& why) {
  if (topic.encoding != "cdr") {
    why = fmt::format("its messages are {}, not CDR", topic.encoding);
    return nullptr;
  }
  if (const TypeSupport* const type = find_type(topic.type)) return type;
  if (topic.schema_encoding != "ros2msg") {
    why = fmt::format("{} is not known, and its schema is {}", topic.type, topic.schema_encoding);
    return nullptr;
  }
  Status status;
  auto read = type_of_schema(topic.type, topic.schema, status);
  if (read == nullptr) {
    why = fmt::format("the schema of {} cannot be used: {}", topic.type, status.why());
    return nullptr;
  }
  // The registry keeps addresses for the life of the program.
  static std::mutex mutex;
  static std::deque<std::shared_ptr<const TypeSupport>> kept;
  const std::lock_guard lock(mutex);
  register_type(*kept.emplace_back(std::move(read)));
  return find_type(topic.type);
}

}  // namespace

BagPlayer::BagPlayer(Bus& bus, BagReader& bag, PlayerOptions options, const Log& log)
    : bus_(bus), bag_(bag), options_(std::move(options)), edge_(bus.attach(kPlayerNode)) {
  choose(options_.part);
  paused_ = options_.paused;
  advertise(log);
  rewind(Clock::now());
}

void BagPlayer::choose(const PlayedPart& part) {
  const BagContents& contents = bag_.contents();
  begin_ = std::min(contents.end, contents.start + static_cast<std::uint64_t>(part.start.count()));
  std::uint64_t limit = part.until;
  if (part.duration > Duration{})
    limit = std::max(limit, begin_ + static_cast<std::uint64_t>(part.duration.count()));
  end_ = limit == 0 ? contents.end : std::clamp(limit, begin_, contents.end);
}

BagPlayer::~BagPlayer() = default;

void BagPlayer::advertise(const Log& log) {
  for (std::size_t i = 0; i < bag_.contents().topics.size(); ++i) {
    const BagTopic& topic = bag_.contents().topics[i];
    Target& target = targets_.emplace_back();
    const auto renamed = options_.remap.find(topic.name);
    target.name = renamed == options_.remap.end() ? topic.name : renamed->second;
    target.type = topic.type;
    if (!options_.topics.selects(topic.name, topic.type)) continue;
    std::string why;
    if (type_of(topic, why) != nullptr) {
      const bool latched = bag_.latched(i) > 0;
      const auto chosen = options_.qos.find(topic.name);
      const Qos qos = chosen == options_.qos.end() ? Qos{.depth = latched ? 1U : 10U, .latched = latched}
                                                   : chosen->second;
      const Status offered = edge_->advertise(kPlayerNode, target.name, topic.type, qos);
      target.usable = offered.ok();
      if (!offered) why = offered.why();
    }
    if (target.usable) {
      has_clock_ = has_clock_ || target.name == kClock;
      target.clock_before =
          options_.clock_topics_all ||
          std::ranges::find(options_.clock_topics, topic.name) != options_.clock_topics.end();
      continue;
    }
    skipped_.push_back(topic.name);
    log.warning("play", fmt::format("{} is not played: {}", topic.name, why));
  }
}

void BagPlayer::read_next() {
  next_.reset();
  while (const auto message = bag_.next()) {
    if (!targets_[message->topic].usable) continue;
    next_ = Message{message->topic, message->log_time, {message->data.begin(), message->data.end()}};
    return;
  }
}

void BagPlayer::anchor(std::uint64_t time, Clock::time_point now) {
  anchor_time_ = time;
  anchor_wall_ = now;
}

void BagPlayer::rewind(Clock::time_point now) {
  seek(begin_, now);
  anchor(begin_, now + options_.delay);
}

void BagPlayer::begin_now(Clock::time_point now) {
  anchor(time_, now + options_.delay);
}

void BagPlayer::seek(std::uint64_t time, Clock::time_point now) {
  time = std::clamp(time, begin_, end_);
  stopped_ = false;
  // The last message of each topic before this time is its state now.
  std::map<std::size_t, Message> states;
  bag_.seek(0, time, options_.topics);
  while (const auto message = bag_.next()) {
    if (targets_[message->topic].usable)
      states[message->topic] = {
          message->topic, message->log_time, {message->data.begin(), message->data.end()}};
  }
  time_ = clock_due_ = time;
  for (const auto& [topic, message] : states) publish(message);
  bag_.seek(time, end_ == UINT64_MAX ? end_ : end_ + 1, options_.topics);
  read_next();
  anchor(time, now);
}

BagPlayer::Clock::time_point BagPlayer::wall_of(std::uint64_t time) const {
  const double ahead = (static_cast<double>(time) - static_cast<double>(anchor_time_)) / options_.rate;
  return anchor_wall_ + std::chrono::duration_cast<Clock::duration>(
                            std::chrono::duration<double, std::nano>(std::max(0.0, ahead)));
}

std::optional<BagPlayer::Clock::time_point> BagPlayer::due() const {
  if (paused_ || stopped_) return std::nullopt;
  if (!next_) return options_.loop ? std::optional(wall_of(end_)) : std::nullopt;
  return wall_of(next_->time);
}

void BagPlayer::publish(const Message& message) {
  const Target& target = targets_[message.topic];
  bus_.set_now(time_from_nanoseconds(static_cast<std::int64_t>(time_)));
  if (edge_->publish(kPlayerNode, target.name, target.type, message.data)) ++published_;
  bus_.spin();
}

void BagPlayer::publish_clock(const Message& message) {
  if (has_clock_) return;
  const bool is_due = options_.clock_rate > 0 && time_ >= clock_due_;
  if (!is_due && !targets_[message.topic].clock_before) return;
  rosgraph_msgs::msg::Clock clock;
  clock.clock = to_time_msg(time_from_nanoseconds(static_cast<std::int64_t>(time_)));
  static_cast<void>(edge_->publish(kPlayerNode, kClock, rosgraph_msgs::msg::Clock::kType, to_cdr(clock)));
  bus_.spin();
  if (is_due) clock_due_ = time_ + static_cast<std::uint64_t>(1e9 / options_.clock_rate);
}

void BagPlayer::publish_next() {
  const Message message = std::move(*next_);
  time_ = std::max(time_, message.time);
  publish_clock(message);
  publish(message);
  read_next();
}

void BagPlayer::play(Clock::time_point now) {
  if (paused_) return;
  for (std::size_t i = 0; i < kBatch && next_ && wall_of(next_->time) <= now; ++i) {
    const std::uint64_t before = next_->time;
    publish_next();
    // A file that begins earlier: the simulation was reset there.
    if (next_ && next_->time < before) {
      anchor(next_->time, now);
      time_ = next_->time;
    }
  }
  if (!next_ && !stopped_ && options_.loop && now >= wall_of(end_)) rewind(now);
}

void BagPlayer::pause(bool yes, Clock::time_point now) {
  if (yes == paused_) return;
  paused_ = yes;
  anchor(time_, now);
}

void BagPlayer::set_rate(double rate, Clock::time_point now) {
  anchor(time_, now);
  options_.rate = rate;
}

bool BagPlayer::step(Clock::time_point now) {
  if (!next_) return false;
  publish_next();
  anchor(time_, now);
  return true;
}

void BagPlayer::stop() {
  stopped_ = true;
  next_.reset();
}

bool BagPlayer::play_part(const PlayedPart& part, Clock::time_point now) {
  if (!at_end()) return false;
  choose(part);
  rewind(now);
  return true;
}

}  // namespace doppel
