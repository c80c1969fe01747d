// The cost of an open page for the loop: its busy time at real-time speed, in turns without a client, with
// one that subscribes to what the page subscribes to, and while that one drags the tool (it asks for inverse
// kinematics 60 times a second), in one run; with the memory of the process and the time of the answers:
// build/bin/bench_page_cost [robot] [rounds]
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <thread>
#include <vector>

#include "doppel/ros/client/websocket_client.h"
#include "doppel/ros/messages/doppel_msgs.h"
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
  Listener(std::uint16_t port, bool drags, std::vector<double>& answers)
      : drags_(drags), answers_(answers), thread_([this, port] { run(port); }) {}
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
    auto next_goal = steady_clock::now();
    std::uint32_t call = 0;
    Client::Answer answer;
    while (!done_) {
      const auto now = steady_clock::now();
      if (call != 0 && client.take_answer(call, answer)) {
        answers_.push_back(std::chrono::duration<double, std::milli>(now - asked_at_).count());
        call = 0;
      }
      if (drags_ && call == 0 && now >= next_goal) {
        next_goal = now + std::chrono::milliseconds(16);
        call = drag(client);
      }
      const auto patience = std::chrono::milliseconds(call != 0 ? 1 : drags_ ? 5 : 50);
      if (client.next(message, now + patience)) ++messages_;
    }
  }

  // Asks for the next goal of a tool that is moved on a circle: most of it within reach, some beyond.
  std::uint32_t drag(WebSocketClient& client) {
    angle_ += 0.02;
    doppel_msgs::srv::SolveIk::Request request;
    request.task = "position";
    request.pose.pose.position = {0.3 * std::cos(angle_), 0.3 * std::sin(angle_), 0.25};
    request.pose.pose.orientation.w = 1;
    asked_at_ = steady_clock::now();
    return client.begin_call("/doppel/ik", to_cdr(request));
  }

  const bool drags_;
  std::vector<double>& answers_;  // ms
  double angle_ = 0;
  steady_clock::time_point asked_at_;
  std::atomic<bool> done_{false};
  std::atomic<std::uint64_t> messages_{0};
  std::thread thread_;
};

// MB that the process has in memory.
double resident() {
  std::ifstream file("/proc/self/statm");
  double pages = 0, resident_pages = 0;
  file >> pages >> resident_pages;
  return resident_pages * 4096 / 1e6;
}

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
  std::vector<double> alone, watched, cost, dragged, answers;
  double messages = 0;
  const double before = resident();
  double watched_memory = 0;
  for (int round = 0; round < rounds; ++round) {
    alone.push_back(load_of_block(twin));
    std::uint64_t received = 0;
    {
      const Listener page(server.port(), false, answers);
      load_of_block(twin);  // connecting and subscribing are not measured
      received = page.messages();
      watched.push_back(load_of_block(twin));
      received = page.messages() - received;
    }
    load_of_block(twin);  // neither is disconnecting
    if (round == 0) watched_memory = resident();
    {
      const Listener page(server.port(), true, answers);
      load_of_block(twin);
      dragged.push_back(load_of_block(twin));
    }
    load_of_block(twin);
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
  fmt::print(
      "  it drags       {:7.3f} %  ({:.2f} times a page that does not; answers in {:.2f} ms, median of {})\n",
      100 * median(dragged), median(dragged) / median(watched), median(answers), answers.size());
  fmt::print("  memory         {:7.1f} MB before, {:.1f} MB after a page, {:.1f} MB after the drags\n",
             before, watched_memory, resident());
}
