#pragma once
// The --ros-args of a command line, by ROS 2's rules (rcl's arguments): remapping rules, parameters and
// parameter files, the log level, the enclave.

#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/export.h"
#include "doppel/ros/bus/name_rules.h"
#include "doppel/ros/bus/parameters.h"

namespace doppel {

// -p NODE:NAME:=VALUE
struct GivenParameter {
  std::string node;  // empty: every node with this parameter
  std::string name;
  ParameterValue value;
  std::string text;  // as it was written
};

// --params-file FILE
struct GivenParameterFile {
  std::string path;
};

struct DOPPEL_API RosArguments {
  NameRules names = {};
  std::vector<std::variant<GivenParameter, GivenParameterFile>> parameters;  // in order: the last one is used
  std::optional<Severity> log_level;                                         // lower levels are not reported
  std::optional<std::string> enclave;                                        // "/left", for the network
  [[nodiscard]] bool empty() const { return names.empty() && parameters.empty() && !log_level && !enclave; }
};

// Removes everything from each "--ros-args" to the following "--" (or the end) from `words`, and reads it.
// Throws InputError with all errors.
DOPPEL_API RosArguments take_ros_arguments(std::vector<std::string>& words, NameRules names = NameRules());

class Bus;

// A warning for each remapping rule and each parameter that matches nothing on the bus, with
// the nearest name.
DOPPEL_API void report_unused(const RosArguments& arguments, Bus& bus, Diagnostics& diagnostics);

}  // namespace doppel
