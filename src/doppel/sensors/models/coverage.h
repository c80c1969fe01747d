#pragma once
// Lines of sight and the coverage of points by a camera, by rays into a scene: what validation and planning
// ask of a camera's place.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "doppel/description/gazebo/camera_intrinsics.h"
#include "doppel/export.h"
#include "doppel/sensors/render/ray_caster.h"

namespace doppel {

struct SightLine {
  bool is_free = false;  // no surface is between the eye and the point
  float distance = 0;    // m to the point, or to the surface that hides it
  int item = -1;         // into RenderScene::items: what hides the point; -1: nothing
};

// A surface within this distance before a point does not hide it: the point may lie on it.
inline constexpr double kSightMargin = 1e-3;  // m

// One line for each point (m, world).
DOPPEL_API std::vector<SightLine> sight_lines(const RayCaster& caster, const Eigen::Vector3d& eye_W,
                                              std::span<const Eigen::Vector3d> points_W);

enum class CameraSight { seen, outside, too_near, too_far, hidden };

struct CameraCoverage {
  std::vector<CameraSight> sights;  // [points]
  std::vector<SightLine> lines;     // [points]
  double share = 0;                 // of the points that are seen, 0..1; 0 without points
};

// For each point, whether it is in the picture, between near and far (m, along the optical axis), and not
// hidden.
DOPPEL_API CameraCoverage camera_coverage(const RayCaster& caster, const CameraIntrinsics& camera,
                                          const Pose& X_WC, double near, double far,
                                          std::span<const Eigen::Vector3d> points_W);

}  // namespace doppel
