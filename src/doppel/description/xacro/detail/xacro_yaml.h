#pragma once
// Shared by the two readers of YAML.

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

// Nothing: the text uses features of YAML that this reader does not support, or is not YAML.
std::optional<Value> parse_simple_yaml(std::string_view text);
// Any YAML, by yaml-cpp. Throws InputError.
Value parse_whole_yaml(const std::string& text, const std::filesystem::path& file, const TreePlace& where);

// The same value with the entries of every dict as attributes too.
Value dotted(const Value& value);

}  // namespace doppel::xacro
