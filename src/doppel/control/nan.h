#pragma once

#include <limits>

namespace doppel {

// A command that nobody has given, a state that nobody measures.
inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

}  // namespace doppel
