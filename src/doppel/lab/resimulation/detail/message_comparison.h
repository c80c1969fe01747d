#pragma once
// The first message of a run that is not the recorded one.

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "doppel/lab/resimulation/resimulation.h"
#include "doppel/ros/bus/bus.h"

namespace doppel {

// Compares messages of one topic and time by their bytes. Those that depend on the wall clock are not
// compared, and neither are those that only one of the two runs has, because sensors beside the loop may
// leave samples out.
class MessageComparison {
 public:
  // lockstep: the loop has waited for sensors of light, so that these are compared, too.
  // first_step: the first one of which the recording has messages; earlier ones of this run are not compared.
  MessageComparison(Bus& bus, BagReader& recorded, bool lockstep, std::uint64_t first_step);

  // After each step; now: simulated time.
  void look(std::uint64_t step, Time now);
  [[nodiscard]] const std::optional<FirstDifference>& first() const { return first_; }

 private:
  struct Expected {
    std::uint64_t time = 0;
    std::vector<std::byte> data;
  };
  void subscribe();
  void read_one();
  void read_until(Time now);
  void compare(const Edge::Incoming& message, std::uint64_t step);

  Bus& bus_;
  BagReader& recorded_;
  const TopicSelection compared_;
  const std::uint64_t first_step_;
  std::unique_ptr<Edge> edge_;
  std::uint64_t graph_ = 0;
  std::map<TopicId, std::string> names_;
  std::map<std::string, std::deque<Expected>> expected_;  // by topic, by time
  std::optional<BagMessage> ahead_;                       // read, and later than what was asked for
  std::uint64_t time_ = 0;                                // of the last look
  std::optional<FirstDifference> first_;
};

}  // namespace doppel
