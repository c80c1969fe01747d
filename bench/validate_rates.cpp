#include "validate_rates.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <memory>

#include "doppel/robot/reach/arm_reach.h"
#include "doppel/robot/semantics/self_collision.h"
#include "doppel/validation/checks/subject.h"

namespace doppel::bench {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int kTargets = 10'000;                            // of T1
constexpr double kPositionHit = 1e-4, kRotationHit = 1e-3;  // m, rad
constexpr double kMeasured = 1.0;                           // s, of a rate

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

// Poses of free configurations, as T1 makes them, and the solutions that are found.
void print_reach(const Subject& subject) {
  for (const ArmGroup& arm : subject.arms) {
    Diagnostics notes;
    ArmReach reach(subject.model, arm.chain,
                   reach_scene(subject.description(), subject.model, &arm.chain, {}, notes));
    Data data(*subject.model);
    std::uint64_t seed = 1;
    int found = 0, count = 0;
    double seconds = 0, longest = 0;
    for (int i = 0; i < 20 * kTargets && count < kTargets; ++i) {
      Eigen::VectorXd q = subject.model->neutral();
      arm.chain.apply(*subject.model,
                      arm.chain.variables_of(*subject.model, random_configuration(*subject.model, seed)), q);
      if (!reach.is_free(q)) continue;
      forward_kinematics(*subject.model, data, q);
      ReachQuery query;
      query.X_WT = data.X_WL[static_cast<std::size_t>(arm.chain.tip_link)];
      query.position_tolerance = kPositionHit;
      query.rotation_tolerance = kRotationHit;
      const auto begin = Clock::now();
      found += reach.answer(query).solved ? 1 : 0;
      const double one = seconds_since(begin);
      seconds += one;
      longest = std::max(longest, one);
      ++count;
    }
    const int joints = arm.chain.size();
    const double share = 100.0 * found / std::max(1, count), goal = joints >= 6 ? 99.9 : 99.5;
    fmt::print(
        "  T1 {:<24} {} joints  {:>6} targets  {:.3f} % reached (goal {} %: {})  mean {:.3f} ms "
        "(goal 1 ms), longest {:.1f} ms\n",
        arm.name, joints, count, share, goal, share >= goal ? "met" : "MISSED",
        1e3 * seconds / std::max(1, count), 1e3 * longest);
  }
}

// The sweep of T3 does the same for a configuration: all pairs, and the depth of those that touch.
void print_sweep(const Subject& subject, CollisionDetail detail, double goal) {
  SceneOptions options;
  options.detail = detail;
  std::vector<SceneInstance> instances{described_robot(subject.description(), *subject.model)};
  instances.front().model = subject.model;
  Diagnostics notes;
  const auto allowed = reach_scene(subject.description(), subject.model, nullptr, {}, notes);
  options.allowed = allowed->allowed_pairs();
  const auto scene = std::make_shared<const CollisionScene>(std::move(instances), std::move(options));
  if (scene->tested_pairs().empty()) {
    fmt::print("  T3 has no pair of links with shapes: are meshes missing?\n");
    return;
  }
  CollisionContext context(scene);
  std::uint64_t seed = 1;
  std::size_t count = 0, touching = 0;
  double seconds = 0;
  while (seconds < kMeasured) {
    const Eigen::VectorXd q = random_configuration(*subject.model, seed);
    const auto begin = Clock::now();
    context.set_configuration(0, q);
    touching += context.contacts().empty() ? 0 : 1;
    seconds += seconds_since(begin);
    ++count;
  }
  const double rate = static_cast<double>(count) / seconds;
  fmt::print("  T3 {:<9} {:>4} pairs  {:>8.0f} configurations/s (goal {:.0f}: {})  {:.0f} % touch\n",
             detail == CollisionDetail::hulls ? "hulls" : "triangles", scene->tested_pairs().size(), rate,
             goal, rate >= goal ? "met" : "MISSED",
             100.0 * static_cast<double>(touching) / static_cast<double>(count));
}

}  // namespace

void print_rates(const std::vector<std::string>& targets) {
  for (const std::string& target : targets) {
    fmt::print("{}\n", target);
    Scenario scenario;
    scenario.bundled_robots = DOPPEL_ROBOTS;
    scenario.robots = {{.target = target}};
    const Subject subject = read_subject(scenario, {});
    if (!subject.refusal.empty()) {
      fmt::print("  {}\n", subject.refusal.front().message);
      continue;
    }
    print_reach(subject);
    print_sweep(subject, CollisionDetail::hulls, 20'000);
    print_sweep(subject, CollisionDetail::triangles, 2000);
    std::fflush(stdout);
  }
}

}  // namespace doppel::bench
