#pragma once
// ROS 2's rcl_interfaces: parameters of nodes, lines of the log and loggers' levels.

#include "doppel/ros/messages/builtin_interfaces.h"

namespace doppel::rcl_interfaces::msg {

struct Log {
  static constexpr std::uint8_t DEBUG = 10, INFO = 20, WARN = 30, ERROR = 40, FATAL = 50;
  builtin_interfaces::msg::Time stamp;
  std::uint8_t level = 0;
  std::string name, msg, file, function;
  std::uint32_t line = 0;
  DOPPEL_MESSAGE("rcl_interfaces/msg/Log", stamp, level, name, msg, file, function, line)
  DOPPEL_CONSTANTS(DEBUG, INFO, WARN, ERROR, FATAL)
};

struct ParameterType {
  static constexpr std::uint8_t PARAMETER_NOT_SET = 0, PARAMETER_BOOL = 1, PARAMETER_INTEGER = 2,
                                PARAMETER_DOUBLE = 3, PARAMETER_STRING = 4, PARAMETER_BYTE_ARRAY = 5,
                                PARAMETER_BOOL_ARRAY = 6, PARAMETER_INTEGER_ARRAY = 7,
                                PARAMETER_DOUBLE_ARRAY = 8, PARAMETER_STRING_ARRAY = 9;
  DOPPEL_EMPTY_MESSAGE("rcl_interfaces/msg/ParameterType")
  DOPPEL_CONSTANTS(PARAMETER_NOT_SET, PARAMETER_BOOL, PARAMETER_INTEGER, PARAMETER_DOUBLE, PARAMETER_STRING,
                   PARAMETER_BYTE_ARRAY, PARAMETER_BOOL_ARRAY, PARAMETER_INTEGER_ARRAY,
                   PARAMETER_DOUBLE_ARRAY, PARAMETER_STRING_ARRAY)
};

struct ParameterValue {
  std::uint8_t type = 0;  // one of ParameterType's
  bool bool_value = false;
  std::int64_t integer_value = 0;
  double double_value = 0;
  std::string string_value;
  std::vector<std::byte> byte_array_value;
  std::vector<bool> bool_array_value;
  std::vector<std::int64_t> integer_array_value;
  std::vector<double> double_array_value;
  std::vector<std::string> string_array_value;
  DOPPEL_MESSAGE("rcl_interfaces/msg/ParameterValue", type, bool_value, integer_value, double_value,
                 string_value, byte_array_value, bool_array_value, integer_array_value, double_array_value,
                 string_array_value)
};

struct Parameter {
  std::string name;
  ParameterValue value;
  DOPPEL_MESSAGE("rcl_interfaces/msg/Parameter", name, value)
};

struct FloatingPointRange {
  double from_value = 0, to_value = 0, step = 0;
  DOPPEL_MESSAGE("rcl_interfaces/msg/FloatingPointRange", from_value, to_value, step)
};

struct IntegerRange {
  std::int64_t from_value = 0, to_value = 0;
  std::uint64_t step = 0;
  DOPPEL_MESSAGE("rcl_interfaces/msg/IntegerRange", from_value, to_value, step)
};

struct ParameterDescriptor {
  std::string name;
  std::uint8_t type = 0;
  std::string description, additional_constraints;
  bool read_only = false, dynamic_typing = false;
  BoundedVector<FloatingPointRange, 1> floating_point_range;
  BoundedVector<IntegerRange, 1> integer_range;
  DOPPEL_MESSAGE("rcl_interfaces/msg/ParameterDescriptor", name, type, description, additional_constraints,
                 read_only, dynamic_typing, floating_point_range, integer_range)
};

struct SetParametersResult {
  bool successful = false;
  std::string reason;
  DOPPEL_MESSAGE("rcl_interfaces/msg/SetParametersResult", successful, reason)
};

struct ListParametersResult {
  std::vector<std::string> names, prefixes;
  DOPPEL_MESSAGE("rcl_interfaces/msg/ListParametersResult", names, prefixes)
};

struct ParameterEvent {
  builtin_interfaces::msg::Time stamp;
  std::string node;
  std::vector<Parameter> new_parameters, changed_parameters, deleted_parameters;
  DOPPEL_MESSAGE("rcl_interfaces/msg/ParameterEvent", stamp, node, new_parameters, changed_parameters,
                 deleted_parameters)
};

struct LoggerLevel {
  static constexpr std::uint8_t LOG_LEVEL_UNKNOWN = 0, LOG_LEVEL_DEBUG = 10, LOG_LEVEL_INFO = 20,
                                LOG_LEVEL_WARN = 30, LOG_LEVEL_ERROR = 40, LOG_LEVEL_FATAL = 50;
  std::string name;
  std::uint32_t level = 0;
  DOPPEL_MESSAGE("rcl_interfaces/msg/LoggerLevel", name, level)
  DOPPEL_CONSTANTS(LOG_LEVEL_UNKNOWN, LOG_LEVEL_DEBUG, LOG_LEVEL_INFO, LOG_LEVEL_WARN, LOG_LEVEL_ERROR,
                   LOG_LEVEL_FATAL)
};

struct ParameterEventDescriptors {
  std::vector<ParameterDescriptor> new_parameters, changed_parameters, deleted_parameters;
  DOPPEL_MESSAGE("rcl_interfaces/msg/ParameterEventDescriptors", new_parameters, changed_parameters,
                 deleted_parameters)
};

struct SetLoggerLevelsResult {
  bool successful = false;
  std::string reason;
  DOPPEL_MESSAGE("rcl_interfaces/msg/SetLoggerLevelsResult", successful, reason)
};

}  // namespace doppel::rcl_interfaces::msg

