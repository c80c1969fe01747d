#pragma once
// The field of view of a sensor of light: the lens of a camera, the rays of a lidar, the cone of a range
// sensor. Frames: S sensor, x forward, z up.

#include <Eigen/Core>
#include <string>
#include <variant>
#include <vector>

#include "doppel/description/gazebo/camera_intrinsics.h"
#include "doppel/description/gazebo/sensor_description.h"
#include "doppel/sensors/models/scan_pattern.h"
#include "doppel/sensors/models/sensor_frames.h"

namespace doppel {

enum class PlaceSight { seen, outside, too_near, too_far, hidden };

// One lens or one set of rays; a multicamera has several.
struct SensorField {
  std::string name, kind;        // "wrist_camera", "camera"
  int link = 0;                  // of the machine's own model
  Pose X_LS = Pose::Identity();  // the sensor in that link
  double near = 0, far = 0;      // m; of a camera along its axis
  double half_angle = 0;         // rad: of the field, horizontally
  std::variant<CameraIntrinsics, ScanPattern, RangeDescription> what;
  SourceLocation where;

  // A place that nothing hides. `radius`: m, of the place, which the rays of a lidar need to meet.
  [[nodiscard]] PlaceSight sight(const Eigen::Vector3d& p_S, double radius) const;
  // Pixels, or rays, on a centimetre at that place, horizontally; 0: it has no grid.
  [[nodiscard]] double density(const Eigen::Vector3d& p_S) const;
};

// The sensors of light of a robot, with the links of `model`.
[[nodiscard]] std::vector<SensorField> sensor_fields(const RobotSensors& sensors, const Model& model);

}  // namespace doppel
