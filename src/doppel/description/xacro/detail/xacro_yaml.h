#pragma once
// YAML as values: scalars as PyYAML reads them, and units.

#include <optional>
#include <string>
#include <string_view>

#include "doppel/description/xacro/detail/xacro.h"

namespace doppel::xacro {

// A plain scalar as YAML 1.1 reads it (PyYAML's safe_load): null, truth value, number, text.
Value yaml_scalar(std::string_view text);
// "!degrees 90" in SI; nothing: no such unit, or no number.
std::optional<Value> yaml_quantity(std::string_view tag, std::string_view text);
// The factor of "!degrees", "!millimeters", ... to SI; 0: no such unit.
double yaml_unit(std::string_view tag);

// The same value with the entries of every dict as attributes too.
Value dotted(const Value& value);

}  // namespace doppel::xacro
