#include "doppel/control/controllers/detail/tolerances.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "doppel/base/core/names.h"

namespace doppel::jtc {
namespace {

using Names = std::vector<std::string>;

// The special values of control_msgs/msg/JointTolerance. False: the value is not defined.
bool resolve(double asked, double by_default, double& tolerance) {
  if (asked > 0) {
    tolerance = asked;
  } else if (asked == 0) {
    tolerance = by_default;
  } else if (std::abs(asked + 1) < std::numeric_limits<float>::epsilon()) {
    tolerance = 0;
  } else {
    return false;
  }
  return true;
}

std::string take(const std::vector<control_msgs::msg::JointTolerance>& asked, const char* list,
                 const Names& joints, const Names& ignored, std::vector<StateTolerance>& tolerances) {
  for (const auto& one : asked) {
    const auto joint = std::find(joints.begin(), joints.end(), one.name);
    if (joint == joints.end()) {
      if (std::find(ignored.begin(), ignored.end(), one.name) != ignored.end()) continue;
      return fmt::format("{} lists joint '{}', which this controller does not have{}", list, one.name,
                         did_you_mean(one.name, joints));
    }
    StateTolerance& tolerance = tolerances[static_cast<std::size_t>(joint - joints.begin())];
    const struct {
      const char* name;
      double asked;
      double& tolerance;
    } quantities[] = {{"position", one.position, tolerance.position},
                      {"velocity", one.velocity, tolerance.velocity},
                      {"acceleration", one.acceleration, tolerance.acceleration}};
    for (const auto& quantity : quantities) {
      if (resolve(quantity.asked, quantity.tolerance, quantity.tolerance)) continue;
      return fmt::format(
          "the {} of joint '{}' in {} is {:g}; use a positive number, 0 for the default or -1 for none",
          quantity.name, one.name, list, quantity.asked);
    }
  }
  return "";
}

}  // namespace

const char* to_string(Violation::Quantity quantity) {
  switch (quantity) {
    case Violation::Quantity::velocity:
      return "velocity";
    case Violation::Quantity::acceleration:
      return "acceleration";
    default:
      return "position";
  }
}

void check(const StateTolerance& tolerance, std::size_t joint, double position_error, double velocity_error,
           double acceleration_error, Violation& worst) {
  const auto note = [&](Violation::Quantity quantity, double error, double allowed) {
    const Violation found{quantity, joint, std::abs(error), allowed};
    if (allowed > 0 && found.error > allowed && found.excess() > worst.excess()) worst = found;
  };
  note(Violation::Quantity::position, position_error, tolerance.position);
  note(Violation::Quantity::velocity, velocity_error, tolerance.velocity);
  note(Violation::Quantity::acceleration, acceleration_error, tolerance.acceleration);
}

Tolerances tolerances_of(const control_msgs::action::FollowJointTrajectory::Goal& goal,
                         const Tolerances& defaults, const Names& joints, const Names& ignored,
                         std::string& problem) {
  Tolerances tolerances = defaults;
  problem.clear();
  const double goal_time = to_seconds(from_msg(goal.goal_time_tolerance));
  if (!resolve(goal_time, defaults.goal_time, tolerances.goal_time)) {
    problem = fmt::format(
        "goal_time_tolerance is {:g} s; use a positive time, 0 for the default or -1 for none", goal_time);
  }
  if (problem.empty())
    problem = take(goal.path_tolerance, "path_tolerance", joints, ignored, tolerances.path);
  if (problem.empty())
    problem = take(goal.goal_tolerance, "goal_tolerance", joints, ignored, tolerances.goal);
  return problem.empty() ? tolerances : defaults;
}

}  // namespace doppel::jtc
