#pragma once
// The reader's result, from JSON.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "doppel/scenario/launch/launch_description.h"

namespace doppel {

// A line of the reader, which the launch file's own code can write: a value takes forty times its bytes, and
// a function of JSON calls itself for each level. A discarded value: it is no JSON. Throws InputError: too
// many values or levels.
nlohmann::json bounded_json(const std::string& line);
LaunchDescription launch_from_json(const nlohmann::json& result);
SourceLocation launch_place(const nlohmann::json& record);

}  // namespace doppel
