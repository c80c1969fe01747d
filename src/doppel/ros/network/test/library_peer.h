#pragma once
// Another program of the graph, made with the client library, on its own thread.

#include <future>
#include <thread>

#include "doppel/ros/network/node.h"
#include "network.h"

namespace doppel::ros2::test {

inline ContextOptions quiet_context(const OwnDomain& domain) {
  return {.network = on_domain(domain), .arguments = {}, .catch_signals = false, .log_to_stderr = false};
}

class Peer {
 public:
  // `set_up` creates and returns what lives as long as the peer.
  template <class SetUp>
  Peer(ContextOptions options, SetUp set_up) {
    std::promise<void> ready;
    auto is_ready = ready.get_future();
    thread_ = std::thread([this, options = std::move(options), set_up, &ready] {
      Context context(options);
      const auto contents = set_up(context);
      context.spin_until([&] { return context.network().state != NetworkStatus::State::joining; }, kTimeout);
      ready.set_value();
      context.spin_until([this] { return done_.load(); }, std::chrono::hours(1));
    });
    is_ready.wait();
  }
  ~Peer() { stop(); }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  // Ends it and announces that to the graph.
  void stop() {
    done_ = true;
    if (thread_.joinable()) thread_.join();
  }

 private:
  std::atomic<bool> done_{false};
  std::thread thread_;
};

}  // namespace doppel::ros2::test
