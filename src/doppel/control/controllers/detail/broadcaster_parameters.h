#pragma once
// Parameters that several broadcasters share.

#include <array>
#include <string>

#include "doppel/control/manager/controller.h"

namespace doppel {

// A text that must be written. Throws InputError "control.empty_parameter". example: "imu".
std::string declare_required_text(ControllerContext& context, const std::string& name,
                                  const std::string& description, const std::string& example);
// Nine numbers, row-major about x, y, z, all 0 by default. Throws InputError if there are not nine.
std::array<double, 9> declare_covariance(ControllerContext& context, const std::string& name);

}  // namespace doppel
