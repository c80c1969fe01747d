#pragma once
// Between Eigen's types and Bullet's, in double precision.

#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <LinearMath/btTransform.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "doppel/base/math/pose.h"

namespace doppel {

static_assert(sizeof(btScalar) == sizeof(double), "Bullet is used in double precision");

inline btVector3 to_bullet(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

inline Eigen::Vector3d from_bullet(const btVector3& v) {
  return {v.x(), v.y(), v.z()};
}

inline btQuaternion rotation_to_bullet(const Eigen::Matrix3d& R) {
  const Eigen::Quaterniond q = Eigen::Quaterniond(R).normalized();
  return {q.x(), q.y(), q.z(), q.w()};
}

inline btTransform to_bullet(const Pose& X) {
  return btTransform(rotation_to_bullet(X.linear()), to_bullet(X.translation()));
}

inline Pose from_bullet(const btTransform& X) {
  Pose out = Pose::Identity();
  const btMatrix3x3& R = X.getBasis();
  for (int i = 0; i < 3; ++i) out.linear().row(i) << R[i].x(), R[i].y(), R[i].z();
  out.translation() = from_bullet(X.getOrigin());
  return out;
}

}  // namespace doppel
