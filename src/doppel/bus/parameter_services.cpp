#include "doppel/bus/parameter_services.h"

#include <algorithm>

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
  for (const std::string& name : parameters.names()) {
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

msg::ParameterDescriptor describe_parameter(const Parameters& parameters, const std::string& name) {
  msg::ParameterDescriptor descriptor;
  descriptor.name = name;
  if (const auto* declared = parameters.find(name)) {
    descriptor.type = kTypes[declared->value.index()];
    descriptor.description = declared->description;
    descriptor.read_only = declared->read_only;
  }
  return descriptor;
}

// All or nothing: every value is checked before the first is set.
Status set_all(Parameters& parameters, const std::vector<msg::Parameter>& wanted) {
  for (const msg::Parameter& parameter : wanted) {
    ParameterValue value = from_msg(parameter.value);
    if (Status status = parameters.check(parameter.name, value); !status) return status;
  }
  for (const msg::Parameter& parameter : wanted) {
    if (Status status = parameters.set(parameter.name, from_msg(parameter.value)); !status) return status;
  }
  return {};
}

void serve_reading(Node& node) {
  Parameters& parameters = node.parameters();
  node.serve<srv::ListParameters>(
      "~/list_parameters",
      [&parameters](const auto& request, const auto& respond) { respond({list(parameters, request)}); });
  node.serve<srv::GetParameters>("~/get_parameters", [&parameters](const auto& request, const auto& respond) {
    srv::GetParameters::Response response;
    for (const std::string& name : request.names) {
      const auto* declared = parameters.find(name);
      response.values.push_back(declared != nullptr ? to_msg(declared->value) : msg::ParameterValue());
    }
    respond(response);
  });
  node.serve<srv::GetParameterTypes>("~/get_parameter_types",
                                     [&parameters](const auto& request, const auto& respond) {
                                       srv::GetParameterTypes::Response response;
                                       for (const std::string& name : request.names) {
                                         response.types.push_back(describe_parameter(parameters, name).type);
                                       }
                                       respond(response);
                                     });
  node.serve<srv::DescribeParameters>(
      "~/describe_parameters", [&parameters](const auto& request, const auto& respond) {
        srv::DescribeParameters::Response response;
        for (const std::string& name : request.names) {
          response.descriptors.push_back(describe_parameter(parameters, name));
        }
        respond(response);
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
  node.serve<srv::SetParametersAtomically>("~/set_parameters_atomically",
                                           [&parameters](const auto& request, const auto& respond) {
                                             respond({result_of(set_all(parameters, request.parameters))});
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
