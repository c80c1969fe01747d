#include <fmt/format.h>

#include <iterator>

#include "doppel/ros/messages/generator/definition.h"

namespace doppel::message_generator {
namespace {

constexpr std::string_view kFolder = "doppel/ros/messages/";

// "std::vector<geometry_msgs::msg::Point>" for code in the namespace <package>::<kind>.
std::string cpp_type(const FieldType& type, const Type& owner) {
  std::string name;
  if (type.basic != nullptr) {
    name = type.text_bound > 0 ? fmt::format("BoundedString<{}>", type.text_bound)
                               : std::string(type.basic->cpp);
  } else if (type.message->package == owner.package && owner.kind == "msg") {
    name = type.message->name;
  } else {
    name = fmt::format("{}::msg::{}", type.message->package, type.message->name);
  }
  if (type.shape == "array") return fmt::format("std::array<{}, {}>", name, type.size);
  if (type.shape == "sequence" && type.size > 0) return fmt::format("BoundedVector<{}, {}>", name, type.size);
  return type.shape == "sequence" ? fmt::format("std::vector<{}>", name) : name;
}

// " = 1", "{1}" or "": numbers are initialised, as in ROS 2.
std::string initializer(const Declaration& declaration, const Member& member) {
  const FieldType& type = declaration.type;
  if (type.shape == "array") return "{}";
  if (type.shape == "sequence" || type.basic == nullptr) return "";
  if (type.basic->name == "byte") return fmt::format("{{{}}}", member.value);
  if (!member.value.empty()) return " = " + member.value;
  if (type.basic->cpp.find("string") != std::string_view::npos) return "";
  return type.basic->name == "bool" ? " = false" : " = 0";
}

void write_declaration(std::string& out, const Declaration& declaration, const Type& owner,
                       std::string_view indent) {
  for (const std::string& line : declaration.comments) out += fmt::format("{}// {}\n", indent, line);
  std::string type = cpp_type(declaration.type, owner);
  if (declaration.constant) type = "static constexpr " + (type == "std::string" ? "std::string_view" : type);
  std::string_view separator = " ";
  out += fmt::format("{}{}", indent, type);
  for (const Member& member : declaration.members) {
    out += fmt::format("{}{}{}", separator, member.name, initializer(declaration, member));
    separator = ", ";
  }
  out += declaration.comment.empty() ? ";\n" : fmt::format(";  // {}\n", declaration.comment);
}

// "if (ros_distro() >= Distro::kilted) "; empty for what all distributions have.
std::string condition(const DistroRange& range) {
  if (range.first != kFirstDistro)
    return fmt::format("if (ros_distro() >= Distro::{}) ", to_string(range.first));
  if (range.last != kLastDistro)
    return fmt::format("if (ros_distro() <= Distro::{}) ", to_string(range.last));
  return "";
}

// The members of a struct; `name`: of the struct, in its namespace.
void write_type(std::string& out, const Type& type, std::string_view name, std::string_view indent) {
  const std::string inner = std::string(indent) + "  ";
  out += fmt::format("{}struct {} {{\n", indent, name);
  bool is_empty = true;
  std::string visits;
  for (const Declaration& declaration : type.declarations) {
    write_declaration(out, declaration, type, inner);
    if (declaration.constant) continue;
    is_empty = false;
    for (const Member& member : declaration.members)
      visits += fmt::format("{0}  {2}visit(\"{1}\", self.{1});\n", inner, member.name,
                            condition(declaration.range));
  }
  out += fmt::format("{}static constexpr std::string_view kType = \"{}\";\n", inner, type.full_name());
  if (is_empty) out += inner + "static constexpr bool kIsEmpty = true;\n";
  out += inner + "DOPPEL_API static const TypeSupport& builtin_type();\n";
  out += inner + "template <class Self, class Visitor>\n";
  out += fmt::format("{0}static void for_each_field({1}) {{\n{2}{0}}}\n", inner,
                     is_empty ? "Self&, Visitor&&" : "Self& self, Visitor&& visit", visits);
  out += fmt::format("{}}};\n", indent);
}

std::string_view part_name(const Interface& interface, std::size_t part) {
  return interface.kind == "msg" ? std::string_view(interface.name)
                                 : part_suffix(interface.kind, part).substr(1);
}

void write_interface(std::string& out, const Interface& interface) {
  out += '\n';
  for (const std::string& line : interface.comments) out += fmt::format("// {}\n", line);
  const bool has_parts = interface.kind != "msg";
  if (has_parts) out += fmt::format("struct {} {{\n", interface.name);
  for (std::size_t i = 0; i < interface.parts.size(); ++i)
    write_type(out, *interface.parts[i], part_name(interface, i), has_parts ? "  " : "");
  if (has_parts) out += "};\n";
}

std::string header(const Package& package) {
  std::string out = "#pragma once\n";
  for (const std::string& line : package.comments) out += fmt::format("// {}\n", line);
  out += fmt::format("// Generated from {}definitions/{}.msgs.\n\n", kFolder, package.name);
  for (const std::string& other : package.uses) out += fmt::format("#include \"{}{}.h\"\n", kFolder, other);
  out += fmt::format("#include \"{}message.h\"\n", kFolder);
  std::string space;
  for (const Interface& interface : package.interfaces) {
    const std::string next = fmt::format("doppel::{}::{}", package.name, interface.kind);
    if (next != space) {
      if (!space.empty()) out += fmt::format("\n}}  // namespace {}\n", space);
      out += fmt::format("\nnamespace {} {{\n", next);
      space = next;
    }
    write_interface(out, interface);
  }
  out += fmt::format("\n}}  // namespace {}\n", space);
  for (const std::string& include : package.includes) out += fmt::format("\n#include \"{}\"\n", include);
  return out;
}

// A default as a number; that of a text is not part of a type's description.
std::string number(const Declaration& declaration, const Member& member) {
  if (member.value.empty() || declaration.type.basic->kind == "text") return "0";
  if (declaration.type.basic->kind == "boolean") return member.value == "true" ? "1" : "0";
  return member.value;
}

std::string range_text(const DistroRange& range) {
  if (range == DistroRange{}) return "{}";
  return fmt::format("{{Distro::{}, Distro::{}}}", to_string(range.first), to_string(range.last));
}

// Rows of fields and constants, and of the types with their parts of them (detail/builtin_types.h).
void write_rows(std::string& out, const Definitions& definitions) {
  std::string fields, constants, types;
  std::size_t field_count = 0, constant_count = 0;
  for (const Type& type : definitions.types) {
    const std::size_t first_field = field_count, first_constant = constant_count;
    for (const Declaration& declaration : type.declarations) {
      const FieldType& field = declaration.type;
      const std::string_view kind = field.basic != nullptr ? field.basic->kind : "message";
      for (const Member& member : declaration.members) {
        const std::string value = number(declaration, member);
        if (declaration.constant) {
          const bool is_text = kind == "text";
          constants += fmt::format("    {{\"{}\", FieldKind::{}, {}, {}}},\n", member.name, kind, value,
                                   is_text ? member.value : "\"\"");
          ++constant_count;
        } else {
          fields += fmt::format("    {{\"{}\", FieldKind::{}, FieldShape::{}, {}, {}, {}, {}, {}}},\n",
                                member.name, kind, field.shape, field.size, field.text_bound,
                                field.message != nullptr ? fmt::to_string(field.message->index) : "0", value,
                                range_text(declaration.range));
          ++field_count;
        }
      }
    }
    types +=
        fmt::format("    {{\"{}\", {{kFields + {}, {}}}, {{kConstants + {}, {}}}}},\n", type.full_name(),
                    first_field, field_count - first_field, first_constant, constant_count - first_constant);
  }
  out += fmt::format(
      "constexpr FieldRow kFields[] = {{\n{}}};\n\nconstexpr ConstantRow kConstants[] = {{\n{}}};\n\n",
      fields, constants);
  out += fmt::format("constexpr TypeRow kTypes[] = {{\n{}}};\n", types);
}

std::string cpp_name(const Package& package, const Interface& interface) {
  return fmt::format("{}::{}::{}", package.name, interface.kind, interface.name);
}

std::string source(const Definitions& definitions) {
  std::string out = fmt::format("// Generated from {}definitions.\n\n#include \"{}detail/builtin_types.h\"\n",
                                kFolder, kFolder);
  std::string functions, services, actions;
  for (const Package& package : definitions.packages) {
    out += fmt::format("#include \"{}{}.h\"\n", kFolder, package.name);
    for (const Interface& interface : package.interfaces) {
      const std::string name = cpp_name(package, interface);
      for (std::size_t i = 0; i < interface.parts.size(); ++i) {
        const std::string part = interface.kind == "msg" ? "" : fmt::format("::{}", part_name(interface, i));
        functions += fmt::format(
            "const TypeSupport& {}{}::builtin_type() {{ return messages_detail::builtin_type_at({}); }}\n",
            name, part, interface.parts[i]->index);
      }
      if (interface.kind == "srv")
        services += fmt::format("  register_service(service_support<{}>());\n", name);
      if (interface.kind == "action") actions += fmt::format("  register_action_types<{}>();\n", name);
    }
  }
  out += "\nnamespace doppel {\nnamespace messages_detail {\nnamespace {\n\n";
  write_rows(out, definitions);
  out += "\n}  // namespace\n\nconst std::span<const TypeRow> kBuiltinTypes = kTypes;\n";
  out += "\nvoid register_builtin_types() {\n";
  out += "  for (std::size_t i = 0; i < kBuiltinTypes.size(); ++i) register_type(builtin_type_at(i));\n";
  out += fmt::format("{}{}}}\n\n}}  // namespace messages_detail\n\n", services, actions);
  return out + functions + "\n}  // namespace doppel\n";
}

}  // namespace

Files cpp_files(const Definitions& definitions) {
  Files files;
  for (const Package& package : definitions.packages)
    files.emplace_back(package.name + ".h", header(package));
  files.emplace_back("definitions.cpp", source(definitions));
  return files;
}

}  // namespace doppel::message_generator
