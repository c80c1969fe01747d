#include "doppel/ros/foxglove/detail/foxglove_wire.h"

#include <fmt/format.h>

namespace doppel::foxglove::wire {
namespace {

template <class T>
std::vector<T> elements(const json& value) {
  std::vector<T> out;
  for (const json& element : value) out.push_back(element.get<T>());
  return out;
}

template <class Test>
bool all_of(const json& value, Test test) {
  return std::all_of(value.begin(), value.end(), test);
}

ParameterValue list_value(const json& value, bool as_real, const std::string& name) {
  const auto is_text = [](const json& e) { return e.is_string(); };
  const auto is_bool = [](const json& e) { return e.is_boolean(); };
  const auto is_whole = [](const json& e) { return e.is_number_integer(); };
  const auto is_number = [](const json& e) { return e.is_number(); };
  if (!as_real) {
    if (all_of(value, is_text)) return elements<std::string>(value);
    if (all_of(value, is_bool)) return elements<bool>(value);
    if (all_of(value, is_whole)) return elements<std::int64_t>(value);
  }
  if (all_of(value, is_number)) return elements<double>(value);
  throw Malformed(fmt::format("the elements of parameter '{}' are not all of one type", name));
}

ParameterValue value_from_json(const json& object, const std::string& name) {
  const auto found = object.find("value");
  if (found == object.end() || found->is_null()) return {};
  const std::string type = text_or(object, "type", "");
  if (type == "byte_array")
    throw Malformed(fmt::format("parameter '{}': byte arrays are not supported", name));
  if (found->is_boolean()) return found->get<bool>();
  if (found->is_number_integer() && type != "float64") return found->get<std::int64_t>();
  if (found->is_number()) return found->get<double>();
  if (found->is_string()) return found->get<std::string>();
  if (found->is_array()) return list_value(*found, type == "float64_array", name);
  throw Malformed(fmt::format("the value of parameter '{}' does not have a parameter type", name));
}

}  // namespace

json parse_object(std::string_view frame, std::string& op) {
  json object = json::parse(frame, nullptr, false);
  if (object.is_discarded()) throw Malformed("the text frame is not valid JSON");
  if (!object.is_object()) throw Malformed("the text frame is not a JSON object");
  op = text(object, "op");
  return object;
}

const json& member(const json& object, const char* name) {
  if (!object.is_object()) throw Malformed(fmt::format("an object with the field '{}' was expected", name));
  const auto found = object.find(name);
  if (found == object.end()) throw Malformed(fmt::format("the field '{}' is missing", name));
  return *found;
}

const json& list(const json& object, const char* name) {
  const json& value = member(object, name);
  if (!value.is_array()) throw Malformed(fmt::format("the field '{}' is not a list", name));
  return value;
}

std::string text(const json& object, const char* name) {
  const json& value = member(object, name);
  if (!value.is_string()) throw Malformed(fmt::format("the field '{}' is not a string", name));
  return value.get<std::string>();
}

std::string text_or(const json& object, const char* name, std::string otherwise) {
  return object.is_object() && object.contains(name) && !object[name].is_null() ? text(object, name)
                                                                                : otherwise;
}

std::uint32_t id(const json& value, const char* what) {
  if (!value.is_number_unsigned() || value.get<std::uint64_t>() > 0xFFFFFFFFu) {
    throw Malformed(fmt::format("'{}' must be an integer from 0 to 4294967295", what));
  }
  return value.get<std::uint32_t>();
}

std::vector<std::uint32_t> ids(const json& object, const char* name) {
  std::vector<std::uint32_t> out;
  for (const json& value : list(object, name)) out.push_back(id(value, name));
  return out;
}

std::vector<std::string> texts(const json& object, const char* name) {
  std::vector<std::string> out;
  for (const json& value : list(object, name)) {
    if (!value.is_string()) throw Malformed(fmt::format("'{}' must be a list of strings", name));
    out.push_back(value.get<std::string>());
  }
  return out;
}

json parameters_to_json(const std::vector<Parameter>& parameters) {
  json out = json::array();
  for (const Parameter& parameter : parameters) {
    json entry{{"name", parameter.name}};
    std::visit(
        [&entry]<class T>(const T& value) {
          if constexpr (!std::same_as<T, std::monostate>) entry["value"] = value;
          if constexpr (std::same_as<T, double>) entry["type"] = "float64";
          if constexpr (std::same_as<T, std::vector<double>>) entry["type"] = "float64_array";
        },
        parameter.value);
    out.push_back(std::move(entry));
  }
  return out;
}

std::vector<Parameter> parameters_from_json(const json& object) {
  std::vector<Parameter> out;
  for (const json& entry : list(object, "parameters")) {
    std::string name = text(entry, "name");
    ParameterValue value = value_from_json(entry, name);
    out.push_back({std::move(name), std::move(value)});
  }
  return out;
}

}  // namespace doppel::foxglove::wire
