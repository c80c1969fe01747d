// The twin as a library: starts a robot, lets it hold its pose for a second of simulated time, prints the
// joint positions.
#include <fmt/format.h>

#include "doppel/base/core/installation.h"
#include "doppel/twin/assembly/twin.h"

int main() {
  doppel::Log log;
  doppel::Diagnostics diagnostics;
  doppel::Scenario scenario;
  scenario.robots = {{.target = "omarm_one"}};
  scenario.bundled_robots = doppel::data_folder() / "robots";
  doppel::Twin twin(scenario, log, diagnostics);

  while (twin.now() < doppel::time_from_seconds(1.0)) {
    twin.between_steps();
    twin.step();
  }
  for (const doppel::JointSnapshot& joint : twin.robot().joints()) {
    fmt::print("{:12} {:8.4f} rad, {:7.3f} N m\n", joint.name, joint.q, joint.tau);
  }
  return 0;
}
