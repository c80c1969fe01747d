#pragma once
// The paths of ISO 9283 in the test plane, as courses of an arm's joints.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "doppel/validation/extras/detail/pose_cycles.h"
#include "doppel/validation/extras/detail/twin_touch.h"

namespace doppel {

struct TestPath {
  std::string name;                       // "line", "circle", "corner"
  std::vector<double> way;                // m along the path, from 0 on
  std::vector<Eigen::VectorXd> u;         // [variables] at these ways
  std::vector<Pose> X_RT;                 // the tool there, in the root link
  std::size_t begin = 0, end = 0;         // of the points that are compared
  Eigen::Vector3d corner, before, after;  // of a corner: its place and the directions of its lines
  double speed = 0;                       // m/s: the largest at which no joint exceeds its speed limit

  [[nodiscard]] double length() const { return way.back(); }
  // The variables at a way.
  [[nodiscard]] Eigen::VectorXd at(double distance) const;
};

// The line from P2 to P4 through P1; a circle around P1 with 0.8 of the edge as its diameter, half a turn
// longer than it is compared; the corner P3 between P2 and P4. Without those that the arm cannot follow in
// one branch and without touching anything, whose reasons are in `why`.
[[nodiscard]] std::vector<TestPath> test_paths(const CheckContext& context, const ExtraArm& arm,
                                               const TestPlane& plane, std::vector<std::string>& why);

// The way over time: a speed that rises and falls with the least jerk over `ramp` m each, else is constant.
struct PathProfile {
  double length = 0, ramp = 0, speed = 0;  // m, m, m/s

  [[nodiscard]] double ramp_time() const { return 2 * ramp / speed; }  // s
  [[nodiscard]] double time() const { return 2 * ramp_time() + (length - 2 * ramp) / speed; }
  [[nodiscard]] double way(double now) const;
};

}  // namespace doppel
