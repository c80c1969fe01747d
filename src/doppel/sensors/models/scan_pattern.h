#pragma once
// The directions of a lidar's rays in its frame, x forward, z up: rings from the lowest, in each from min to max.

#include <cstddef>
#include <vector>

#include "doppel/base/math/pose_motion.h"
#include "doppel/description/gazebo/sensor_description.h"
#include "doppel/export.h"
#include "doppel/sensors/render/ray_caster.h"

namespace doppel {

struct DOPPEL_API ScanPattern {
  int rings = 1, columns = 1;
  double angle_min = 0, angle_max = 0, angle_increment = 0;  // rad, of a ring
  std::vector<double> elevations;                            // [rings] rad
  std::vector<float> x, y, z;                                // [rings * columns], of unit vectors
  void add(const Eigen::Vector3d& direction);
  [[nodiscard]] std::size_t size() const { return x.size(); }
  [[nodiscard]] Eigen::Vector3f direction(std::size_t i) const { return {x[i], y[i], z[i]}; }
  [[nodiscard]] int middle_ring() const { return rings / 2; }
};
DOPPEL_API ScanPattern scan_pattern(const LidarDescription& lidar);

// Rays of all directions from a sensor that is at X_LS in `link`: each column at its own time of the scan, which ends at
// the instant of `link` and takes scan_time s; 0: all at once.
DOPPEL_API void place_rays(const ScanPattern& pattern, const PoseMotion& link, const Pose& X_LS,
                           double scan_time, RayBatch& out);

// Rays over a cone of a range sensor, whole angle `field_of_view`, dense enough for 1 % of it between neighbours.
DOPPEL_API ScanPattern cone_pattern(const RangeDescription& range);

}  // namespace doppel
