#pragma once
// A node's parameter as the protocol names it: "/node.parameter".

#include <string>
#include <string_view>

#include "doppel/export.h"

namespace doppel::foxglove {

DOPPEL_API std::string parameter_name(std::string_view node, std::string_view name);
// Into its two halves; false: it is no such name.
DOPPEL_API bool split_parameter_name(std::string_view full, std::string& node, std::string& name);

}  // namespace doppel::foxglove
