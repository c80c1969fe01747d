#pragma once
// Where the files of SDF's URIs are: model://NAME/..., NAME, package://NAME/..., file://PATH, a path, and the URLs of
// Gazebo Fuel, which are searched in the local cache; nothing is fetched.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "doppel/base/packages/package_resolver.h"
#include "doppel/export.h"

namespace doppel {

struct FoundFile {
  std::filesystem::path path;      // a file or a folder; empty: not found
  std::vector<std::string> tried;  // the places searched, in order
};

class DOPPEL_API ModelSearch {
 public:
  // The search path: GZ_SIM_RESOURCE_PATH, IGN_GAZEBO_RESOURCE_PATH, SDF_PATH, GAZEBO_MODEL_PATH,
  // GAZEBO_RESOURCE_PATH, ~/.gazebo/models, and the caches of Fuel ~/.gz/fuel and ~/.ignition/fuel. `world`: the file
  // that is read; its folder, the `models` in it, and the folders above up to a ROS package or a repository come
  // first. Empty: none.
  ModelSearch(const std::filesystem::path& world, PackageResolver& resolver);

  // `folder`: of the file that contains the URI.
  [[nodiscard]] const FoundFile& find(const std::string& uri, const std::filesystem::path& folder);
  // The places in which a model's name is searched.
  [[nodiscard]] const std::vector<std::filesystem::path>& roots() const { return roots_; }

 private:
  [[nodiscard]] FoundFile search(const std::string& uri, const std::filesystem::path& folder) const;
  [[nodiscard]] FoundFile search_name(const std::string& name) const;
  [[nodiscard]] FoundFile search_fuel(const std::string& url) const;

  PackageResolver& resolver_;
  std::vector<std::filesystem::path> roots_, fuel_;
  std::map<std::string, FoundFile> known_;
};

// The SDF or URDF file of a model's folder: that of the newest version in its model.config, else model.sdf, else the
// only SDF file. Empty: none.
DOPPEL_API std::filesystem::path model_file(const std::filesystem::path& folder);

}  // namespace doppel
