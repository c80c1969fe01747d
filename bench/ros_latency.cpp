// The latency from a command on ROS 2's network to the state that shows it, on loopback, with the controllers
// at 1 kHz: a separate process sends trajectories at times independent of the loop and waits until the
// controller's state follows them: build/bin/bench_ros_latency
#include <fcntl.h>
#include <fmt/format.h>

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <random>

#include "doppel/ros/messages/control_msgs.h"
#include "doppel/ros/messages/trajectory_msgs.h"
#include "doppel/ros/network/bridge.h"
#include "doppel/twin/assembly/runner.h"
#include "ros_peers.h"

namespace {

using namespace doppel;
using control_msgs::msg::JointTrajectoryControllerState;
using std::chrono::steady_clock;
using trajectory_msgs::msg::JointTrajectory;

constexpr std::size_t kCommands = 2000;

JointTrajectory command(double position) {
  JointTrajectory trajectory;
  for (int joint = 1; joint <= 6; ++joint)
    trajectory.joint_names.push_back(fmt::format("Revolute {}", joint));
  trajectory.points.resize(1);
  trajectory.points[0].positions.assign(6, position);
  return trajectory;
}

// Sends and waits; prints the percentiles.
int ask() {
  bench::end_with_parent();
  bench::Bell bell;
  const auto participant = ros2::make_participant(bench::own_domain(), [&bell] { bell.ring(); });
  const auto writer = participant->make_writer(
      bench::topic("/omarm_arm_controller/joint_trajectory", JointTrajectory::kType));
  const auto reader = participant->make_reader(bench::topic(
      "/omarm_arm_controller/controller_state", JointTrajectoryControllerState::kType, {.depth = 1000}));
  while (writer->matched() == 0 || !reader->is_ready()) bell.wait(std::chrono::milliseconds(100));
  std::mt19937 random(1);
  std::uniform_int_distribution<int> pause(3000, 6000);  // microseconds
  std::vector<double> milliseconds;
  ros2::Sample sample;
  JointTrajectoryControllerState state;
  for (std::size_t i = 0; i < kCommands; ++i) {
    std::this_thread::sleep_for(std::chrono::microseconds(pause(random)));
    const double position = 1e-5 * static_cast<double>(i + 1);
    const Bytes bytes = to_cdr(command(position));
    while (reader->take(sample)) {
    }
    const auto begin = steady_clock::now();
    writer->write(bytes);
    for (bool seen = false; !seen && steady_clock::now() - begin < std::chrono::seconds(1);) {
      while (!seen && reader->take(sample))
        seen = from_cdr(sample.cdr, state) && state.reference.positions.at(0) == position;
      if (!seen) bell.wait(std::chrono::milliseconds(100));
    }
    milliseconds.push_back(std::chrono::duration<double, std::milli>(steady_clock::now() - begin).count());
  }
  std::sort(milliseconds.begin(), milliseconds.end());
  const auto at = [&](double p) {
    return milliseconds[static_cast<std::size_t>(p * static_cast<double>(milliseconds.size() - 1))];
  };
  fmt::print("p50 {:.3f} ms  p90 {:.3f} ms  p99 {:.3f} ms  worst {:.3f} ms", at(0.5), at(0.9), at(0.99),
             at(1));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 1 && std::string_view(argv[1]) == "--ask") return ask();
  const Log log;
  Diagnostics diagnostics;
  bench::FastScenario fast;
  Twin twin(fast.scenario, log, diagnostics);
  const ros2::Bridge bridge(twin.bus(), {.network = bench::own_domain(), .diagnostics_node = ""}, log);
  std::atomic<bool> stop{false};
  std::string measured;
  std::thread peer([&] {
    measured = bench::Peer("--ask").output();
    stop = true;
  });
  Runner runner(twin, {});
  const RunStatistics run = runner.run(stop);
  peer.join();
  fmt::print(
      "omarm_one at 1 kHz, {} trajectories, from sending one to the controller's state that follows it\n",
      kCommands);
  fmt::print("  {}\n  (steps began late by p50 {:.0f} us, p99 {:.0f} us)\n", measured,
             run.lateness.percentile(0.5), run.lateness.percentile(0.99));
}
