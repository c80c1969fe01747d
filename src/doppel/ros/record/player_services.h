#pragma once
// The services of rosbag2's player, as node /rosbag2_player: pause, resume, toggle_paused, is_paused,
// get_rate, set_rate, play_next, burst, seek, play and stop.

#include <deque>
#include <functional>

#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/messages/rosbag2_interfaces.h"
#include "doppel/ros/record/bag_player.h"

namespace doppel {

// The bus's thread only. The bus and the player outlive it.
class DOPPEL_API PlayerServices {
 public:
  using Clock = BagPlayer::Clock;

  PlayerServices(Bus& bus, BagPlayer& player);

  // Does what was asked for, between two calls of BagPlayer::play(). Of a burst a part, so that other
  // requests are answered meanwhile.
  void work(Clock::time_point now);
  // work() has more to do at once.
  [[nodiscard]] bool is_busy() const { return !requests_.empty() || !bursts_.empty(); }

 private:
  using BurstService = rosbag2_interfaces::srv::Burst;
  struct Burst {
    std::uint64_t count = 0, done = 0;  // count 0: to the end
    Responder<BurstService::Response> respond;
  };
  // Requests come while the player publishes, and wait until it is done.
  template <Service S, class Act>
  void serve(const char* name, Act act);
  void serve_pace();
  void serve_place();
  void go_on(Clock::time_point now);

  BagPlayer& player_;
  Node node_;
  std::deque<std::function<void(Clock::time_point)>> requests_;
  std::deque<Burst> bursts_;
};

}  // namespace doppel
