#pragma once
// The one place where quaternions change order: MuJoCo's are w x y z, doppel's are x y z w.

#include <Eigen/Geometry>

namespace doppel {

inline Eigen::Quaterniond quaternion_from_mujoco(const double* wxyz) {
  return {wxyz[0], wxyz[1], wxyz[2], wxyz[3]};
}

inline void quaternion_to_mujoco(const Eigen::Quaterniond& quaternion, double* wxyz) {
  wxyz[0] = quaternion.w();
  wxyz[1] = quaternion.x();
  wxyz[2] = quaternion.y();
  wxyz[3] = quaternion.z();
}

}  // namespace doppel
