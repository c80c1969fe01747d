#pragma once
// Foxglove's control of a recording that is played: requests of clients to the player, and its state to all
// of them. A mailbox between the server's thread and the player's.

#include <functional>
#include <mutex>
#include <utility>
#include <vector>

#include "doppel/export.h"
#include "doppel/ros/foxglove/foxglove_protocol.h"

namespace doppel {

class DOPPEL_API PlaybackControl {
 public:
  PlaybackControl(Time begin, Time end) : range_(begin, end) {}

  [[nodiscard]] std::pair<Time, Time> range() const { return range_; }

  // -- the server's thread
  void request(foxglove::PlaybackRequest request);
  // Called with each state on the player's thread; empty: no server any more.
  void on_report(std::function<void(const foxglove::PlaybackState&)> callback);

  // -- the player's thread
  [[nodiscard]] std::vector<foxglove::PlaybackRequest> take();
  void report(const foxglove::PlaybackState& state);

 private:
  const std::pair<Time, Time> range_;
  std::mutex mutex_;
  std::vector<foxglove::PlaybackRequest> requests_;
  std::function<void(const foxglove::PlaybackState&)> callback_;
};

}  // namespace doppel
