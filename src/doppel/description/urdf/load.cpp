#include "doppel/description/urdf/load.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "doppel/base/core/names.h"
#include "doppel/description/urdf/urdf_parser.h"
#include "doppel/description/xacro/xacro.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

// A .urdf without xacro is read as urdfdom reads it.
XmlTree read_tree(const fs::path& file) {
  try {
    return load_xml_tree(file.string(), XmlContent::content);
  } catch (const InputError& strict) {
    if (file.extension() == ".xacro" || strict.diagnostics().front().rule != "xml.not_well_formed") throw;
    try {
      XmlTree tree = load_xml_tree(file.string(), XmlContent::content, XmlRules::lenient);
      if (!needs_xacro(tree)) return tree;
    } catch (const InputError&) {
      throw strict;
    }
    throw;
  }
}

bool xacro_element(const XmlNode& node) {
  return node.kind == XmlNode::Kind::element && node.name.starts_with("xacro:");
}

void remove_xacro(XmlNode& node) {
  std::erase_if(node.children, xacro_element);
  for (XmlNode& child : node.children) remove_xacro(child);
}

bool substitutes(const XmlNode& node) {
  const auto any = [](const std::string& text) {
    return text.find("${") != std::string::npos || text.find("$(") != std::string::npos;
  };
  return any(node.text) ||
         std::any_of(node.attributes.begin(), node.attributes.end(),
                     [&](const XmlAttribute& a) { return any(a.value); }) ||
         std::any_of(node.children.begin(), node.children.end(), substitutes);
}

// More than a call of a macro without a body: leaving it out would lose a part of the robot.
bool works_with_xacro(const XmlNode& node) {
  static const std::set<std::string, std::less<>> kWords = {
      "xacro:include", "xacro:macro",        "xacro:property", "xacro:arg",       "xacro:if",
      "xacro:unless",  "xacro:insert_block", "xacro:element",  "xacro:attribute", "xacro:call"};
  const auto inside = [](const XmlNode& child) { return child.kind == XmlNode::Kind::element; };
  if (xacro_element(node) &&
      (kWords.contains(node.name) || std::any_of(node.children.begin(), node.children.end(), inside)))
    return true;
  return std::any_of(node.children.begin(), node.children.end(), works_with_xacro);
}

// A .urdf with a call of an undefined macro, and no other xacro, is read as a plain URDF: urdfdom
// skips unknown elements.
bool stands_without_xacro(XmlNode& root, const Diagnostic& problem) {
  if (problem.rule != "xacro.unknown_macro" || works_with_xacro(root) || substitutes(root)) return false;
  remove_xacro(root);
  return std::any_of(root.children.begin(), root.children.end(),
                     [](const XmlNode& child) { return child.is("link"); });
}

void report_unknown_arguments(const XacroArguments& arguments, const XacroResult& expansion,
                              const SourceLocation& root, Diagnostics& diagnostics) {
  std::set<std::string> known(expansion.declared_arguments.begin(), expansion.declared_arguments.end());
  known.insert(expansion.used_arguments.begin(), expansion.used_arguments.end());
  const std::vector<std::string> names(known.begin(), known.end());
  for (const auto& [name, value] : arguments) {
    if (known.contains(name)) continue;
    diagnostics.warning(
        "xacro.unknown_argument", root,
        fmt::format("the argument '{}' is given, but never used{}", name, did_you_mean(name, names)));
  }
}

void collect_arguments(const XmlNode& node, std::vector<XacroArgumentDeclaration>& out) {
  for (const XmlNode& child : node.children) {
    if (child.is("xacro:arg")) {
      const XmlAttribute *name = child.find("name"), *fallback = child.find("default");
      if (name != nullptr)
        out.push_back(
            {name->value, fallback != nullptr ? fallback->value : "", fallback != nullptr, child.where});
    }
    collect_arguments(child, out);
  }
}

