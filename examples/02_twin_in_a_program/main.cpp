// The twin as a library: starts a robot, lets it hold its pose for a second of simulated time, prints the
// joint positions. The same in Python is in docs/python.md.
#include <fmt/format.h>

#include "doppel/twin/assembly/twin.h"

int main() {
  using namespace std::chrono_literals;
  doppel::Twin twin("omarm_one");
  twin.run_for(1s);
  fmt::print("Revolute 2 is at {:.4f} rad\n", twin.joint("Revolute 2").q());
  for (const doppel::JointSnapshot& joint : twin.robot().joints()) {
    fmt::print("{:12} {:8.4f} rad, {:7.3f} N m\n", joint.name, joint.q, joint.tau);
  }
  return 0;
}
