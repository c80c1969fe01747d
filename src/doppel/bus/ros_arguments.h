#pragma once
// What stands behind --ros-args on a command line, by ROS 2's rules (rcl's arguments): renamings, parameters
// and parameter files, the log's level, the enclave.

#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "doppel/bus/name_rules.h"
#include "doppel/bus/parameters.h"
#include "doppel/core/diagnostic.h"
#include "doppel/export.h"

namespace doppel {

// -p NODE:NAME:=VALUE
struct GivenParameter {
  std::string node;  // empty: every node that has it
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
  std::vector<std::variant<GivenParameter, GivenParameterFile>> parameters;  // in order: a later one wins
  std::optional<Severity> log_level;                                         // nothing below it is reported
  std::optional<std::string> enclave;                                        // "/left", told to the network
  [[nodiscard]] bool empty() const { return names.empty() && parameters.empty() && !log_level && !enclave; }
};

// Takes everything from each "--ros-args" to the "--" behind it (or the end) out of `words`, and reads it.
// Throws InputError, with every fault at once.
DOPPEL_API RosArguments take_ros_arguments(std::vector<std::string>& words, NameRules names = NameRules());

class Bus;

// A warning for each renaming and each parameter that fits nothing on the bus, with the nearest name.
DOPPEL_API void report_unused(const RosArguments& arguments, Bus& bus, Diagnostics& diagnostics);

}  // namespace doppel
