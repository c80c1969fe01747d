#pragma once

#include <limits>

namespace doppel {

// The value of a command interface before its first command, and of a state interface without a measurement.
inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

}  // namespace doppel
