// The cost of saving and restoring a twin: of every bundled robot and of a world with 50 boxes, with each
// engine. A saved state is written into the memory of a former one, as the automatic states are, and into
// new memory, as those with a name; a restore publishes the present state, too. Medians and largest values
// of wall-clock time.   bench_save [REPETITIONS]
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <string>
#include <vector>

#include "doppel/twin/assembly/twin.h"
#include "doppel/twin/loop/saved_state.h"

namespace doppel {
namespace {

using Clock = std::chrono::steady_clock;

struct Times {
  std::vector<double> us;
  void add(Clock::duration time) { us.push_back(std::chrono::duration<double, std::micro>(time).count()); }
  [[nodiscard]] std::string text() {
    std::ranges::sort(us);
    return fmt::format("{:8.1f} {:8.1f}", us[us.size() / 2], us.back());
  }
};

void add_boxes(Twin& twin, int count) {
  std::vector<ModelInstance> instances = twin.engine().world().instances();
  CollisionMeshes meshes;
  Diagnostics none;
  for (int i = 0; i < count; ++i) {
    WorldObject box;
    box.name = fmt::format("box_{}", i);
    box.shape = Box{{0.1, 0.1, 0.1}};
    box.X_WO.translation() = Eigen::Vector3d(1 + 0.2 * (i % 10), 0.2 * (i / 10), 0.051);
    box.mass = 1;
    instances.push_back(make_instance(box, meshes, none));
  }
  twin.engine().set_instances(std::move(instances));
}

void run(Twin& twin, double seconds) {
  const Time end = twin.now() + from_seconds(seconds);
  while (twin.now() < end) {
    twin.between_steps();
    twin.step();
  }
}

void measure(const std::string& robot, const std::string& engine, int boxes, int repetitions) {
  Scenario scenario;
  scenario.bundled_robots = DOPPEL_ROBOTS;
  scenario.robots = {{.target = robot}};
  scenario.engine = engine;
  Log log;
  Diagnostics diagnostics;
  Twin twin(scenario, log, diagnostics);
  if (boxes > 0) add_boxes(twin, boxes);
  run(twin, 0.6);
  Times fresh, automatic, restored;
  for (int i = 0; i < repetitions; ++i) {
    const auto begin = Clock::now();
    const auto saved = twin.save();
    fresh.add(Clock::now() - begin);
    run(twin, 0.02);
    const auto middle = Clock::now();
    if (const Status status = twin.restore(*saved); !status) throw std::runtime_error(status.why());
    restored.add(Clock::now() - middle);
    run(twin, 0.021);
  }
  // The automatic states of the loop, one each 0.5 s, of which all have their memory after the first 60.
  Time next = twin.now();
  twin.keep_states(true);
  for (int i = 0; i < 60 + std::min(repetitions, 20);) {
    const bool is_due = twin.now() >= next;
    const auto begin = Clock::now();
    twin.between_steps();
    const auto time = Clock::now() - begin;
    if (is_due && i >= 60) automatic.add(time);
    if (is_due) {
      ++i;
      next = twin.now() + std::chrono::milliseconds(500);
    }
    twin.step();
  }
  fmt::print("{:<14} {:<7} {:>3}   {}   {}   {}\n", robot, engine, boxes, fresh.text(), automatic.text(),
             restored.text());
  std::fflush(stdout);
}

int main_of(int count, char** words) {
  const int repetitions = count > 1 ? std::atoi(words[1]) : 200;
  fmt::print("us, median and largest\n{:<14} {:<7} boxes {:>17}   {:>17}   {:>17}\n", "robot", "engine",
             "save", "automatic", "restore");
  for (const std::string engine : {"mujoco", "bullet"}) {
    for (const char* robot : {"omarm_one", "omarm_zero", "lab_arm", "kate", "turtle", "ackermann_car",
                              "rover_mecanum", "rover_skid"})
      measure(robot, engine, 0, repetitions);
    measure("omarm_one", engine, 50, repetitions);
  }
  return 0;
}

}  // namespace
}  // namespace doppel

int main(int count, char** words) {
  return doppel::main_of(count, words);
}
