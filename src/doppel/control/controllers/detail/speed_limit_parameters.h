#pragma once
// The parameters of one component's SpeedLimits, "linear.x.max_velocity" and so on, as in ros2_controllers'
// bases of ROS 2 Jazzy, with those that are deprecated there.

#include "doppel/control/controllers/detail/controller_parameters.h"
#include "doppel/control/controllers/detail/speed_limiter.h"

namespace doppel {

struct SpeedLimitParameters {
  SpeedLimits limits;
  bool has_velocity = true, has_acceleration = true, has_jerk = true;  // deprecated
  double min_acceleration = kNaN;                                      // deprecated, without effect

  // `component`: "linear.x".
  ControllerParameters list(const std::string& component, bool with_deprecated);
  // The limits without those that a deprecated has_..._limits: false turns off.
  [[nodiscard]] SpeedLimits present() const;
};

// Reports the deprecated parameters that the YAML sets, once they are declared.
void report_deprecated_limits(const ControllerContext& context, const SpeedLimitParameters& parameters,
                              const std::string& component);

}  // namespace doppel
