#pragma once
// One YAML value as ROS 2's rcl_yaml_param_parser reads it: plain scalars are bool (also yes, on), int (also
// 0x10, 010), double (also .inf, .nan) or string; lists are of one type. Independent of the C locale.

#include <yaml-cpp/yaml.h>

#include <memory>
#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/ros/bus/parameters.h"

namespace doppel {

using FileName = std::shared_ptr<const std::string>;

SourceLocation yaml_place(const FileName& file, const YAML::Mark& mark);

struct YamlValue {
  ParameterValue value;  // monostate: refused, with an error in `errors`
  std::vector<SourceLocation> elements;
};

// "a bool", "an integer array": for messages.
std::string kind_of(const ParameterValue& value);

YamlValue read_scalar(const YAML::Node& node);
// `name`: of the parameter, for the messages.
YamlValue read_list(const YAML::Node& list, const std::string& name, const FileName& file,
                    Diagnostics& errors);

}  // namespace doppel
