#pragma once
// The protocol's names of parameters of nodes: "/node.parameter".

#include <string>
#include <string_view>

#include "doppel/export.h"

namespace doppel::foxglove {

DOPPEL_API std::string parameter_name(std::string_view node, std::string_view name);
// Splits a name into node and parameter; false: it has another form.
DOPPEL_API bool split_parameter_name(std::string_view full, std::string& node, std::string& name);

}  // namespace doppel::foxglove
