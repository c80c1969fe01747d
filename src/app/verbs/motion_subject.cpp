#include "app/verbs/motion_subject.h"

namespace doppel::app {

MotionSubject motion_subject(Machine& machine) {
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
