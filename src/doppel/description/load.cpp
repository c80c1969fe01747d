#include "doppel/description/load.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "doppel/core/names.h"
#include "doppel/description/urdf_parser.h"
#include "doppel/description/xacro.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

void report_unknown_arguments(const XacroArguments& arguments, const XacroResult& expansion,
                              const SourceLocation& root, Diagnostics& diagnostics) {
  std::set<std::string> known(expansion.declared_arguments.begin(), expansion.declared_arguments.end());
  known.insert(expansion.used_arguments.begin(), expansion.used_arguments.end());
  const std::vector<std::string> names(known.begin(), known.end());
  for (const auto& [name, value] : arguments) {
    if (known.contains(name)) continue;
    diagnostics.warning("xacro.unknown_argument", root,
                        fmt::format("the argument '{}' is given, but nothing asks for it{}", name,
                                    did_you_mean(name, names)));
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

// The files that <xacro:include> names without needing any evaluation but $(find ...).
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
  XmlTree tree = load_xml_tree(file.string(), XmlKeep::content);
  XacroResult expansion;
  // A .xacro goes through xacro in every launch file, whether it declares the prefix or not.
  if (file.extension() == ".xacro" || needs_xacro(tree)) {
    out.was_xacro = true;
    expansion = expand_xacro(std::move(tree), file, arguments, resolver, diagnostics);
    tree = std::move(expansion.tree);
    out.files = std::move(expansion.files);
  } else {
    out.files = {file};
  }
  out.root = tree.node();
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
      continue;  // the expansion itself will tell
    }
  }
  return out;
}

}  // namespace doppel
