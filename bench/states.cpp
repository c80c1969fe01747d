// Many states of one compiled world: the cost of a further one, and how their steps scale with the cores.
//   build/bin/bench_states [robot] [states] [engine]
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <thread>
#include <vector>

#include "doppel/twin/assembly/twin.h"

namespace {

using Clock = std::chrono::steady_clock;
constexpr int kSteps = 2000;  // of each state in a round
constexpr int kRounds = 9;
constexpr int kRepetitions = 50;

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

// Median time of one call, us.
template <typename Call>
double cost(const Call& call) {
  std::vector<double> out;
  for (int i = 0; i < kRepetitions; ++i) {
    const auto begin = Clock::now();
    call();
    out.push_back(1e6 * seconds_since(begin));
  }
  return median(out);
}

// Steps per second of all states together, distributed to `threads`.
double rate(std::vector<std::unique_ptr<doppel::Engine>>& states, unsigned threads) {
  std::atomic<std::size_t> next{0};
  const auto begin = Clock::now();
  {
    std::vector<std::jthread> workers;
    for (unsigned t = 0; t < threads; ++t) {
      workers.emplace_back([&] {
        for (std::size_t i = next++; i < states.size(); i = next++) {
          for (int step = 0; step < kSteps; ++step) states[i]->step();
        }
      });
    }
  }
  return static_cast<double>(states.size()) * kSteps / seconds_since(begin);
}

}  // namespace

int main(int argc, char** argv) {
  doppel::Scenario scenario;
  scenario.robots = {{.target = argc > 1 ? argv[1] : "omarm_one"}};
  scenario.bundled_robots = DOPPEL_ROBOTS;
  const int count = argc > 2 ? std::max(1, std::atoi(argv[2])) : 64;
  if (argc > 3) scenario.engine = argv[3];
  const doppel::Log log;
  doppel::Diagnostics diagnostics;
  doppel::Twin twin(scenario, log, diagnostics);
  for (int i = 0; i < 500; ++i) twin.step();  // until the robot is held
  doppel::Engine& engine = twin.engine();
  const std::shared_ptr<const doppel::CompiledWorld> world = engine.compiled();

  std::vector<std::unique_ptr<doppel::Engine>> kept;
  fmt::print("{} in {} {}\n", scenario.robots.front().target, world->capabilities().name,
             world->capabilities().version);
  const double make = cost([&] { kept.push_back(world->make_engine()); });
  const double clone = cost([&] { kept.push_back(engine.clone()); });
  const double copy = cost([&] { kept.front()->copy_state(engine); });
  fmt::print("  a further state   make_engine {:6.1f} us   clone {:6.1f} us   copy_state {:6.1f} us\n", make,
             clone, copy);
  kept.clear();

  std::vector<std::unique_ptr<doppel::Engine>> states;
  for (int i = 0; i < count; ++i) states.push_back(engine.clone());
  const unsigned cores = std::max(1u, std::thread::hardware_concurrency());
  std::vector<double> one, all;
  for (int round = 0; round < kRounds; ++round) {
    one.push_back(rate(states, 1));
    all.push_back(rate(states, cores));
  }
  fmt::print("  {} states, {} rounds of {} steps each, medians\n", count, kRounds, kSteps);
  fmt::print("  on 1 core   {:10.0f} steps/s\n  on {} cores  {:10.0f} steps/s  {:.2f} times\n", median(one),
             cores, median(all), median(all) / median(one));
}
