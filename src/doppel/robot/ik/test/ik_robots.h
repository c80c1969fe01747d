#pragma once
// Arms for tests of inverse kinematics, by the numbers that their makers publish, and random poses of them.

#include <Eigen/Geometry>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "doppel/robot/ik/ik_solver.h"
#include "doppel/robot/kinematics/test/robots.h"

namespace doppel::test {

struct HingeOf {
  Eigen::Vector3d xyz, rpy, axis;
  double lower = -3, upper = 3;
};

// A chain of hinges from "base" to "tool", which stands at `tool` in the last link.
inline RobotDescription arm_of(const std::string& name, const std::vector<HingeOf>& hinges,
                               const Eigen::Vector3d& tool) {
  RobotDescription robot;
  robot.name = name;
  robot.links.push_back(make_frame("base"));
  for (std::size_t i = 0; i < hinges.size(); ++i) {
    const std::string link = "link" + std::to_string(i + 1);
    Joint joint = make_joint("joint" + std::to_string(i + 1), JointType::revolute, robot.links.back().name,
                             link, hinges[i].xyz, hinges[i].axis);
    joint.origin.rpy = hinges[i].rpy;
    limit(joint, hinges[i].lower, hinges[i].upper, 10, 1);
    robot.joints.push_back(joint);
    robot.links.push_back(make_link(link, 1, {0, 0, 0}, {1e-3, 1e-3, 1e-3}));
  }
  robot.joints.push_back(
      make_joint("tool_joint", JointType::fixed, robot.links.back().name, "tool", tool, {1, 0, 0}));
  robot.links.push_back(make_frame("tool"));
  return robot;
}

constexpr double kHalfTurn = M_PI, kQuarterTurn = M_PI / 2;

// Universal Robots' DH parameters of the UR5e: axes 2, 3, 4 are parallel. Limits of two turns.
inline RobotDescription ur5e() {
  const double turn = 2 * M_PI;
  return arm_of("ur5e",
                {{{0, 0, 0.1625}, {0, 0, 0}, {0, 0, 1}, -turn, turn},
                 {{0, 0, 0}, {kQuarterTurn, 0, 0}, {0, 0, 1}, -turn, turn},
                 {{-0.425, 0, 0}, {0, 0, 0}, {0, 0, 1}, -M_PI, M_PI},
                 {{-0.3922, 0, 0.1333}, {0, 0, 0}, {0, 0, 1}, -turn, turn},
                 {{0, -0.0997, 0}, {kQuarterTurn, 0, 0}, {0, 0, 1}, -turn, turn},
                 {{0, 0.0996, 0}, {kQuarterTurn, kHalfTurn, kHalfTurn}, {0, 0, 1}, -turn, turn}},
                {0, 0, 0});
}

// An arm with a spherical wrist: shoulder and elbow offset, as industrial arms have.
inline RobotDescription industrial() {
  return arm_of("industrial",
                {{{0, 0, 0.4}, {0, 0, 0}, {0, 0, 1}, -2.9, 2.9},
                 {{0.15, 0, 0}, {0, 0, 0}, {0, 1, 0}, -1.8, 2.6},
                 {{0, 0, 0.6}, {0, 0, 0}, {0, 1, 0}, -2.5, 2.5},
                 {{0.3, 0, 0.13}, {0, 0, 0}, {1, 0, 0}, -3.3, 3.3},
                 {{0.34, 0, 0}, {0, 0, 0}, {0, 1, 0}, -2.1, 2.1},
                 {{0.1, 0, 0}, {0, 0, 0}, {1, 0, 0}, -6.2, 6.2}},
                {0.05, 0.02, 0});
}

// Seven joints with a spherical shoulder and wrist.
inline RobotDescription seven_joints() {
  return arm_of("seven",
                {{{0, 0, 0.34}, {0, 0, 0}, {0, 0, 1}, -2.9, 2.9},
                 {{0, 0, 0}, {0, 0, 0}, {0, 1, 0}, -2, 2},
                 {{0, 0, 0}, {0, 0, 0}, {0, 0, 1}, -2.9, 2.9},
                 {{0, 0, 0.4}, {0, 0, 0}, {0, -1, 0}, -2, 2},
                 {{0, 0, 0.4}, {0, 0, 0}, {0, 0, 1}, -2.9, 2.9},
                 {{0, 0, 0}, {0, 0, 0}, {0, 1, 0}, -2, 2},
                 {{0, 0, 0.126}, {0, 0, 0}, {0, 0, 1}, -3, 3}},
                {0, 0, 0.05});
}

// Yaw, three pitches and a roll, as hobby arms have.
inline RobotDescription five_joints() {
  return arm_of("five",
                {{{0, 0, 0.08}, {0, 0, 0}, {0, 0, 1}, -2.6, 2.6},
                 {{0.02, 0, 0.04}, {0, 0, 0}, {0, 1, 0}, -1.7, 1.7},
                 {{0, 0, 0.14}, {0, 0, 0}, {0, 1, 0}, -2, 2},
                 {{0, 0, 0.14}, {0, 0, 0}, {0, 1, 0}, -1.9, 1.9},
                 {{0, 0, 0.06}, {0, 0, 0}, {0, 0, 1}, -3, 3}},
                {0, 0, 0.08});
}

inline RobotDescription four_joints() {
  RobotDescription robot = arm_of("four",
                                  {{{0, 0, 0.08}, {0, 0, 0}, {0, 0, 1}, -2.6, 2.6},
                                   {{0, 0, 0.04}, {0, 0, 0}, {0, 1, 0}, -1.7, 1.7},
                                   {{0, 0, 0.14}, {0, 0, 0}, {0, 1, 0}, -1.9, 1.9},
                                   {{0, 0, 0.14}, {0, 0, 0}, {0, 1, 0}, -1.9, 1.9}},
                                  {0, 0, 0.1});
  return robot;
}

// Axes nowhere parallel or meeting: only a search finds its solutions.
inline RobotDescription crooked() {
  return arm_of("crooked",
                {{{0, 0, 0.2}, {0, 0, 0}, {0.1, 0, 1}, -2.9, 2.9},
                 {{0.05, 0.06, 0.1}, {0.2, 0, 0.3}, {0, 1, 0.2}, -2, 2},
                 {{0.02, 0.08, 0.3}, {0, 0.4, 0}, {0.1, 1, 0.3}, -2.5, 2.5},
                 {{0.1, 0.08, 0.2}, {0.1, 0.2, 0}, {1, 0, 0.3}, -2.9, 2.9},
                 {{0.1, 0.07, 0.02}, {0.3, 0, 0.1}, {0, 1, 0.1}, -2.2, 2.2},
                 {{0.08, 0.09, 0}, {0, 0.3, 0}, {1, 0.2, 0}, -3, 3}},
                {0.05, 0, 0});
}

// The same arm as an export from CAD leaves it: every frame off by up to `length` (m) and `angle` (rad).
inline RobotDescription nearly(RobotDescription robot, double length, double angle, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (Joint& joint : robot.joints) {
    if (joint.type == JointType::fixed) continue;
    joint.origin.xyz += length * Eigen::Vector3d(unit(random), unit(random), unit(random));
    joint.axis =
        (joint.axis + angle * Eigen::Vector3d(unit(random), unit(random), unit(random))).normalized();
  }
  return robot;
}

inline IkSolver solver_of(const RobotDescription& robot) {
  Diagnostics diagnostics;
  const auto model = std::make_shared<const Model>(compile_model(robot, BaseKind::fixed, diagnostics));
  return {model, make_chain(*model, 0, model->find_link("tool"))};
}

inline Eigen::VectorXd random_variables(const Chain& chain, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  Eigen::VectorXd u(chain.size());
  for (int i = 0; i < chain.size(); ++i) {
    const double low = std::isfinite(chain.lower[i]) ? chain.lower[i] : -M_PI;
    const double high = std::isfinite(chain.upper[i]) ? chain.upper[i] : M_PI;
    u[i] = low + (high - low) * unit(random);
  }
  return u;
}

}  // namespace doppel::test
