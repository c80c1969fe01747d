#pragma once
// What MuJoCo wants otherwise than doppel has it. Quaternions: MuJoCo's are w x y z, doppel's are x y z w.
// Tensors: by their principal axes.

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>

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

struct PrincipalInertia {
  Eigen::Vector3d moments = Eigen::Vector3d::Zero();   // kg m^2
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  // columns, in the tensor's axes; right-handed
};

// MuJoCo allows no rounding in the triangle inequality, which point masses and rods just meet; so the
// smaller moments are raised by a billionth of the largest where they need it.
inline PrincipalInertia principal_inertia(const Eigen::Matrix3d& I) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(I);
  PrincipalInertia out{eigen.eigenvalues(), eigen.eigenvectors()};
  const double excess = out.moments[2] - (out.moments[0] + out.moments[1]);
  if (excess > -1e-9 * out.moments[2])
    out.moments.head<2>().array() += 0.5 * std::max(excess, 0.0) + 1e-9 * out.moments[2];
  if (out.axes.determinant() < 0) out.axes.col(0) *= -1;
  return out;
}

}  // namespace doppel
