// The accuracy of real time: simulates the given number of seconds at --speed 1 and prints the wall-clock
// time, and the lateness of steps:
//   build/bin/bench_pace [seconds] [robot]
#include <fmt/format.h>

#include <atomic>
#include <cstdlib>

#include "doppel/twin/assembly/runner.h"

int main(int argc, char** argv) {
  const double seconds = argc > 1 ? std::atof(argv[1]) : 60.0;
  doppel::Log log;
  doppel::Diagnostics diagnostics;
  doppel::Scenario scenario;
  scenario.robots = {{.target = argc > 2 ? argv[2] : "omarm_one"}};
  scenario.bundled_robots = DOPPEL_ROBOTS;
  doppel::Twin twin(scenario, log, diagnostics);
  doppel::RunnerOptions options;
  options.duration = doppel::from_seconds(seconds);
  const std::atomic<bool> never{false};
  doppel::Runner runner(twin, options);
  const doppel::RunStatistics run = runner.run(never);
  const double wall = static_cast<double>(run.wall.count()) * 1e-9;
  fmt::print("{}: {:.3f} s simulated in {:.4f} s, off by {:+.4f} %\n", scenario.robots.front().target,
             doppel::to_seconds(run.simulated), wall,
             (wall / doppel::to_seconds(run.simulated) - 1.0) * 100.0);
  fmt::print(
      "  a step began late by  p50 {:.1f} us  p99 {:.1f} us  p99.9 {:.1f} us  worst {:.1f} us  ({} "
      "overruns)\n",
      run.lateness.percentile(0.5), run.lateness.percentile(0.99), run.lateness.percentile(0.999),
      run.lateness.worst(), run.overruns);
}
