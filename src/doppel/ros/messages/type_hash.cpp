#include "doppel/ros/messages/type_hash.h"

#include <fmt/format.h>

#include <iterator>

#include "doppel/base/core/sha256.h"

namespace doppel {
namespace {

using type_description_interfaces::msg::IndividualTypeDescription;

// Writes JSON as Python's json.dumps does with its usual separators. Names of types and fields need no escapes.
void write(const IndividualTypeDescription& type, std::string& json) {
  json += fmt::format(R"({{"type_name": "{}", "fields": [)", std::string_view(type.type_name));
  const char* separator = "";
  for (const auto& field : type.fields) {
    fmt::format_to(std::back_inserter(json),
                   R"({}{{"name": "{}", "type": {{"type_id": {}, "capacity": {}, "string_capacity": {}, )"
                   R"("nested_type_name": "{}"}}}})",
                   separator, field.name, field.type.type_id, field.type.capacity, field.type.string_capacity,
                   std::string_view(field.type.nested_type_name));
    separator = ", ";
  }
  json += "]}";
}

}  // namespace

std::string type_hash(const TypeDescriptionMessage& type) {
  std::string json = R"({"type_description": )";
  write(type.type_description, json);
  json += R"(, "referenced_type_descriptions": [)";
  for (std::size_t i = 0; i < type.referenced_type_descriptions.size(); ++i) {
    if (i > 0) json += ", ";
    write(type.referenced_type_descriptions[i], json);
  }
  json += "]}";
  return "RIHS01_" + sha256_hex(json);
}

std::string type_hash(const TypeDescription& type) {
  return type_hash(description_message(type));
}

std::string service_type_hash(const ServiceSupport& service) {
  return type_hash(description_message(service));
}

std::string action_type_hash(const ActionSupport& action) {
  return type_hash(description_message(action));
}

}  // namespace doppel
