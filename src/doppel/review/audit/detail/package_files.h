#pragma once
// A ROS 2 package's own files, as far as they decide what is installed: package.xml, and the install rules of
// CMakeLists.txt or setup.py. Read as text, without running anything, in bounded steps; what this reader
// cannot evaluate counts as unknown. All throw InputError "audit.skipped" for a file that is not read.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "doppel/base/core/source_location.h"

namespace doppel {

struct PackageManifest {
  std::string name, version, build_type;
  std::vector<std::string> dependencies;  // needed at run time: depend, exec_depend, run_depend
  struct License {
    std::string text;
    SourceLocation source;
  };
  std::vector<License> licenses;
  std::vector<std::string> missing;  // required elements that are not there
  bool catkin = false;               // a package of ROS 1
  SourceLocation source, name_source;
};
// Throws InputError as well where it is not valid XML or has no <package>.
PackageManifest read_manifest(const std::filesystem::path& file);

struct InstalledPath {
  std::string from;      // below the package, '/' between; a folder, a file or a pattern with '*'
  bool pattern = false;  // `from` is one
  std::string to;        // below share/<package>; "." is its top
  SourceLocation source;
};

struct InstallRules {
  bool understood = true;  // false: this reader cannot evaluate all of it, so that no file counts as left out
  std::vector<InstalledPath> paths;
  std::string project;  // of project(...) or name=...
  SourceLocation source, project_source;
  std::string given_up;  // why the reader stopped before the end; empty: it did not
  SourceLocation given_up_source;
  // The path of the package's own file below share/<package>; nothing where it is not installed.
  [[nodiscard]] std::optional<std::string> installed(const std::string& file) const;
};
InstallRules read_cmake(const std::filesystem::path& file);
InstallRules read_setup_py(const std::filesystem::path& file);

}  // namespace doppel