namespace doppel::rcl_interfaces::srv {

struct ListParameters {
  struct Request {
    static constexpr std::uint64_t DEPTH_RECURSIVE = 0;
    std::vector<std::string> prefixes;
    std::uint64_t depth = DEPTH_RECURSIVE;
    DOPPEL_MESSAGE("rcl_interfaces/srv/ListParameters_Request", prefixes, depth)
    DOPPEL_CONSTANTS(DEPTH_RECURSIVE)
  };
  struct Response {
    msg::ListParametersResult result;
    DOPPEL_MESSAGE("rcl_interfaces/srv/ListParameters_Response", result)
  };
};

struct GetParameters {
  struct Request {
    std::vector<std::string> names;
    DOPPEL_MESSAGE("rcl_interfaces/srv/GetParameters_Request", names)
  };
  struct Response {
    std::vector<msg::ParameterValue> values;
    DOPPEL_MESSAGE("rcl_interfaces/srv/GetParameters_Response", values)
  };
};

struct GetParameterTypes {
  struct Request {
    std::vector<std::string> names;
    DOPPEL_MESSAGE("rcl_interfaces/srv/GetParameterTypes_Request", names)
  };
  struct Response {
    std::vector<std::uint8_t> types;
    DOPPEL_MESSAGE("rcl_interfaces/srv/GetParameterTypes_Response", types)
  };
};

struct DescribeParameters {
  struct Request {
    std::vector<std::string> names;
    DOPPEL_MESSAGE("rcl_interfaces/srv/DescribeParameters_Request", names)
  };
  struct Response {
    std::vector<msg::ParameterDescriptor> descriptors;
    DOPPEL_MESSAGE("rcl_interfaces/srv/DescribeParameters_Response", descriptors)
  };
};

struct SetParameters {
  struct Request {
    std::vector<msg::Parameter> parameters;
    DOPPEL_MESSAGE("rcl_interfaces/srv/SetParameters_Request", parameters)
  };
  struct Response {
    std::vector<msg::SetParametersResult> results;
    DOPPEL_MESSAGE("rcl_interfaces/srv/SetParameters_Response", results)
  };
};

struct SetParametersAtomically {
  struct Request {
    std::vector<msg::Parameter> parameters;
    DOPPEL_MESSAGE("rcl_interfaces/srv/SetParametersAtomically_Request", parameters)
  };
  struct Response {
    msg::SetParametersResult result;
    DOPPEL_MESSAGE("rcl_interfaces/srv/SetParametersAtomically_Response", result)
  };
};

struct GetLoggerLevels {
  struct Request {
    std::vector<std::string> names;
    DOPPEL_MESSAGE("rcl_interfaces/srv/GetLoggerLevels_Request", names)
  };
  struct Response {
    std::vector<msg::LoggerLevel> levels;
    DOPPEL_MESSAGE("rcl_interfaces/srv/GetLoggerLevels_Response", levels)
  };
};

struct SetLoggerLevels {
  struct Request {
    std::vector<msg::LoggerLevel> levels;
    DOPPEL_MESSAGE("rcl_interfaces/srv/SetLoggerLevels_Request", levels)
  };
  struct Response {
    std::vector<msg::SetLoggerLevelsResult> results;
    DOPPEL_MESSAGE("rcl_interfaces/srv/SetLoggerLevels_Response", results)
  };
};

}  // namespace doppel::rcl_interfaces::srv
