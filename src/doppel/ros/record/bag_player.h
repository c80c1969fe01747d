#pragma once
// Publishes the messages of a bag on a bus, in pace with wall-clock time, with ros2 bag play's options.

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "doppel/base/core/log.h"
#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/record/bag_reader.h"

namespace doppel {

inline constexpr const char* kPlayerNode = "/rosbag2_player";
inline constexpr double kMinPlayRate = 1e-3, kMaxPlayRate = 1e3;

// With both a duration and `until`, the later end counts, as in rosbag2.
struct PlayedPart {
  Duration start{};         // since the start of the bag
  Duration duration{};      // of bag time; zero: to the end
  std::uint64_t until = 0;  // ns of the bag; 0: to the end
};

struct PlayerOptions {
  double rate = 1;  // bag seconds per wall second, positive
  PlayedPart part = {};
  Duration delay{};  // before the first message, in each round of a loop
  bool loop = false, paused = false;
  TopicSelection topics = {};
  std::map<std::string, std::string> remap = {};  // topics' other names
  // /clock, unless the bag has one: with this rate in Hz (0: none), and right before each message of these
  // topics, or of all.
  double clock_rate = 0;
  std::vector<std::string> clock_topics = {};
  bool clock_topics_all = false;
  std::map<std::string, Qos> qos = {};  // of topics by the bag's names, instead of the recorded qualities
};

class DOPPEL_API BagPlayer {
 public:
  using Clock = std::chrono::steady_clock;

  // The bag and the bus outlive it. Types that this program does not know are made from the bag's schemas;
  // topics whose type cannot be made are skipped with a warning.
  BagPlayer(Bus& bus, BagReader& bag, PlayerOptions options, const Log& log);
  ~BagPlayer();

  // -- the bus's thread
  // Publishes what is due. The bus's time is that of the last message.
  void play(Clock::time_point now);
  // When the next message is due; nullopt: paused, or at the end.
  [[nodiscard]] std::optional<Clock::time_point> due() const;
  [[nodiscard]] bool at_end() const { return stopped_ || (!next_ && !options_.loop); }
  // From the beginning, with the delay; for a player that was made some time before.
  void begin_now(Clock::time_point now);

  void pause(bool yes, Clock::time_point now);
  void set_rate(double rate, Clock::time_point now);
  // To a time of the bag; latched messages and the last message of each topic before it are published.
  void seek(std::uint64_t time, Clock::time_point now);
  // While paused: the next message. False: there is none.
  bool step(Clock::time_point now);
  // Outside the bag until a seek or play_part().
  void stop();
  // At the end or stopped: plays this part. False: it is playing.
  bool play_part(const PlayedPart& part, Clock::time_point now);

  [[nodiscard]] bool is_paused() const { return paused_; }
  [[nodiscard]] bool is_stopped() const { return stopped_; }
  [[nodiscard]] double rate() const { return options_.rate; }
  [[nodiscard]] std::uint64_t time() const { return time_; }  // ns of the bag
  [[nodiscard]] std::uint64_t begin() const { return begin_; }
  [[nodiscard]] std::uint64_t end() const { return end_; }
  [[nodiscard]] std::uint64_t published() const { return published_; }
  [[nodiscard]] const std::vector<std::string>& skipped() const { return skipped_; }

 private:
  struct Message {
    std::size_t topic = 0;
    std::uint64_t time = 0;
    std::vector<std::byte> data;
  };
  struct Target {
    std::string name, type;
    bool usable = false;
    bool clock_before = false;  // /clock comes right before each message
  };
  void advertise(const Log& log);
  void choose(const PlayedPart& part);
  void read_next();
  void publish(const Message& message);
  void publish_next();
  void publish_clock(const Message& message);
  void rewind(Clock::time_point now);
  void anchor(std::uint64_t time, Clock::time_point now);
  [[nodiscard]] Clock::time_point wall_of(std::uint64_t time) const;

  Bus& bus_;
  BagReader& bag_;
  PlayerOptions options_;
  std::unique_ptr<Edge> edge_;
  std::vector<Target> targets_;  // by the bag's topics
  std::vector<std::string> skipped_;
  std::optional<Message> next_;
  std::uint64_t begin_ = 0, end_ = 0, time_ = 0, clock_due_ = 0, published_ = 0;
  bool paused_ = false, stopped_ = false, has_clock_ = false;
  // The bag's time `anchor_time_` was played at `anchor_wall_`.
  std::uint64_t anchor_time_ = 0;
  Clock::time_point anchor_wall_;
};

}  // namespace doppel
