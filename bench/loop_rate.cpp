// The whole loop (physics, servos, controllers, publishing with no listener) at full speed, against a bare
// mj_step on the same compiled model, in turn, in one run:  build/bin/bench_loop_rate [robot] [rounds]
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <vector>

#include "doppel/physics/mujoco/mujoco_engine.h"
#include "doppel/twin/twin.h"

namespace {

constexpr int kSteps = 20000;

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

double loop_rate(doppel::Twin& twin) {
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < kSteps; ++i) {
    twin.between_steps();
    twin.step();
  }
  return kSteps / std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace

int main(int argc, char** argv) {
  const int rounds = argc > 2 ? std::max(1, std::atoi(argv[2])) : 15;
  doppel::Log log;
  doppel::Diagnostics diagnostics;
  doppel::Scenario scenario;
  scenario.target = argc > 1 ? argv[1] : "omarm_one";
  scenario.bundled_robots = DOPPEL_ROBOTS;
  doppel::Twin twin(scenario, log, diagnostics);

  loop_rate(twin);  // settle into the hold, and warm up
  std::vector<double> loop, bare, ratio;
  for (int round = 0; round < rounds; ++round) {
    loop.push_back(loop_rate(twin));
    bare.push_back(doppel::measure_bare_step_rate(twin.engine(), kSteps));
    ratio.push_back(loop.back() / bare.back());
  }
  fmt::print("{}: {} rounds of {} steps, medians\n", scenario.target, rounds, kSteps);
  fmt::print("  bare mj_step   {:10.0f} steps/s  {:6.2f} us\n", median(bare), 1e6 / median(bare));
  fmt::print("  whole loop     {:10.0f} steps/s  {:6.2f} us\n", median(loop), 1e6 / median(loop));
  fmt::print("  ratio          {:10.3f}  (least {:.3f}, most {:.3f})\n", median(ratio),
             *std::min_element(ratio.begin(), ratio.end()), *std::max_element(ratio.begin(), ratio.end()));
}
