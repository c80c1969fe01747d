#pragma once
// From a file to a RobotDescription: expands xacro where the file is one, parses, resolves every mesh.

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "doppel/core/diagnostic.h"
#include "doppel/description/robot_description.h"
#include "doppel/export.h"
#include "doppel/packages/package_resolver.h"
#include "doppel/xml/xml.h"

namespace doppel {

using XacroArguments = std::vector<std::pair<std::string, std::string>>;  // name := value, in order

// The two halves of loading, for those who look at the tree between them (overlays) or want a faulty robot
// whole (the audit).
struct DOPPEL_API ExpandedDescription {
  XmlNode root;                              // plain URDF; every node knows its place in the source
  std::filesystem::path file;                // as given
  std::vector<std::filesystem::path> files;  // every file that was read, `file` first
  bool was_xacro = false;

  [[nodiscard]] std::filesystem::path folder() const { return std::filesystem::absolute(file).parent_path(); }
};

// Reads the file and expands xacro where it is one. Throws InputError: unreadable, XML not well-formed, a
// xacro error.
DOPPEL_API ExpandedDescription expand_description(const std::filesystem::path& file,
                                                  const XacroArguments& arguments, PackageResolver& resolver,
                                                  Diagnostics& diagnostics);

// Makes the typed tree and judges its structure. Faults go to `diagnostics`, errors as well: the result then
// holds what could be read.
DOPPEL_API RobotDescription read_description(const ExpandedDescription& expanded,
                                             const PackageResolver& resolver, Diagnostics& diagnostics);

struct LoadedDescription {
  RobotDescription robot;
  std::vector<std::filesystem::path> files;  // every file that was read (for reload on save)
};

// Both halves. Warnings and notes go to `diagnostics`. Throws InputError with every error found: XML not
// well-formed, xacro errors, two roots, loops, joints that name links that do not exist, numbers that are
// none. A mesh that is missing is a warning ("mesh.missing", with what was tried and the nearest file); its
// path stays empty.
DOPPEL_API LoadedDescription load_description(const std::filesystem::path& file,
                                              const XacroArguments& arguments, PackageResolver& resolver,
                                              Diagnostics& diagnostics);

// The same for URDF text (no xacro). `name` stands for the file in messages.
DOPPEL_API RobotDescription parse_urdf(const std::string& xml, const std::string& name,
                                       PackageResolver& resolver, Diagnostics& diagnostics);

// An argument that a file, or a file it includes without a condition on anything but $(find ...), declares
// with <xacro:arg>.
struct XacroArgumentDeclaration {
  std::string name;
  std::string default_value;
  bool has_default = false;
  SourceLocation source;
};
DOPPEL_API std::vector<XacroArgumentDeclaration> declared_xacro_arguments(const std::filesystem::path& file,
                                                                          const PackageResolver& resolver);

// What `doppel up TARGET` was given: a bundled robot's name, a file, or the folder of a package or workspace.
struct Target {
  std::filesystem::path description;     // .urdf or .xacro
  std::filesystem::path package_folder;  // folder with package.xml; empty: none
};
// Throws InputError with the candidates where a folder holds several or no descriptions, or with the nearest
// name.
DOPPEL_API Target resolve_target(const std::string& target, const std::filesystem::path& bundled_robots);

}  // namespace doppel
