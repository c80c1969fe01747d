// The whole loop (physics, servos, controllers, publishing without subscribers) at full speed, compared with
// a bare mj_step on the same compiled model, the integrators of world files with each other, four such robots
// in one world, and four arms with two mobile bases, in turn, in one run:  build/bin/bench_loop_rate [robot] [rounds]
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <vector>

#include "doppel/physics/contract/test/mujoco_extras.h"
#include "doppel/twin/assembly/twin.h"

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

// Robots in an otherwise empty world, 1 m apart.
struct Contender {
  Contender(const std::vector<std::string>& targets, const char* integrator) : name(integrator) {
    const std::filesystem::path world = std::filesystem::temp_directory_path() /
                                        fmt::format("bench_loop_rate_{}_{}.yaml", getpid(), integrator);
    std::ofstream(world) << "integrator: " << integrator << "\n";
    doppel::Scenario scenario;
    for (const std::string& target : targets) {
      const std::size_t i = scenario.robots.size();
      doppel::WorldRobot& robot = scenario.robots.emplace_back();
      robot.target = target;
      if (targets.size() > 1) robot.name_space = fmt::format("robot_{}", i);
      robot.X_WR = doppel::make_pose({1.0 * static_cast<double>(i), 0, 0}, {0, 0, 0});
    }
    scenario.bundled_robots = DOPPEL_ROBOTS;
    scenario.world = world;
    twin = std::make_unique<doppel::Twin>(scenario, log, diagnostics);
    std::filesystem::remove(world);
    loop_rate(*twin);  // settle, and warm up
  }

  std::string name;
  doppel::Log log;
  doppel::Diagnostics diagnostics;
  std::unique_ptr<doppel::Twin> twin;
  std::vector<double> rates;
};

}  // namespace

int main(int argc, char** argv) {
  const std::string target = argc > 1 ? argv[1] : "omarm_one";
  const int rounds = argc > 2 ? std::max(1, std::atoi(argv[2])) : 15;
  std::vector<std::unique_ptr<Contender>> contenders;
  for (const char* integrator : doppel::kIntegratorNames)
    contenders.push_back(std::make_unique<Contender>(std::vector{target}, integrator));
  Contender& euler = *contenders.front();
  Contender four(std::vector(4, target), doppel::kIntegratorNames[0]);
  Contender mixed({"omarm_one", "omarm_one", "omarm_one", "omarm_one", "kate", "kate"},
                  doppel::kIntegratorNames[0]);

  std::vector<double> bare, ratio;
  for (int round = 0; round < rounds; ++round) {
    for (const auto& contender : contenders) contender->rates.push_back(loop_rate(*contender->twin));
    for (Contender* const several : {&four, &mixed}) several->rates.push_back(loop_rate(*several->twin));
    bare.push_back(doppel::measure_bare_step_rate(euler.twin->engine(), kSteps));
    ratio.push_back(euler.rates.back() / bare.back());
  }
  fmt::print("{}: {} rounds of {} steps, medians\n", target, rounds, kSteps);
  fmt::print("  bare mj_step (Euler)   {:10.0f} steps/s  {:6.2f} us\n", median(bare), 1e6 / median(bare));
  for (const auto& contender : contenders) {
    fmt::print("  whole loop, {:<9}  {:10.0f} steps/s  {:6.2f} us\n", contender->name,
               median(contender->rates), 1e6 / median(contender->rates));
  }
  for (const auto& [name, several] :
       {std::pair("four robots", &four), std::pair("4 arms, 2 bases", &mixed)}) {
    const double rate = median(several->rates);
    const double bare_rate = doppel::measure_bare_step_rate(several->twin->engine(), kSteps);
    fmt::print("  {:<21}  {:10.0f} steps/s  {:6.2f} us, bare mj_step {:.2f}; {:.1f} x real time at 1 kHz\n",
               name, rate, 1e6 / rate, 1e6 / bare_rate, rate / 1000);
  }
  fmt::print("  euler over bare        {:10.3f}  (least {:.3f}, most {:.3f})\n", median(ratio),
             *std::min_element(ratio.begin(), ratio.end()), *std::max_element(ratio.begin(), ratio.end()));
}
