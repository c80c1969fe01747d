#pragma once
// Poses and rotations by URDF's convention. X_AB maps coordinates in B to coordinates in A ("B in A").

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace doppel {

using Pose = Eigen::Isometry3d;

// R = Rz(yaw) * Ry(pitch) * Rx(roll), radians: fixed axes x, y, z (URDF, REP 103).
Eigen::Matrix3d rotation_from_rpy(const Eigen::Vector3d& rpy);

// The inverse, with pitch in [-pi/2, pi/2]; at |pitch| = pi/2 roll is 0.
Eigen::Vector3d rpy_from_rotation(const Eigen::Matrix3d& R);

Pose make_pose(const Eigen::Vector3d& xyz, const Eigen::Vector3d& rpy);

}  // namespace doppel
