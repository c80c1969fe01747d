#pragma once
// The arguments of one node of a process, from a launch file or
// ros2_control's spawner (--controller-ros-args).

#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "doppel/export.h"
#include "doppel/ros/bus/name_rules.h"
#include "doppel/ros/bus/ros_arguments.h"

namespace doppel {

struct NodeArguments {
  std::vector<std::string> rules;                                            // each with its node
  std::vector<std::variant<GivenParameter, GivenParameterFile>> parameters;  // in order: the last one is used
};

// full_name: of the node before remapping, "/left/arm"; names: the rules of the process, which have priority.
// A leading --ros-args is optional. Throws InputError, also for arguments that a single node cannot have
// here: a log level, an enclave, or a rule for another node.
DOPPEL_API NodeArguments read_node_arguments(std::vector<std::string> words, std::string_view full_name,
                                             NameRules names);

}  // namespace doppel
