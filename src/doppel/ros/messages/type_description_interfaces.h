#pragma once
// ROS 2's type_description_interfaces: types as messages, in the response of ~/get_type_description.

#include "doppel/ros/messages/message.h"

namespace doppel::type_description_interfaces::msg {

struct FieldType {
  // The kind, 1 to 22 as in FieldType.msg, plus 48 for an array, 96 for a bounded, 144 for
  // an unbounded sequence.
  std::uint8_t type_id = 0;
  std::uint64_t capacity = 0;  // elements of an array or, at most, of a bounded sequence
  std::uint64_t string_capacity = 0;
  BoundedString<255> nested_type_name;
  DOPPEL_MESSAGE("type_description_interfaces/msg/FieldType", type_id, capacity, string_capacity,
                 nested_type_name)
};

struct Field {
  std::string name;
  FieldType type;
  std::string default_value;
  DOPPEL_MESSAGE("type_description_interfaces/msg/Field", name, type, default_value)
};

struct IndividualTypeDescription {
  BoundedString<255> type_name;
  std::vector<Field> fields;
  DOPPEL_MESSAGE("type_description_interfaces/msg/IndividualTypeDescription", type_name, fields)
};

struct TypeDescription {
  IndividualTypeDescription type_description;
  std::vector<IndividualTypeDescription> referenced_type_descriptions;  // sorted by name
  DOPPEL_MESSAGE("type_description_interfaces/msg/TypeDescription", type_description,
                 referenced_type_descriptions)
};

struct TypeSource {
  std::string type_name, encoding, raw_file_contents;
  DOPPEL_MESSAGE("type_description_interfaces/msg/TypeSource", type_name, encoding, raw_file_contents)
};

struct KeyValue {
  std::string key, value;
  DOPPEL_MESSAGE("type_description_interfaces/msg/KeyValue", key, value)
};

}  // namespace doppel::type_description_interfaces::msg

namespace doppel::type_description_interfaces::srv {

struct GetTypeDescription {
  struct Request {
    std::string type_name;
    std::string type_hash;
    bool include_type_sources = true;
    DOPPEL_MESSAGE("type_description_interfaces/srv/GetTypeDescription_Request", type_name, type_hash,
                   include_type_sources)
  };
  struct Response {
    bool successful = false;
    std::string failure_reason;
    msg::TypeDescription type_description;
    std::vector<msg::TypeSource> type_sources;
    std::vector<msg::KeyValue> extra_information;
    DOPPEL_MESSAGE("type_description_interfaces/srv/GetTypeDescription_Response", successful, failure_reason,
                   type_description, type_sources, extra_information)
  };
};

}  // namespace doppel::type_description_interfaces::srv
