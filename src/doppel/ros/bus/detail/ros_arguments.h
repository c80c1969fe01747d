#pragma once
// Common to the arguments of a process and those of one of its nodes.

#include <string>
#include <vector>

#include "doppel/ros/bus/ros_arguments.h"

namespace doppel::bus_detail {

// Does the same as take_ros_arguments(), and appends the text after each -r to `rules`.
RosArguments take_ros_arguments(std::vector<std::string>& words, NameRules names,
                                std::vector<std::string>& rules);

}  // namespace doppel::bus_detail