// The files of <xacro:include> elements that need no evaluation other than $(find ...).
void collect_included(const XmlNode& node, const fs::path& folder, const PackageResolver& resolver,
                      std::vector<fs::path>& out) {
  for (const XmlNode& child : node.children) {
    collect_included(child, folder, resolver, out);
    const XmlAttribute* filename = child.is("xacro:include") ? child.find("filename") : nullptr;
    if (filename == nullptr) continue;
    std::string name = filename->value;
    if (name.starts_with("$(find ")) {
      const std::size_t end = name.find(')');
      if (end == std::string::npos) continue;
      name = resolver.find_package(name.substr(7, end - 7)).path.string() + name.substr(end + 1);
    }
    if (name.find('$') == std::string::npos)
      out.push_back(fs::path(name).is_absolute() ? fs::path(name) : folder / name);
  }
}

}  // namespace

ExpandedDescription expand_description(const fs::path& file, const XacroArguments& arguments,
                                       PackageResolver& resolver, Diagnostics& diagnostics) {
  resolver.add_context(file);
  ExpandedDescription out;
  out.file = file;
  const bool named_so = file.extension() == ".xacro";
  XmlTree tree = read_tree(file);
  XacroResult expansion;
  if (!named_so && !needs_xacro(tree)) {
    for (Diagnostic& warning : tree.tolerated) diagnostics.add(std::move(warning));
    out.files = {file};
    out.root = tree.node();
  } else {
    XmlNode as_written = named_so ? XmlNode() : tree.node();
    try {
      expansion = expand_xacro(std::move(tree), file, arguments, resolver, diagnostics);
      out.was_xacro = true;
      out.files = std::move(expansion.files);
      out.root = expansion.tree.node();
    } catch (const InputError& error) {
      Diagnostic problem = error.diagnostics().front();
      if (named_so || !stands_without_xacro(as_written, problem)) throw;
      problem.severity = Severity::warning;
      problem.rule = "xacro.left_over";
      problem.message +=
          "; nothing else in this .urdf uses xacro, so it is read as by urdfdom, without its calls";
      diagnostics.add(std::move(problem));
      out.files = {file};
      out.root = std::move(as_written);
    }
  }
  report_unknown_arguments(arguments, expansion, out.root.where, diagnostics);
  return out;
}

RobotDescription read_description(const ExpandedDescription& expanded, const PackageResolver& resolver,
                                  Diagnostics& diagnostics) {
  RobotDescription robot = read_urdf(expanded.root, expanded.folder(), resolver, diagnostics);
  check_tree(robot, diagnostics);
  robot.xml = to_xml(expanded.root);
  return robot;
}

LoadedDescription load_description(const fs::path& file, const XacroArguments& arguments,
                                   PackageResolver& resolver, Diagnostics& diagnostics) {
  const ExpandedDescription expanded = expand_description(file, arguments, resolver, diagnostics);
  LoadedDescription out;
  out.robot = read_description(expanded, resolver, diagnostics);
  diagnostics.throw_if_errors();
  out.files = expanded.files;
  return out;
}

RobotDescription parse_urdf(const std::string& xml, const std::string& name, PackageResolver& resolver,
                            Diagnostics& diagnostics) {
  ExpandedDescription expanded;
  expanded.root = parse_xml(xml, name);
  expanded.file = name;
  RobotDescription robot = read_description(expanded, resolver, diagnostics);
  diagnostics.throw_if_errors();
  return robot;
}

std::vector<XacroArgumentDeclaration> declared_xacro_arguments(const fs::path& file,
                                                               const PackageResolver& resolver) {
  std::vector<XacroArgumentDeclaration> out;
  std::vector<fs::path> queue{file};
  std::set<fs::path> seen;
  while (!queue.empty()) {
    const fs::path next = queue.back();
    queue.pop_back();
    std::error_code none;
    if (!seen.insert(next.lexically_normal()).second || !fs::is_regular_file(next, none)) continue;
    try {
      const XmlNode root = load_xml(next.string());
      collect_arguments(root, out);
      collect_included(root, next.parent_path(), resolver, queue);
    } catch (const InputError&) {
      continue;  // reported by the expansion
    }
  }
  return out;
}

}  // namespace doppel
