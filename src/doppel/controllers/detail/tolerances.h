#pragma once
// How far joints may be from a trajectory: on the way, at its end, and for how long. 0: not checked. Units as
// the joints': rad or m, per second, per second squared; times in s.

#include <string>
#include <vector>

#include "doppel/messages/control_msgs.h"

namespace doppel::jtc {

struct StateTolerance {
  double position = 0, velocity = 0, acceleration = 0;
};

struct Tolerances {
  std::vector<StateTolerance> path, goal;  // [joints]
  double goal_time = 0;                    // after the last point; 0: without end
};

// One joint's error against what it may be.
struct Violation {
  enum class Quantity { position, velocity, acceleration } quantity = Quantity::position;
  std::size_t joint = 0;
  double error = 0, tolerance = 0;
  [[nodiscard]] bool any() const { return tolerance > 0; }
  // The worst of several is the one whose error is the largest multiple of its tolerance.
  [[nodiscard]] double excess() const { return any() ? error / tolerance : 0; }
};
const char* to_string(Violation::Quantity quantity);

// Notes in `worst` what this joint violates if that is worse. In the loop; NaN violates nothing.
void check(const StateTolerance& tolerance, std::size_t joint, double position_error, double velocity_error,
           double acceleration_error, Violation& worst);

// The defaults with what the goal says: > 0 replaces, 0 keeps, -1 erases. Any other value or an unknown joint
// makes all of the goal's tolerances void; `complaint` then says why, else it is empty. Joints in `ignored`
// are skipped.
Tolerances tolerances_of(const control_msgs::action::FollowJointTrajectory::Goal& goal,
                         const Tolerances& defaults, const std::vector<std::string>& joints,
                         const std::vector<std::string>& ignored, std::string& problem);

}  // namespace doppel::jtc
