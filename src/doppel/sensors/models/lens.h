#pragma once
// Cameras as ROS describes them (sensor_msgs/CameraInfo): a point of the optical frame to a pixel, and back. Integer
// coordinates are the centres of pixels.

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "doppel/export.h"
#include "doppel/sensors/models/sensor_description.h"
#include "doppel/sensors/render/ray_caster.h"

namespace doppel {

enum class Distortion { plumb_bob, equidistant };

struct DOPPEL_API CameraIntrinsics {
  int width = 0, height = 0;                        // pixels
  double fx = 0, fy = 0, cx = 0, cy = 0, skew = 0;  // pixels
  Distortion model = Distortion::plumb_bob;
  std::array<double, 5> d{};           // plumb_bob: k1 k2 p1 p2 k3; equidistant: k1 k2 k3 k4
  double cutoff = 3.1415926535897932;  // rad from the axis, beyond which nothing is seen

  // Of an ideal pinhole: what a picture shows is along straight lines.
  [[nodiscard]] bool plain() const { return model == Distortion::plumb_bob && d == std::array<double, 5>{}; }
};

// fx = fy = width / (2 tan(hfov / 2)), cx = (width - 1) / 2; <intrinsics> as written. Fisheye lenses of all kinds are
// approximated by equidistant's polynomial, which camera_info can express; the picture is made by the polynomial, too, so
// that both agree. `deviation`, if given: the largest distance of the polynomial from the lens, pixels.
DOPPEL_API CameraIntrinsics intrinsics_of(const CameraDescription& camera, double* deviation = nullptr);

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
