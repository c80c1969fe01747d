// The cost of an open page for the loop: the loop's busy time at real-time speed, in turns without and with a
// client that subscribes to what the page subscribes to, in one run: build/bin/bench_page_cost [robot]
// [rounds]
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <thread>
#include <vector>

#include "doppel/ros/client/websocket_client.h"
#include "doppel/ros/server/server.h"
#include "doppel/twin/assembly/twin.h"

namespace {

using namespace doppel;

using std::chrono::steady_clock;

constexpr Duration kBlock{2'000'000'000};  // simulated and real
constexpr int kBurst = 20;                 // steps

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

// Busy seconds of the loop for each second of its time: in bursts, so that sleeping and waking, which cost
// more and vary more than what is measured, are excluded.
double load_of_block(Twin& twin) {
  const auto begin = steady_clock::now();
  const Time start = twin.now();
  steady_clock::duration work{};
  while (twin.now() - start < kBlock) {
    std::this_thread::sleep_until(begin + (twin.now() - start));
    const auto burst = steady_clock::now();
    for (int i = 0; i < kBurst; ++i) {
      twin.between_steps();
      twin.step();
    }
    work += steady_clock::now() - burst;
  }
  return static_cast<double>(work.count()) / static_cast<double>(kBlock.count());
}

// Reads what the page reads, as fast as it arrives.
class Listener {
 public:
  explicit Listener(std::uint16_t port) : thread_([this, port] { run(port); }) {}
  ~Listener() {
    done_ = true;
    thread_.join();
  }
  [[nodiscard]] std::uint64_t messages() const { return messages_; }

 private:
  void run(std::uint16_t port) {
    ClientOptions options;
    options.port = port;
    WebSocketClient client(options);
    for (const auto& [topic, entry] : client.topics()) {
      const bool state = topic.ends_with("/controller_state") || topic.starts_with("/tf") ||
                         topic == "/joint_states" || topic == "/clock" || topic == "/rosout" ||
                         topic.starts_with("/doppel/");
      if (state && !entry.type.empty()) client.subscribe(topic);
    }
    Client::Received message;
    while (!done_) {
      if (client.next(message, steady_clock::now() + std::chrono::milliseconds(50))) ++messages_;
    }
  }

  std::atomic<bool> done_{false};
  std::atomic<std::uint64_t> messages_{0};
  std::thread thread_;
};

}  // namespace

int main(int argc, char** argv) {
  const int rounds = argc > 2 ? std::max(1, std::atoi(argv[2])) : 9;
  const Log log;
  Diagnostics diagnostics;
  Scenario scenario;
  scenario.robots = {{.target = argc > 1 ? argv[1] : "omarm_one"}};
  scenario.bundled_robots = DOPPEL_ROBOTS;
  Twin twin(scenario, log, diagnostics);
  const Server server(twin.bus(), {.port = 0}, log);

  load_of_block(twin);  // settle, and warm up
  std::vector<double> alone, watched, cost;
  double messages = 0;
  for (int round = 0; round < rounds; ++round) {
    alone.push_back(load_of_block(twin));
    std::uint64_t received = 0;
    {
      const Listener page(server.port());
      load_of_block(twin);  // connecting and subscribing are not measured
      received = page.messages();
      watched.push_back(load_of_block(twin));
      received = page.messages() - received;
    }
    load_of_block(twin);  // neither is disconnecting
    messages += static_cast<double>(received) / to_seconds(kBlock) / rounds;
    cost.push_back(watched.back() - alone.back());
  }
  fmt::print("{}: {} rounds of {:g} s in real time, medians\n", scenario.robots.front().target, rounds,
             to_seconds(kBlock));
  fmt::print("  no page        {:7.3f} % of the time the loop is busy\n", 100 * median(alone));
  fmt::print("  a page open    {:7.3f} %  ({:.0f} messages/s)\n", 100 * median(watched), messages);
  fmt::print("  the page costs {:7.3f} % of the loop's time  (least {:.3f}, most {:.3f})\n",
             100 * median(cost), 100 * *std::min_element(cost.begin(), cost.end()),
             100 * *std::max_element(cost.begin(), cost.end()));
}
