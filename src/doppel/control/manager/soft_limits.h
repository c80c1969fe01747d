#pragma once
// The <safety_controller> of a joint: soft limits, which commands approach ever more slowly and do not pass.

#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel {

// With x and v of the joint, as in ROS (wiki.ros.org/pr2_controller_manager/safety_limits) and ros2_control:
//   v_min = -k_position (x - lower), v_max = -k_position (x - upper), each within the velocity limit;
//   an effort is from -k_velocity (v - v_min) to -k_velocity (v - v_max), within the effort limit.
struct DOPPEL_API SoftLimits {
  std::string joint;
  double lower = -kInfinity, upper = kInfinity;  // rad or m; infinite: positions have no soft limits
  double k_position = 0;  // 1/s; 0: positions are clamped, and the velocity is not reduced before
  double k_velocity = 0;  // N m s/rad or N s/m; 0: efforts are not reduced
  [[nodiscard]] bool bounds_position() const { return lower > -kInfinity; }
};

// The soft limits that can be enforced. A warning for those that cannot: reversed, outside of the joint's
// limits, on a joint without a range, on one that mimics another or has no single degree of freedom.
DOPPEL_API std::vector<SoftLimits> soft_limits_of(const RobotDescription& robot, const Model& model,
                                                  Diagnostics& diagnostics);

}  // namespace doppel
