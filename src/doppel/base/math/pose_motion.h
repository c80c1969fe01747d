#pragma once
// A frame that moves with constant velocities: where it is shortly before or after an instant.

#include "doppel/base/math/pose.h"
#include "doppel/export.h"

namespace doppel {

struct DOPPEL_API PoseMotion {
  Pose X_WF = Pose::Identity();                         // at the instant
  Eigen::Vector3d linear_W = Eigen::Vector3d::Zero();   // m/s, of the frame's origin
  Eigen::Vector3d angular_W = Eigen::Vector3d::Zero();  // rad/s

  // True if it moves by more than 1e-6 m or rad in this time, s: less is not seen.
  [[nodiscard]] bool moves_in(double seconds) const {
    return (linear_W.norm() + angular_W.norm()) * seconds > 1e-6;
  }

  // `seconds` after the instant; negative: before it.
  [[nodiscard]] Pose at(double seconds) const {
    Pose out = X_WF;
    out.translation() += seconds * linear_W;
    const double angle = seconds * angular_W.norm();
    if (angle != 0) out.linear() = Eigen::AngleAxisd(angle, angular_W.normalized()) * X_WF.linear();
    return out;
  }
};

}  // namespace doppel
