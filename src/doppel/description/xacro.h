#pragma once
// The xacro expander: properties, macros, conditions, includes and substitutions over a tree whose nodes keep
// their places. The tree goes straight to the URDF parser; only /robot_description needs it as text. Source:
// ros/xacro's documentation (ROS 2 branch).

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "doppel/core/diagnostic.h"
#include "doppel/description/package_resolver.h"
#include "doppel/description/xml.h"

namespace doppel {

struct XacroResult {
  XmlNode root;
  std::vector<std::filesystem::path> files;     // every file that was read
  std::vector<std::string> declared_arguments;  // names of <xacro:arg>
  std::vector<std::string> used_arguments;      // names that $(arg ...) asked for
};

// Throws InputError with the place through macros and includes. Bounded in depth, steps and size: a macro
// that calls itself for ever is an error, soon.
XacroResult expand_xacro(const std::filesystem::path& file,
                         const std::vector<std::pair<std::string, std::string>>& arguments,
                         const PackageResolver& resolver, Diagnostics& diagnostics);
// The same for a tree that was read already.
XacroResult expand_xacro(XmlNode root, const std::filesystem::path& file,
                         const std::vector<std::pair<std::string, std::string>>& arguments,
                         const PackageResolver& resolver, Diagnostics& diagnostics);

// Whether the tree holds anything for xacro to do.
bool needs_xacro(const XmlNode& root);

}  // namespace doppel
