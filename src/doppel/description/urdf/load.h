#pragma once
// From a file to a RobotDescription: expands xacro if necessary, parses, resolves every mesh. Any thread,
// with a PackageResolver of its own.

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/packages/package_resolver.h"
#include "doppel/base/xml/xml.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"

namespace doppel {

using XacroArguments = std::vector<std::pair<std::string, std::string>>;  // name := value, in order

// The result of the first half of loading. Overlays change the tree between the halves, and the audit needs
// the tree of a faulty robot.
struct DOPPEL_API ExpandedDescription {
  XmlNode root;                              // plain URDF; every node has its place in the source
  std::filesystem::path file;                // as given
  std::vector<std::filesystem::path> files;  // every file that was read, `file` first
  bool was_xacro = false;

  [[nodiscard]] std::filesystem::path folder() const { return std::filesystem::absolute(file).parent_path(); }
};

// Reads the file and expands xacro if necessary. Throws InputError: unreadable, XML not well-formed,
// a xacro error.
DOPPEL_API ExpandedDescription expand_description(const std::filesystem::path& file,
                                                  const XacroArguments& arguments, PackageResolver& resolver,
                                                  Diagnostics& diagnostics);

// Makes the typed tree and checks its structure. All diagnostics, including errors, go to `diagnostics`; with
// errors the result contains what could be read. Does not throw InputError.
DOPPEL_API RobotDescription read_description(const ExpandedDescription& expanded,
                                             const PackageResolver& resolver, Diagnostics& diagnostics);

struct LoadedDescription {
  RobotDescription robot;
  std::vector<std::filesystem::path> files;  // every file that was read (for reload on save)
};

// Both halves. Warnings and notes go to `diagnostics`. Throws InputError with every error found: XML not
// well-formed, xacro errors, two roots, loops, joints with unknown links, invalid numbers. A missing mesh is
// a warning ("mesh.missing", with the searched places and the nearest file); its path stays empty.
DOPPEL_API LoadedDescription load_description(const std::filesystem::path& file,
                                              const XacroArguments& arguments, PackageResolver& resolver,
                                              Diagnostics& diagnostics);

// The same for URDF text (no xacro). `name` is used as the file in messages.
DOPPEL_API RobotDescription parse_urdf(const std::string& xml, const std::string& name,
                                       PackageResolver& resolver, Diagnostics& diagnostics);

// An <xacro:arg> of a file, or of a file that it includes by a name without other substitutions
// than $(find ...).
struct XacroArgumentDeclaration {
  std::string name;
  std::string default_value;
  bool has_default = false;
  SourceLocation source;
};
DOPPEL_API std::vector<XacroArgumentDeclaration> declared_xacro_arguments(const std::filesystem::path& file,
                                                                          const PackageResolver& resolver);

// The argument of a verb, resolved: a bundled robot's name, a file, or the folder of a package or workspace.
struct Target {
  std::filesystem::path description;     // .urdf or .xacro
  std::filesystem::path package_folder;  // folder with package.xml; empty: none
};
// Throws InputError with the candidates if a folder has several descriptions or none, or with
// the nearest name.
DOPPEL_API Target resolve_target(const std::string& target, const std::filesystem::path& bundled_robots);

}  // namespace doppel
