// The loop of real hardware by the protocol of a 1 kHz arm: seven joints, position targets at 137 Hz from
// another thread, physics and publishing beside it. Prints the time from a tick's due time until its commands
// are written, and the ticks that were missed. Load comes from outside: stress-ng --cpu 0 in another shell.
//   build/bin/bench_control_loop [seconds = 600] [priority = 50; 0: without SCHED_FIFO]
#include "doppel/control/manager/control_loop.h"

#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

#include "doppel/ros/messages/std_msgs.h"
#include "doppel/twin/assembly/runner.h"

namespace {

using namespace doppel;

constexpr int kJoints = 7;
constexpr double kTargetRate = 137;  // Hz: it divides no rate of the loop

std::string description() {
  std::string out = "<robot name=\"seven\"><link name=\"world\"/>";
  std::string joints;
  for (int i = 1; i <= kJoints; ++i) {
    out += fmt::format(
        R"(<link name="l{0}"><inertial><mass value="0.5"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0"
 ixz="0" iyz="0"/></inertial></link><joint name="j{0}" type="revolute"><parent link="{1}"/><child
 link="l{0}"/><origin xyz="0 0 0.1"/><axis xyz="{2}"/><limit lower="-2.5" upper="2.5" effort="80"
 velocity="3"/></joint>)",
        i, i == 1 ? "world" : fmt::format("l{}", i - 1), i % 2 == 1 ? "0 0 1" : "0 1 0");
    joints += fmt::format(
        R"(<joint name="j{}"><command_interface name="position"/><state_interface name="position"/>
<state_interface name="velocity"/></joint>)",
        i);
  }
  return out +
         R"(<ros2_control name="Arm" type="system"><hardware><plugin>doppel/Loopback</plugin></hardware>)" +
         joints + "</ros2_control></robot>";
}

std::string controllers(int priority) {
  std::string joints;
  for (int i = 1; i <= kJoints; ++i) joints += fmt::format("{}j{}", i == 1 ? "" : ", ", i);
  return fmt::format(R"(controller_manager:
  ros__parameters:
    update_rate: 1000
    thread_priority: {}
    joint_state_broadcaster: {{type: joint_state_broadcaster/JointStateBroadcaster}}
    arm: {{type: forward_command_controller/ForwardCommandController}}
arm: {{ros__parameters: {{joints: [{}], interface_name: position}}}}
)",
                     priority, joints);
}

// Smooth targets, which no limit bounds.
void send_targets(Edge& edge, const std::atomic<bool>& ends) {
  const auto begin = std::chrono::steady_clock::now();
  std_msgs::msg::Float64MultiArray targets;
  targets.data.resize(kJoints);
  for (int i = 0; !ends; ++i) {
    std::this_thread::sleep_until(begin + std::chrono::duration_cast<std::chrono::nanoseconds>(
                                              std::chrono::duration<double>(i / kTargetRate)));
    for (int j = 0; j < kJoints; ++j)
      targets.data[static_cast<std::size_t>(j)] = 0.5 * std::sin(i / kTargetRate + 0.3 * j);
    static_cast<void>(
        edge.publish("/bench", "/arm/commands", "std_msgs/msg/Float64MultiArray", to_cdr(targets)));
  }
}

}  // namespace

int main(int argc, char** argv) {
  const double seconds = argc > 1 ? std::atof(argv[1]) : 600;
  const int priority = argc > 2 ? std::atoi(argv[2]) : 50;
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / fmt::format("bench_control_loop_{}", getpid());
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "arm.urdf") << description();
  std::ofstream(folder / "controllers.yaml") << controllers(priority);
  Log log;
  log.add_sink([](const LogLine& line) {
    if (line.text.find("priority") != std::string::npos || line.text.find("memory") != std::string::npos)
      fmt::print("  {}\n", line.text);
  });
  Diagnostics diagnostics;
  Scenario scenario;
  scenario.robots = {{.target = (folder / "arm.urdf").string()}};
  scenario.robots.front().controllers = {folder / "controllers.yaml"};
  scenario.hardware = HardwareUse::real;
  Twin twin(scenario, log, diagnostics);
  std::filesystem::remove_all(folder);
  const auto edge = twin.bus().attach("bench");
  std::atomic<bool> ends{false};
  std::thread sender([&] { send_targets(*edge, ends); });
  RunnerOptions options;
  options.duration = from_seconds(seconds);
  const std::atomic<bool> never{false};
  Runner(twin, options).run(never);
  ends = true;
  sender.join();
  const auto held = twin.hold();
  const LoopStatistics* const loop = twin.robot().controller_manager().loop_statistics();
  if (loop == nullptr) return 1;
  fmt::print(
      "1 kHz, {} joints, targets at {:g} Hz, {}: {} ticks, due until commands written, us: p50 {:.0f}  p99 "
      "{:.0f}  "
      "p99.9 {:.0f}  largest {:.0f};  {} missed\n",
      kJoints, kTargetRate, priority > 0 ? fmt::format("SCHED_FIFO {}", priority) : "the usual scheduler",
      loop->ticks, loop->lateness.percentile(0.5), loop->lateness.percentile(0.99),
      loop->lateness.percentile(0.999), loop->lateness.worst(), loop->overruns);
  return 0;
}
