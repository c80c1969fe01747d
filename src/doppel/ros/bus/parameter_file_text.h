#pragma once
// The text of ROS 2 parameter files, and parameters as one, as `ros2 param dump` prints it.

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "doppel/export.h"
#include "doppel/ros/bus/parameters.h"

namespace doppel {

// The largest file that is read. Parsed, YAML takes a hundred times as much.
inline constexpr std::size_t kMaxParameterFileBytes = std::size_t{4} << 20;

// The part of one node: "/arm:\n  ros__parameters:\n    gains:\n      p: 1.0\n". Names with dots are nested
// maps; parameters that are not set are skipped.
[[nodiscard]] DOPPEL_API std::string parameter_file_text(
    const std::string& node, const std::vector<std::pair<std::string, ParameterValue>>& parameters);

}  // namespace doppel
