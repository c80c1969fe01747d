#include <fmt/format.h>

#include "doppel/ros/messages/generator/definition.h"

namespace doppel::message_generator {
namespace {

// The names follow those by which rosidl hands types to a DDS vendor's generator: modules
// <package>::<kind>::dds_, names with a trailing '_'.
std::string scoped(std::string_view package, std::string_view kind, std::string_view name) {
  return fmt::format("{}::{}::dds_::{}_", package, kind, name);
}

std::string idl_type(const FieldType& type) {
  std::string name = type.basic != nullptr
                         ? std::string(type.basic->idl)
                         : scoped(type.message->package, type.message->kind, type.message->name);
  if (type.text_bound > 0) name += fmt::format("<{}>", type.text_bound);
  if (type.shape != "sequence") return name;
  return type.size > 0 ? fmt::format("sequence<{}, {}>", name, type.size) : fmt::format("sequence<{}>", name);
}

std::string structure(std::string_view package, std::string_view kind, std::string_view name,
                      std::string_view members) {
  return fmt::format("\nmodule {} {{ module {} {{ module dds_ {{\nstruct {}_ {{\n{}}};\n}}; }}; }};\n",
                     package, kind, name, members);
}

std::string type_structure(const Type& type, Distro distro) {
  std::string members;
  for (const Declaration& declaration : type.declarations) {
    if (declaration.constant || !declaration.range.contains(distro)) continue;
    const FieldType& field = declaration.type;
    const std::string size = field.shape == "array" ? fmt::format("[{}]", field.size) : "";
    for (const Member& member : declaration.members)
      members += fmt::format("  {} {}_{};\n", idl_type(field), member.name, size);
  }
  if (members.empty()) members = "  uint8 structure_needs_at_least_one_member_;\n";
  return structure(type.package, type.kind, type.name, members);
}

// The parts of the services and the topic that rosidl derives from an action.
std::string derived_structures(const Package& package, const Interface& action) {
  const std::string id = "  unique_identifier_msgs::msg::dds_::UUID_ goal_id_;\n";
  const auto derived = [&](std::string_view suffix, const std::string& members) {
    return structure(package.name, "action", action.name + std::string(suffix), members);
  };
  const auto part = [&](std::string_view suffix) {
    return scoped(package.name, "action", action.name + std::string(suffix));
  };
  return derived("_SendGoal_Request", id + fmt::format("  {} goal_;\n", part("_Goal"))) +
         derived("_SendGoal_Response",
                 "  boolean accepted_;\n  builtin_interfaces::msg::dds_::Time_ stamp_;\n") +
         derived("_GetResult_Request", id) +
         derived("_GetResult_Response", fmt::format("  int8 status_;\n  {} result_;\n", part("_Result"))) +
         derived("_FeedbackMessage", id + fmt::format("  {} feedback_;\n", part("_Feedback")));
}

std::string idl(const Package& package, Distro distro) {
  std::string structures;
  std::set<std::string> includes = package.uses;
  for (const Interface& interface : package.interfaces) {
    for (const Type* type : interface.parts) structures += type_structure(*type, distro);
    if (interface.kind != "action") continue;
    structures += derived_structures(package, interface);
    includes.insert({"builtin_interfaces", "unique_identifier_msgs"});
  }
  std::string text = fmt::format(
      "// Generated from definitions/{0}.msgs.\n#ifndef {0}_IDL\n#define {0}_IDL\n", package.name);
  for (const std::string& other : includes) text += fmt::format("#include \"{}.idl\"\n", other);
  return text + structures + "\n#endif\n";
}

}  // namespace

Files idl_files(const Definitions& definitions, Distro distro) {
  Files files;
  for (const Package& package : definitions.packages)
    files.emplace_back(package.name + ".idl", idl(package, distro));
  return files;
}

}  // namespace doppel::message_generator
