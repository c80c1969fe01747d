#pragma once
// Cameras as ROS describes them (sensor_msgs/CameraInfo): a point of the optical frame to a pixel, and back. Integer
// coordinates are the centres of pixels.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "doppel/description/gazebo/camera_intrinsics.h"
#include "doppel/export.h"
#include "doppel/sensors/render/ray_caster.h"

namespace doppel {

// The pixel at which a point (m, optical frame) is seen. nullopt: behind a pinhole, or beyond the cutoff.
// Source: OpenCV's calib3d, and its fisheye module.
DOPPEL_API std::optional<Eigen::Vector2d> project(const CameraIntrinsics& camera, const Eigen::Vector3d& p_C);

// The largest distance from the axis, at z 1, that a plumb_bob lens maps to a pixel of its own: beyond it, project() gives
// pixels at which other things are seen. Infinite for other models.
DOPPEL_API double largest_radius(const CameraIntrinsics& camera);

// The direction that is seen at (u, v): with z 1 for a plumb_bob model, else of unit length. nullopt: none, as in the
// corners of a strongly distorted picture. Newton's method on project().
DOPPEL_API std::optional<Eigen::Vector3d> direction_at(const CameraIntrinsics& camera, double u, double v);

// A table for each of `samples` points of a pixel; the first is of the centres. Positions: the first points of
// Halton's sequence of bases 2 and 3.
DOPPEL_API std::vector<PixelRays> pixel_rays(const CameraIntrinsics& camera, int samples);

}  // namespace doppel
