#pragma once
// The <camera> of a sensor as ROS describes a camera (sensor_msgs/CameraInfo). Integer coordinates are the
// centres of pixels.

#include <array>

#include "doppel/description/gazebo/sensor_description.h"
#include "doppel/export.h"

namespace doppel {

enum class Distortion { plumb_bob, equidistant };

struct DOPPEL_API CameraIntrinsics {
  int width = 0, height = 0;                        // pixels
  double fx = 0, fy = 0, cx = 0, cy = 0, skew = 0;  // pixels
  Distortion model = Distortion::plumb_bob;
  std::array<double, 5> d{};           // plumb_bob: k1 k2 p1 p2 k3; equidistant: k1 k2 k3 k4
  double cutoff = 3.1415926535897932;  // rad from the axis, beyond which nothing is seen

  // True for an ideal pinhole, whose picture shows straight lines as straight.
  [[nodiscard]] bool plain() const { return model == Distortion::plumb_bob && d == std::array<double, 5>{}; }
};

// fx = fy = width / (2 tan(hfov / 2)), cx = (width - 1) / 2; <intrinsics> as written. Fisheye lenses of all
// kinds are approximated by equidistant's polynomial, which camera_info can express; the picture is made by
// the polynomial, too, so that both agree. `deviation`, if given: the largest distance of the polynomial
// from the lens, pixels.
DOPPEL_API CameraIntrinsics intrinsics_of(const CameraDescription& camera, double* deviation = nullptr);

}  // namespace doppel
