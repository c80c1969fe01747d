#pragma once
// The arguments of one node among the many of a process, as a launch file or ros2_control's spawner
// (--controller-ros-args) gives them.

#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "doppel/bus/name_rules.h"
#include "doppel/bus/ros_arguments.h"
#include "doppel/export.h"

namespace doppel {

struct NodeArguments {
  std::vector<std::string> rules;                                            // each says whose it is
  std::vector<std::variant<GivenParameter, GivenParameterFile>> parameters;  // in order: a later one wins
};

// full_name: of the node before it is renamed, "/left/arm"; names: the rules of the process, which come
// first. A --ros-args in front may be missing. Throws InputError, also for what one node cannot have for
// itself here: a log level, an enclave, or a rule that names another node.
DOPPEL_API NodeArguments read_node_arguments(std::vector<std::string> words, std::string_view full_name,
                                             NameRules names);

}  // namespace doppel
