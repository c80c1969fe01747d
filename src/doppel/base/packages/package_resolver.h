#pragma once
// Resolves `package://`, `model://`, `file://`, `$(find NAME)` and relative names to files. For one thread:
// it caches results.

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "doppel/base/packages/package_index.h"
#include "doppel/export.h"

namespace doppel {

class DOPPEL_API PackageResolver {
 public:
  // Search order for a package: those of add_package(); then, walking up from `add_context`'s files, folders
  // with a package.xml of that name (the ancestor itself, its siblings, src/, install/, share/); then the
  // whole workspaces or repositories around them, as colcon crawls them (package_index.h); then
  // ROS_PACKAGE_PATH (crawled, too), AMENT_PREFIX_PATH, COLCON_PREFIX_PATH, GZ_SIM_RESOURCE_PATH,
  // IGN_GAZEBO_RESOURCE_PATH, GAZEBO_MODEL_PATH; then ancestors and their siblings of that name without a
  // package.xml, as in downloaded collections, which may be called so by chance; last the robots bundled with
  // doppel.
  PackageResolver();

  void add_package(std::string name, std::filesystem::path folder);
  void add_context(const std::filesystem::path& file_or_folder);
  void add_bundled(const std::filesystem::path& robots_folder);

  struct Resolved {
    std::filesystem::path path;      // empty: not found
    std::vector<std::string> tried;  // the places searched, in order
    std::string nearest;             // a file or package with nearly this name; may be empty
  };
  [[nodiscard]] Resolved find_package(const std::string& name) const;
  // uri as in a URDF; `base` is the folder of the file that contains it. Does not throw if nothing is found.
  // Without a package (package:///part.stl, package://part.stl) the file is searched in `base`, and after an
  // empty name the first folder of the path can be the package.
  [[nodiscard]] Resolved resolve(const std::string& uri, const std::filesystem::path& base) const;
  [[nodiscard]] std::vector<std::string> package_names() const;

 private:
  struct Search;
  [[nodiscard]] Resolved search(const std::string& name) const;
  // The packages below a folder; crawled once.
  [[nodiscard]] const PackageIndex& index_of(const std::filesystem::path& root) const;

  std::map<std::string, std::filesystem::path> packages_;
  std::vector<std::filesystem::path> contexts_, bundled_;
  mutable std::map<std::string, Resolved> cache_;  // also packages that were not found
  mutable std::map<std::filesystem::path, PackageIndex> indices_;
};

}  // namespace doppel
