#pragma once
// The xacro expander: properties, macros, conditions, includes and substitutions over a tree whose nodes keep
// their places. The tree goes straight to the URDF parser; `doppel xacro` writes it as ros/xacro does.
// Source: ros/xacro's documentation and behaviour (ROS 2 branch).

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "doppel/core/diagnostic.h"
#include "doppel/export.h"
#include "doppel/packages/package_resolver.h"
#include "doppel/xml/xml_tree.h"

namespace doppel {

struct XacroResult {
  XmlTree tree;
  std::vector<std::filesystem::path> files;     // every file that was read, the first one first
  std::vector<std::string> declared_arguments;  // names of <xacro:arg>
  std::vector<std::string> used_arguments;      // names that $(arg ...) asked for
};

// Throws InputError with the place through macros and includes. Bounded in depth, steps and size: a macro
// that calls itself forever is an error, soon. Included files are read as `source` was: with
// XmlContent::everything comments and blank text stay as ros/xacro keeps them.
DOPPEL_API XacroResult expand_xacro(XmlTree source, const std::filesystem::path& file,
                                    const std::vector<std::pair<std::string, std::string>>& arguments,
                                    const PackageResolver& resolver, Diagnostics& diagnostics);
// Reads the file's content first.
DOPPEL_API XacroResult expand_xacro(const std::filesystem::path& file,
                                    const std::vector<std::pair<std::string, std::string>>& arguments,
                                    const PackageResolver& resolver, Diagnostics& diagnostics);

// Whether the tree holds anything for xacro to do: an element or namespace of it, ${...} or $(...).
DOPPEL_API bool needs_xacro(const XmlTree& tree);

// The text that ros/xacro writes for a document: its layout, its order of attributes, its banner, which names
// `input` as the user named it.
DOPPEL_API std::string xacro_text(const XmlTree& expanded, const std::string& input);

}  // namespace doppel
