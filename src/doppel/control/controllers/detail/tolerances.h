#pragma once
// The tolerances of a trajectory: on the path, at the goal, and in time. 0: not checked. Units of the joints:
// rad or m, per second, per second squared; times in s.

#include <string>
#include <vector>

#include "doppel/ros/messages/control_msgs.h"

namespace doppel::jtc {

struct StateTolerance {
  double position = 0, velocity = 0, acceleration = 0;
};

struct Tolerances {
  std::vector<StateTolerance> path, goal;  // [joints]
  double goal_time = 0;                    // s after the last point; 0: unlimited
};

// The error of one joint and its tolerance.
struct Violation {
  enum class Quantity { position, velocity, acceleration } quantity = Quantity::position;
  std::size_t joint = 0;
  double error = 0, tolerance = 0;
  [[nodiscard]] bool any() const { return tolerance > 0; }
  // The worst violation is the one with the largest ratio of error to tolerance.
  [[nodiscard]] double excess() const { return any() ? error / tolerance : 0; }
};
const char* to_string(Violation::Quantity quantity);

// Replaces `worst` by a violation of this joint if that is worse. In the loop; NaN violates no tolerance.
void check(const StateTolerance& tolerance, std::size_t joint, double position_error, double velocity_error,
           double acceleration_error, Violation& worst);

// The defaults combined with the goal's tolerances: > 0 replaces, 0 keeps, -1 erases. Any other value or an
// unknown joint invalidates all tolerances of the goal; `complaint` then has the reason, else it is empty.
// Joints in `ignored` are skipped.
Tolerances tolerances_of(const control_msgs::action::FollowJointTrajectory::Goal& goal,
                         const Tolerances& defaults, const std::vector<std::string>& joints,
                         const std::vector<std::string>& ignored, std::string& problem);

}  // namespace doppel::jtc
