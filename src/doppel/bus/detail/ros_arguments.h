#pragma once
// What reading a process's arguments and those of one of its nodes share.

#include <string>
#include <vector>

#include "doppel/bus/ros_arguments.h"

namespace doppel::bus_detail {

// As take_ros_arguments(), and appends to `rules` what stood behind each -r, as it was written.
RosArguments take_ros_arguments(std::vector<std::string>& words, NameRules names,
                                std::vector<std::string>& rules);

}  // namespace doppel::bus_detail
