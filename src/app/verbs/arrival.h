#pragma once
// Checks whether joints have arrived at their targets; if not, names the cause that their states show.

#include <chrono>
#include <functional>
#include <string>

#include "app/verbs/robot_watch.h"

namespace doppel::app {

const char* joint_unit(const ModelJoint& joint);  // "rad" or "m"
// The way from one position to the other, rad or m; a continuous joint takes the shorter one. joint: may be
// nullptr.
double distance_to(const ModelJoint* joint, double from, double to);

class Arrival {
 public:
  // rad or m; 0: 0.02 rad, 0.002 m.
  explicit Arrival(double tolerance) : tolerance_(tolerance) {}

  // Receives a message for the watched robot; false: none has come in time.
  using Receive = std::function<bool(std::chrono::steady_clock::time_point)>;
  // Returns when all joints stay at their targets, or no longer come nearer to them.
  void wait(const RobotWatch& robot, const Positions& targets, const Receive& receive) const;
  // Why the joint is not at its target: where it is, and what its speed and effort show. "": it has arrived.
  [[nodiscard]] std::string why_not(const RobotWatch& robot, const std::string& joint, double target) const;

 private:
  [[nodiscard]] double tolerance_of(const ModelJoint* joint) const;
  // The distances to the targets beyond the tolerances, added; 0: all have arrived.
  [[nodiscard]] double remaining(const RobotWatch& robot, const Positions& targets) const;

  double tolerance_;
};

}  // namespace doppel::app
