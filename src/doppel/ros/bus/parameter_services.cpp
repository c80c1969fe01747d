#include "doppel/ros/bus/parameter_services.h"

#include <algorithm>
#include <limits>

namespace doppel {
namespace {

namespace msg = rcl_interfaces::msg;
namespace srv = rcl_interfaces::srv;
using Type = msg::ParameterType;

// rcl's numbers, in the order of ParameterValue's alternatives.
constexpr std::uint8_t kTypes[] = {
    Type::PARAMETER_NOT_SET,       Type::PARAMETER_BOOL,         Type::PARAMETER_INTEGER,
    Type::PARAMETER_DOUBLE,        Type::PARAMETER_STRING,       Type::PARAMETER_BOOL_ARRAY,
    Type::PARAMETER_INTEGER_ARRAY, Type::PARAMETER_DOUBLE_ARRAY, Type::PARAMETER_STRING_ARRAY};

std::int64_t whole(double end) {
  using Limits = std::numeric_limits<std::int64_t>;
  if (end >= static_cast<double>(Limits::max())) return Limits::max();
  return end <= static_cast<double>(Limits::min()) ? Limits::min() : static_cast<std::int64_t>(end);
}

msg::SetParametersResult result_of(const Status& status) {
  return {status.ok(), status.why()};
}

// The name behind the prefix and its dot; the name itself for the empty prefix; nullopt: not below it.
std::optional<std::string_view> below(std::string_view name, std::string_view prefix) {
  if (prefix.empty() || name == prefix) return name;
  if (!name.starts_with(prefix) || name[prefix.size()] != '.') return std::nullopt;
  return name.substr(prefix.size() + 1);
}

msg::ListParametersResult list(const Parameters& parameters, const srv::ListParameters::Request& request) {
  const auto wanted = [&request](std::string_view name) {
    const std::vector<std::string> everything{""};
    return std::ranges::any_of(request.prefixes.empty() ? everything : request.prefixes,
                               [&](const auto& prefix) {
                                 const auto rest = below(name, prefix);
                                 if (!rest) return false;
                                 const auto dots = static_cast<std::uint64_t>(std::ranges::count(*rest, '.'));
                                 return request.depth == srv::ListParameters::Request::DEPTH_RECURSIVE ||
                                        dots < request.depth || name == prefix;
                               });
  };
  msg::ListParametersResult result;
  std::vector<std::string> names = parameters.names();
  std::ranges::sort(names);  // as rclcpp keeps them
  for (const std::string& name : names) {
    if (!wanted(name)) continue;
    result.names.push_back(name);
    const auto dot = name.rfind('.');
    if (dot == std::string::npos) continue;
    const std::string prefix = name.substr(0, dot);
    if (std::ranges::find(result.prefixes, prefix) == result.prefixes.end())
      result.prefixes.push_back(prefix);
  }
  return result;
}

msg::ParameterDescriptor describe(const Parameters::Declared& declared) {
  msg::ParameterDescriptor descriptor;
  descriptor.name = declared.name;
  descriptor.type = kTypes[declared.value.index()];
  descriptor.description = declared.options.description;
  descriptor.read_only = declared.options.read_only;
  descriptor.dynamic_typing = declared.options.dynamic_typing;
  if (const auto& range = declared.options.range) {
    if (std::holds_alternative<double>(declared.value)) {
      constexpr double kMax = std::numeric_limits<double>::max();
      descriptor.floating_point_range.push_back(
          {std::clamp(range->from, -kMax, kMax), std::clamp(range->to, -kMax, kMax), 0});
    } else {
      descriptor.integer_range.push_back({whole(range->from), whole(range->to), 0});
    }
  }
  return descriptor;
}

// One value for each name, as in rclcpp: an unknown one is "not set" if undeclared parameters are allowed;
// otherwise the response is empty.
template <class T, class Answer>
std::vector<T> for_each(const Parameters& parameters, const std::vector<std::string>& names, Answer answer) {
  std::vector<T> out;
  for (const std::string& name : names) {
    const auto* declared = parameters.find(name);
    if (declared == nullptr && !parameters.allows_undeclared()) return {};
    out.push_back(answer(declared == nullptr ? Parameters::Declared{name, {}, {}} : *declared));
  }
  return out;
}

std::vector<std::pair<std::string, ParameterValue>> wanted_of(const std::vector<msg::Parameter>& parameters) {
  std::vector<std::pair<std::string, ParameterValue>> wanted;
  for (const msg::Parameter& parameter : parameters)
    wanted.emplace_back(parameter.name, from_msg(parameter.value));
  return wanted;
}

void serve_reading(Node& node) {
  Parameters& parameters = node.parameters();
  node.serve<srv::ListParameters>(
      "~/list_parameters",
      [&parameters](const auto& request, const auto& respond) { respond({list(parameters, request)}); });
  node.serve<srv::GetParameters>("~/get_parameters", [&parameters](const auto& request, const auto& respond) {
    respond({for_each<msg::ParameterValue>(parameters, request.names,
                                           [](const auto& d) { return to_msg(d.value); })});
  });
  node.serve<srv::GetParameterTypes>(
      "~/get_parameter_types", [&parameters](const auto& request, const auto& respond) {
        respond({for_each<std::uint8_t>(parameters, request.names,
                                        [](const auto& d) { return kTypes[d.value.index()]; })});
      });
  node.serve<srv::DescribeParameters>(
      "~/describe_parameters", [&parameters](const auto& request, const auto& respond) {
        respond({for_each<msg::ParameterDescriptor>(parameters, request.names, describe)});
      });
}

void serve_writing(Node& node) {
  Parameters& parameters = node.parameters();
  node.serve<srv::SetParameters>("~/set_parameters", [&parameters](const auto& request, const auto& respond) {
    srv::SetParameters::Response response;
    for (const msg::Parameter& parameter : request.parameters) {
      response.results.push_back(result_of(parameters.set(parameter.name, from_msg(parameter.value))));
    }
    respond(response);
  });
  node.serve<srv::SetParametersAtomically>(
      "~/set_parameters_atomically", [&parameters](const auto& request, const auto& respond) {
        respond({result_of(parameters.set_all(wanted_of(request.parameters)))});
      });
}

}  // namespace

void serve_parameters(Node& node) {
  serve_reading(node);
  serve_writing(node);
}

msg::ParameterValue to_msg(const ParameterValue& value) {
  msg::ParameterValue message;
  message.type = kTypes[value.index()];
  std::visit(
      [&message]<class T>(const T& held) {
        if constexpr (std::same_as<T, bool>) message.bool_value = held;
        if constexpr (std::same_as<T, std::int64_t>) message.integer_value = held;
        if constexpr (std::same_as<T, double>) message.double_value = held;
        if constexpr (std::same_as<T, std::string>) message.string_value = held;
        if constexpr (std::same_as<T, std::vector<bool>>) message.bool_array_value = held;
        if constexpr (std::same_as<T, std::vector<std::int64_t>>) message.integer_array_value = held;
        if constexpr (std::same_as<T, std::vector<double>>) message.double_array_value = held;
        if constexpr (std::same_as<T, std::vector<std::string>>) message.string_array_value = held;
      },
      value);
  return message;
}

ParameterValue from_msg(const msg::ParameterValue& message) {
  switch (message.type) {
    case Type::PARAMETER_BOOL:
      return message.bool_value;
    case Type::PARAMETER_INTEGER:
      return message.integer_value;
    case Type::PARAMETER_DOUBLE:
      return message.double_value;
    case Type::PARAMETER_STRING:
      return message.string_value;
    case Type::PARAMETER_BYTE_ARRAY: {
      std::vector<std::int64_t> bytes;
      for (const std::byte byte : message.byte_array_value)
        bytes.push_back(std::to_integer<std::int64_t>(byte));
      return bytes;
    }
    case Type::PARAMETER_BOOL_ARRAY:
      return message.bool_array_value;
    case Type::PARAMETER_INTEGER_ARRAY:
      return message.integer_array_value;
    case Type::PARAMETER_DOUBLE_ARRAY:
      return message.double_array_value;
    case Type::PARAMETER_STRING_ARRAY:
      return message.string_array_value;
    default:
      return std::monostate{};
  }
}

}  // namespace doppel
