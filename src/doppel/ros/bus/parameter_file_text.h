#pragma once
// Parameters as a ROS 2 parameter file, as `ros2 param dump` prints it.

#include <string>
#include <utility>
#include <vector>

#include "doppel/export.h"
#include "doppel/ros/bus/parameters.h"

namespace doppel {

// The part of one node: "/arm:\n  ros__parameters:\n    gains:\n      p: 1.0\n". Names with dots are nested
// maps; parameters that are not set are skipped.
[[nodiscard]] DOPPEL_API std::string parameter_file_text(
    const std::string& node, const std::vector<std::pair<std::string, ParameterValue>>& parameters);

}  // namespace doppel
