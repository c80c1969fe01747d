#pragma once
// The reader's result, from JSON.

#include <nlohmann/json_fwd.hpp>

#include "doppel/scenario/launch/launch_description.h"

namespace doppel {

LaunchDescription launch_from_json(const nlohmann::json& result);
SourceLocation launch_place(const nlohmann::json& record);

}  // namespace doppel
