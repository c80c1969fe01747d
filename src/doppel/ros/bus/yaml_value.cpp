#include "doppel/ros/bus/detail/yaml_value.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <optional>

namespace doppel {
namespace {

std::optional<bool> as_bool(std::string_view text) {
  static constexpr std::array kTrue{"Y", "y", "yes", "Yes", "YES", "true", "True", "TRUE", "on", "On", "ON"};
  static constexpr std::array kFalse{"N",     "n",     "no",  "No",  "NO", "false",
                                     "False", "FALSE", "off", "Off", "OFF"};
  if (std::find(kTrue.begin(), kTrue.end(), text) != kTrue.end()) return true;
  if (std::find(kFalse.begin(), kFalse.end(), text) != kFalse.end()) return false;
  return std::nullopt;
}

std::optional<std::int64_t> as_int(const std::string& text) {
  if (text.empty() || std::isspace(static_cast<unsigned char>(text.front())) != 0) return std::nullopt;
  errno = 0;
  char* end = nullptr;
  const long long value = std::strtoll(text.c_str(), &end, 0);  // base 0, as rcl: 0x10 and 010 too
  if (errno != 0 || end == text.c_str() || *end != '\0') return std::nullopt;
  return value;
}

std::optional<double> as_double(std::string_view text) {
  const bool negative = text.starts_with('-');
  if (negative || text.starts_with('+')) text.remove_prefix(1);
  if (text.starts_with('-') || text.starts_with('+')) return std::nullopt;
  if (text == ".inf" || text == ".Inf" || text == ".INF" || text == ".nan" || text == ".NaN" ||
      text == ".NAN") {
    text.remove_prefix(1);
  }
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || end != text.data() + text.size() || error == std::errc::invalid_argument)
    return std::nullopt;
  if (error == std::errc::result_out_of_range) return std::nullopt;
  return negative ? -value : value;
}

ParameterValue scalar_value(const YAML::Node& node) {
  const std::string& text = node.Scalar();
  const bool quoted = node.Tag() == "!" || node.Tag() == "tag:yaml.org,2002:str";
  if (quoted) return text;
  if (const auto value = as_bool(text)) return *value;
  if (const auto value = as_int(text)) return *value;
  if (const auto value = as_double(text)) return *value;
  return text;
}

// All elements have the type T already, or are ints where T is double.
template <class T>
std::vector<T> collect(const std::vector<ParameterValue>& elements) {
  std::vector<T> out;
  for (const ParameterValue& element : elements) {
    if constexpr (std::is_same_v<T, double>) {
      if (const auto* whole = std::get_if<std::int64_t>(&element)) {
        out.push_back(static_cast<double>(*whole));
        continue;
      }
    }
    out.push_back(std::get<T>(element));
  }
  return out;
}

}  // namespace

SourceLocation yaml_place(const FileName& file, const YAML::Mark& mark) {
  SourceLocation place;
  place.file = file;
  if (!mark.is_null()) {
    place.line = mark.line + 1;
    place.column = mark.column + 1;
  }
  return place;
}

std::string kind_of(const ParameterValue& value) {
  const std::string_view name = parameter_type_name(value);
  return fmt::format("{} {}", name.starts_with("integer") ? "an" : "a", name);
}

YamlValue read_scalar(const YAML::Node& node) {
  return {scalar_value(node), {}};
}

YamlValue read_list(const YAML::Node& list, const std::string& name, const FileName& file,
                    Diagnostics& errors) {
  YamlValue out;
  std::vector<ParameterValue> elements;
  for (const YAML::Node& element : list) {
    const SourceLocation place = yaml_place(file, element.Mark());
    if (!element.IsScalar()) {
      errors.error("yaml.nested_list", place,
                   fmt::format("an element of the list '{}' is {}; ROS 2 parameters are lists of scalars",
                               name, element.IsNull() ? "empty" : "a list or a map"));
      return {};
    }
    elements.push_back(scalar_value(element));
    out.elements.push_back(place);
  }
  if (elements.empty()) {
    out.value = std::vector<std::string>{};  // declare_parameter accepts an empty list for any list type
    return out;
  }
  const auto is_int = [](const ParameterValue& v) { return std::holds_alternative<std::int64_t>(v); };
  const auto is_double = [](const ParameterValue& v) { return std::holds_alternative<double>(v); };
  const bool numbers =
      std::all_of(elements.begin(), elements.end(), [&](const auto& v) { return is_int(v) || is_double(v); });
  if (numbers) {
    const bool whole = std::all_of(elements.begin(), elements.end(), is_int);
    out.value =
        whole ? ParameterValue(collect<std::int64_t>(elements)) : ParameterValue(collect<double>(elements));
    return out;
  }
  for (std::size_t i = 1; i < elements.size(); ++i) {
    if (elements[i].index() == elements[0].index()) continue;
    errors.error("yaml.mixed_list", out.elements[i],
                 fmt::format("'{}' in the list '{}' is {}, but its first element is {}",
                             to_string(elements[i]), name, kind_of(elements[i]), kind_of(elements[0])),
                 "write all elements with the same type; quote names that look like numbers or booleans");
    return {};
  }
  out.value = std::holds_alternative<bool>(elements[0]) ? ParameterValue(collect<bool>(elements))
                                                        : ParameterValue(collect<std::string>(elements));
  return out;
}

}  // namespace doppel
