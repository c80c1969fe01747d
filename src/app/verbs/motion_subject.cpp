#include "app/verbs/motion_subject.h"

#include <fmt/format.h>

namespace doppel::app {
namespace {

constexpr double kMaxDuration = 60.0;  // s

}  // namespace

void check_duration(double seconds) {
  if (seconds > 0 && seconds <= kMaxDuration) return;
  throw InputError(
      "cli.duration", {},
      fmt::format("--duration is {} s, but must be above 0 and at most {}", seconds, kMaxDuration),
      "two seconds are usually enough; a chaotic motion gives no more information after that");
}

MotionSubject motion_subject(CompiledScenario& machine) {
  MotionSubject out;
  const CompiledWorld& world = machine.engine->world();
  const int robot = instance_of(*machine.engine, *machine.robots.front()).index();
  out.world = world.settings();
  out.engine = world.capabilities().name;
  for (int i = 0; i < static_cast<int>(world.instances().size()); ++i) {
    const ModelInstance& instance = world.instances()[static_cast<std::size_t>(i)];
    if (i == robot) {
      out.robot = instance;
    } else {
      out.others.push_back(instance);
    }
  }
  return out;
}

}  // namespace doppel::app
