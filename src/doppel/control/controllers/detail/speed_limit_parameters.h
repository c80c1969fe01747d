#pragma once
// The parameters of one component's SpeedLimits, "linear.x.max_velocity" and so on, as in ros2_controllers'
// bases of ROS 2 Jazzy, with those that are deprecated there.

#include <string>

#include "doppel/control/controllers/detail/speed_limiter.h"
#include "doppel/control/manager/controller.h"

namespace doppel {

// `component`: "linear.x". Reports deprecated parameters that the YAML sets. Throws InputError for a value with
// the wrong sign.
enum class DeprecatedLimits { declared, absent };
void declare_speed_limits(ControllerContext& context, const std::string& component,
                          DeprecatedLimits deprecated = DeprecatedLimits::declared);
// The present values; without those that a deprecated has_..._limits: false turns off.
SpeedLimits speed_limits(const Parameters& parameters, const std::string& component);

}  // namespace doppel
