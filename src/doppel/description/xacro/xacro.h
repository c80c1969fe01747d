#pragma once
// The xacro expander: properties, macros, conditions, includes and substitutions over a tree whose nodes keep
// their places. The tree is passed directly to the URDF parser; `doppel xacro` writes it as ros/xacro does.
// Any thread, with its own PackageResolver. Source: ros/xacro's documentation and behaviour (ROS 2 branch).

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/packages/package_resolver.h"
#include "doppel/base/xml/xml_tree.h"
#include "doppel/export.h"

namespace doppel {

struct XacroResult {
  XmlTree tree;
  std::vector<std::filesystem::path> files;     // all files read, in order
  std::vector<std::string> declared_arguments;  // names of <xacro:arg>
  std::vector<std::string> used_arguments;      // names in $(arg ...)
};

// Throws InputError with the place, including macros and includes. Depth, steps and size are bounded, so that
// endless recursion of a macro is an error after a short time. Included files are read like `source`: with
// XmlContent::everything, comments and blank text are kept as in ros/xacro.
DOPPEL_API XacroResult expand_xacro(XmlTree source, const std::filesystem::path& file,
                                    const std::vector<std::pair<std::string, std::string>>& arguments,
                                    const PackageResolver& resolver, Diagnostics& diagnostics);
// Reads the file's content first.
DOPPEL_API XacroResult expand_xacro(const std::filesystem::path& file,
                                    const std::vector<std::pair<std::string, std::string>>& arguments,
                                    const PackageResolver& resolver, Diagnostics& diagnostics);

// True if the tree needs expansion: it has an element or the namespace of xacro, ${...} or $(...).
DOPPEL_API bool needs_xacro(const XmlTree& tree);

// The same text as ros/xacro writes: its layout, its order of attributes, its banner with `input` as the
// user named it.
DOPPEL_API std::string xacro_text(const XmlTree& expanded, const std::string& input);

}  // namespace doppel
