// The cost of spawning a robot for the loop of those that run: the longest pass of a real-time loop, without
// and with a spawn.
//   build/bin/bench_spawn [robot] [spawned robot] [spawns] [engine]
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <thread>
#include <vector>

#include "doppel/ros/messages/gazebo_msgs.h"
#include "doppel/twin/assembly/twin.h"

namespace {

using Clock = std::chrono::steady_clock;

doppel::Scenario scenario_of(const std::string& target, const std::string& engine) {
  doppel::Scenario out;
  out.robots = {{.target = target, .name_space = "first"}};
  out.bundled_robots = DOPPEL_ROBOTS;
  out.engine = engine;
  return out;
}

// Passes of the loop, one per millisecond, until `done`; returns the longest, ms.
template <typename Done>
double longest_pass(doppel::Twin& twin, const Done& done) {
  double out = 0;
  for (auto next = Clock::now(); !done(); next += std::chrono::milliseconds(1)) {
    std::this_thread::sleep_until(next);
    const auto begin = Clock::now();
    twin.between_steps();
    twin.step();
    out = std::max(out, 1e3 * std::chrono::duration<double>(Clock::now() - begin).count());
  }
  return out;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

}  // namespace

int main(int argc, char** argv) {
  const std::string robot = argc > 1 ? argv[1] : "omarm_one", guest = argc > 2 ? argv[2] : "omarm_one";
  const int spawns = argc > 3 ? std::max(1, std::atoi(argv[3])) : 10;
  const std::string engine = argc > 4 ? argv[4] : doppel::kDefaultEngine;
  const doppel::Log log;
  doppel::Diagnostics diagnostics;
  const std::string xml =
      doppel::Twin(scenario_of(guest, engine), log, diagnostics).robot().description().xml;
  doppel::Twin twin(scenario_of(robot, engine), log, diagnostics);
  const auto edge = twin.bus().attach("bench");
  std::vector<double> quiet, during, taken;
  for (int i = 0; i < spawns; ++i) {
    int passes = 0;
    quiet.push_back(longest_pass(twin, [&] { return ++passes > 300; }));
    doppel::gazebo_msgs::srv::SpawnEntity::Request request;
    request.name = request.robot_namespace = fmt::format("guest_{}", i);
    request.initial_pose.position.x = 2;
    request.initial_pose.orientation.w = 1;
    request.xml = xml;
    bool answered = false;
    doppel::gazebo_msgs::srv::SpawnEntity::Response response;
    const auto begin = Clock::now();
    edge->call("/spawn_entity", doppel::to_cdr(request),
               [&](const doppel::Status& status, doppel::Bytes cdr) {
                 answered = true;
                 if (status) static_cast<void>(doppel::from_cdr(cdr, response));
               });
    during.push_back(longest_pass(twin, [&] { return answered; }));
    taken.push_back(1e3 * std::chrono::duration<double>(Clock::now() - begin).count());
    if (!response.success) {
      fmt::print(stderr, "'{}' was not spawned: {}\n", guest, response.status_message);
      return 1;
    }
    static_cast<void>(twin.remove_robot(request.name));
  }
  fmt::print("{} beside {} in {}, {} spawns, medians of the longest pass of a loop of 1 kHz\n", guest, robot,
             engine, spawns);
  fmt::print("  without {:8.2f} ms\n  with    {:8.2f} ms, most {:.2f} ms; in the world after {:.0f} ms\n",
             median(quiet), median(during), *std::max_element(during.begin(), during.end()), median(taken));
}
