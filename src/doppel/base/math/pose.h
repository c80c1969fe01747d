#pragma once
// Poses and rotations by URDF's convention. X_AB maps coordinates in B to coordinates in A ("B in A");
// translations in m.

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "doppel/export.h"

namespace doppel {

using Pose = Eigen::Isometry3d;

// R = Rz(yaw) * Ry(pitch) * Rx(roll), radians: fixed axes x, y, z (URDF, REP 103).
DOPPEL_API Eigen::Matrix3d rotation_from_rpy(const Eigen::Vector3d& rpy);

// The inverse: roll, pitch, yaw in rad, with pitch in [-pi/2, pi/2]; at |pitch| = pi/2, where roll and yaw
// are not unique, roll is 0.
DOPPEL_API Eigen::Vector3d rpy_from_rotation(const Eigen::Matrix3d& R);

// The smallest rotation that maps z to `direction` (any length but 0); for -z it is about x.
DOPPEL_API Eigen::Matrix3d rotation_from_z(const Eigen::Vector3d& direction);

DOPPEL_API Pose make_pose(const Eigen::Vector3d& xyz, const Eigen::Vector3d& rpy);

}  // namespace doppel
