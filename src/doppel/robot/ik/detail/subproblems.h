#pragma once
// The sub-problems that inverse kinematics of arms is made of: angles of rotations about known axes. Source:
// Elias and Wen, "IK-Geo: Unified robot inverse kinematics using subproblem decomposition", Mechanism and
// Machine Theory 209, 2025, after Paden 1985 and Kahan 1983.
//
// k and h are unit vectors. Where a solution just does not exist, the nearest angle is the answer; callers
// judge it on the whole arm.

#include <Eigen/Core>
#include <optional>

namespace doppel {

// Up to two angles, rad.
struct Angles {
  int count = 0;
  double value[2] = {0, 0};
};

// v turned by `angle` about k.
Eigen::Vector3d turned(const Eigen::Vector3d& v, const Eigen::Vector3d& k, double angle);
Eigen::Matrix3d rotation_about(const Eigen::Vector3d& k, double angle);

// The angle about k that brings p nearest to r. nullopt: p or r is along k, so that every angle is as good.
std::optional<double> angle_between(const Eigen::Vector3d& p, const Eigen::Vector3d& r,
                                    const Eigen::Vector3d& k);

// How far an equation of the nearest exact arm may be from the one of the true arm. Its roots are starting
// points there: two that nearly meet are held apart, so that they do not end in one.
struct RootMargin {
  double slack = 1e-9;   // by which |cos| may exceed 1
  double least_gap = 0;  // rad from the middle of two roots to each of them
};

// h . (p turned about k) = d.
Angles angles_to_plane(const Eigen::Vector3d& h, const Eigen::Vector3d& p, const Eigen::Vector3d& k, double d,
                       const RootMargin& margin);

// a cos(x) + b sin(x) = c.
Angles solve_cosine(double a, double b, double c, const RootMargin& margin);

}  // namespace doppel
