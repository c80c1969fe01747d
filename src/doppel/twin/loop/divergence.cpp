#include "doppel/twin/loop/divergence.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/physics/contract/step_loop.h"
#include "doppel/twin/loop/load_range.h"

namespace doppel {
namespace {

constexpr int kRehearsedSteps = 10;  // of a copy of the world with what is spawned

struct Motion {
  double excess = 0;  // speed over the largest that a client may set
  std::string text;
};

void take_faster(Motion& fastest, double speed, double limit, const std::string& text) {
  const double excess = std::isfinite(speed) ? speed / limit : HUGE_VAL;
  if (excess <= fastest.excess) return;
  fastest = {excess, text};
}

double norm_of(std::span<const double> v, int first) {
  return Eigen::Map<const Eigen::Vector3d>(v.data() + first).norm();
}

void look_at(const Instance& instance, Motion& fastest) {
  const Model& model = instance.model();
  const std::string of = instance.made_of().is_object() ? "" : fmt::format(" of '{}'", instance.name());
  for (const ModelJoint& joint : model.joints) {
    if (joint.scalar()) {
      const double speed = std::abs(instance.v()[static_cast<std::size_t>(joint.v)]);
      const char* const unit = joint.type == JointType::prismatic ? "m/s" : "rad/s";
      take_faster(fastest, speed, max_speed(joint),
                  fmt::format("joint '{}'{} at {:.3g} {}", joint.name, of, speed, unit));
    } else if (joint.type == JointType::floating) {
      const double linear = norm_of(instance.v(), joint.v), angular = norm_of(instance.v(), joint.v + 3);
      take_faster(fastest, std::max(linear, angular), kMaxEntitySpeed,
                  fmt::format("'{}' at {:.3g} m/s and {:.3g} rad/s", instance.name(), linear, angular));
    }
  }
}

}  // namespace

std::string fastest_motion(const Engine& engine) {
  Motion fastest;
  for (std::size_t i = 0; i < engine.world().instances().size(); ++i)
    look_at(engine.instance(static_cast<int>(i)), fastest);
  return fastest.text.empty() ? "" : "the fastest is " + fastest.text;
}

std::string divergence_within(const Engine& engine, Duration duration) {
  const auto copy = engine.clone();
  const std::uint64_t steps = steps_in(duration, engine.world().settings().step);
  if (run_steps(*copy, {.steps = steps}) != RunEnd::diverged) return "";
  const std::string motion = fastest_motion(*copy);
  return fmt::format("the physics diverges {:.3g} s later{}", to_seconds(copy->time() - engine.time()),
                     motion.empty() ? "" : ": " + motion);
}

std::string spawned_divergence(const Engine& engine) {
  // A world that has diverged already is not the fault of what is spawned.
  return engine.diverged() ? "" : divergence_within(engine, kRehearsedSteps * engine.world().settings().step);
}

}  // namespace doppel
