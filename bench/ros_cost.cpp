// The cost of ROS 2's network for the loop: its CPU time at real-time speed, in turns without and with five
// subscribers, each a separate process, to what RViz and a logger read, /joint_states and the controllers'
// states at 1 kHz, in one run: build/bin/bench_ros_cost [rounds]
#include <fcntl.h>
#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <memory>

#include "doppel/ros/network/bridge.h"
#include "ros_peers.h"

namespace {

using namespace doppel;
using std::chrono::steady_clock;

constexpr Duration kBlock{2'000'000'000};  // simulated and real
constexpr std::size_t kPeers = 5;
constexpr std::array<std::pair<const char*, const char*>, 5> kTopics{
    {{"/joint_states", "sensor_msgs/msg/JointState"},
     {"/dynamic_joint_states", "control_msgs/msg/DynamicJointState"},
     {"/omarm_arm_controller/controller_state", "control_msgs/msg/JointTrajectoryControllerState"},
     {"/tf", "tf2_msgs/msg/TFMessage"},
     {"/clock", "rosgraph_msgs/msg/Clock"}}};

volatile std::sig_atomic_t g_stop = 0;

// A subscriber: reads messages until it is stopped, then prints their number.
int subscribe() {
  std::signal(SIGTERM, [](int) { g_stop = 1; });
  bench::end_with_parent();
  const auto participant = ros2::make_participant(bench::own_domain(), [] {});
  std::vector<std::unique_ptr<ros2::Reader>> readers;
  for (const auto& [name, type] : kTopics)
    readers.push_back(participant->make_reader(bench::topic(name, type)));
  ros2::Sample sample;
  std::uint64_t count = 0, lost = 0;
  while (g_stop == 0) {
    for (const auto& reader : readers) {
      while (reader->take(sample)) ++count;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  for (const auto& reader : readers) lost += reader->lost();
  fmt::print("{} {}\n", count, lost);
  return 0;
}

// The CPU time of the loop's thread so far: other programs do not count.
double processor_seconds() {
  timespec used{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &used);
  return static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
}

// Busy seconds of the loop for each second of its time, step by step as the runner paces it.
double load_of_block(Twin& twin) {
  const auto begin = steady_clock::now();
  const Time start = twin.now();
  double work = 0;
  while (twin.now() - start < kBlock) {
    std::this_thread::sleep_until(begin + (twin.now() - start));
    const double woken = processor_seconds();
    twin.between_steps();
    twin.step();
    work += processor_seconds() - woken;
  }
  return work / to_seconds(kBlock);
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

// Until all peers are matched with everything.
void gather(Twin& twin, const ros2::Bridge& bridge, std::size_t peers) {
  const auto end = steady_clock::now() + std::chrono::seconds(60);
  for (const auto& [name, type] : kTopics) {
    while (bridge.matches(name).readers != peers) {
      if (steady_clock::now() > end)
        throw std::runtime_error(fmt::format("{} has {} readers, not {}: does another program use domain {}?",
                                             name, bridge.matches(name).readers, peers,
                                             bench::own_domain().domain));
      load_of_block(twin);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 1 && std::string_view(argv[1]) == "--subscribe") return subscribe();
  const int rounds = argc > 1 ? std::max(1, std::atoi(argv[1])) : 5;
  const Log log;
  Diagnostics diagnostics;
  bench::FastScenario fast;
  Twin twin(fast.scenario, log, diagnostics);
  const ros2::Bridge bridge(twin.bus(), {.network = bench::own_domain(), .diagnostics_node = ""}, log);

  load_of_block(twin);  // settle, and warm up
  std::vector<double> alone, listened, cost;
  double sent = 0;
  std::string received;
  for (int round = 0; round < rounds; ++round) {
    alone.push_back(load_of_block(twin));
    {
      std::vector<std::unique_ptr<bench::Peer>> peers;
      for (std::size_t i = 0; i < kPeers; ++i) peers.push_back(std::make_unique<bench::Peer>("--subscribe"));
      gather(twin, bridge, kPeers);
      const std::uint64_t before = bridge.status().sent;
      listened.push_back(load_of_block(twin));
      sent += static_cast<double>(bridge.status().sent - before) / to_seconds(kBlock) / rounds;
      for (const auto& peer : peers) received = peer->end();
    }
    gather(twin, bridge, 0);
    cost.push_back(listened.back() - alone.back());
  }
  fmt::print("omarm_one at 1 kHz: {} rounds of {:g} s in real time, medians\n", rounds, to_seconds(kBlock));
  fmt::print("  no subscribers    {:7.3f} % of the time the loop is busy\n", 100 * median(alone));
  fmt::print("  {} subscribers     {:7.3f} %  ({:.0f} messages/s to each; the last one got, lost: {})\n",
             kPeers, 100 * median(listened), sent, received.substr(0, received.find('\n')));
  fmt::print("  the network costs {:7.3f} % of the loop's time  (least {:.3f}, most {:.3f})\n",
             100 * median(cost), 100 * *std::min_element(cost.begin(), cost.end()),
             100 * *std::max_element(cost.begin(), cost.end()));
}
