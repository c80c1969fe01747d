#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>

#include "doppel/base/packages/package_folder.h"
#include "doppel/base/packages/package_resolver.h"
#include "doppel/ros/server/asset_library.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 2> kPackageSchemes{"package://", "model://"};
constexpr std::string_view kFileScheme = "file://";

// "package://arm/" of "package://arm/meshes/a.stl"; "": the URI has no package.
std::string package_prefix(std::string_view uri) {
  for (const std::string_view scheme : kPackageSchemes) {
    if (!uri.starts_with(scheme)) continue;
    const std::size_t slash = uri.find('/', scheme.size());
    return slash == std::string_view::npos ? "" : std::string(uri.substr(0, slash + 1));
  }
  return "";
}

// The folder from which `rest` leads to `file`; empty: `rest` leaves that folder on the way.
fs::path without(const fs::path& file, const fs::path& rest) {
  const fs::path way = rest.lexically_normal();
  fs::path folder = file;
  for (auto part = way.begin(); part != way.end(); ++part) folder = folder.parent_path();
  return (folder / way).lexically_normal() == file && (way.empty() || *way.begin() != "..") ? folder
                                                                                            : fs::path();
}

// Without a package, the files of a description (or world file) are in its folder, or in the one above if its
// folder has one of the usual names next to meshes/.
fs::path folder_around(const fs::path& description) {
  const fs::path folder = description.parent_path();
  const std::set<std::string> inner{"urdf", "xacro", "robots", "worlds"};
  return inner.contains(folder.filename().string()) ? folder.parent_path() : folder;
}

class TableMaker {
 public:
  explicit TableMaker(const RobotFiles& files) : files_(files) { resolver_.add_context(files.description); }

  AssetTable make() {
    for (const MeshFile& mesh : files_.meshes) add(mesh);
    const fs::path base = files_.description.parent_path();
    for (const std::string& uri : files_.textures) {
      if (const auto found = resolver_.resolve(uri, base); !found.path.empty()) add({uri, found.path});
    }
    if (const fs::path own = package_around(files_.description); !own.empty()) roots_.insert(own);
    for (const fs::path& root : roots_) {
      folders_.insert({std::string(kFileScheme), "/"});
      if (!is_package(root)) continue;
      for (const std::string_view scheme : kPackageSchemes)
        folders_.insert({fmt::format("{}{}/", scheme, package_name(root)), root});
    }
    table_.folders.assign(folders_.begin(), folders_.end());
    table_.roots.assign(roots_.begin(), roots_.end());
    table_.flat.assign(flat_.begin(), flat_.end());
    return std::move(table_);
  }

 private:
  void add(const MeshFile& mesh) {
    if (!known_.insert(mesh.uri).second) return;
    const fs::path root = root_of(mesh);
    if (!mesh.model.empty()) {
      // model://NAME/... is a file of the model's folder, in whichever folder of the search path that is.
      if (const std::string prefix = package_prefix(mesh.uri); !prefix.empty())
        folders_.insert({prefix, mesh.model});
      roots_.insert(mesh.model);
    }
    if (is_package(root)) {
      roots_.insert(root);
    } else if (const fs::path way = mesh.file.lexically_relative(root);
               !way.empty() && *way.begin() != "..") {
      // The folder of a description may contain unrelated files of its owner: only the folders of meshes and
      // their textures belong to the robot.
      for (const fs::path& folder : {mesh.file.parent_path(), root / "textures", root / "materials"})
        (folder == root ? flat_ : roots_).insert(folder);
    }
    table_.assets.push_back({mesh.uri, mesh.file, mesh.model.empty() ? root : mesh.model});
  }

  fs::path root_of(const MeshFile& mesh) {
    if (const std::string prefix = package_prefix(mesh.uri); !prefix.empty()) {
      fs::path root = without(mesh.file, mesh.uri.substr(prefix.size()));
      if (root.empty()) {  // the target of a link, or a file outside of its package
        const std::size_t name = prefix.find("://") + 3;
        root = resolver_.find_package(prefix.substr(name, prefix.size() - name - 1)).path;
      }
      if (!root.empty()) folders_.insert({prefix, root});
      return root;
    }
    const bool absolute = mesh.uri.starts_with(kFileScheme) || mesh.uri.starts_with('/');
    if (!absolute) folders_.insert({"", files_.description.parent_path()});
    const fs::path package = package_around(mesh.file);
    return package.empty() ? folder_around(mesh.named_in.empty() ? files_.description : mesh.named_in)
                           : package;
  }

  const RobotFiles& files_;
  PackageResolver resolver_;
  AssetTable table_;
  std::set<std::string> known_;
  std::set<std::pair<std::string, fs::path>> folders_;
  std::set<fs::path> roots_, flat_;
};

}  // namespace

AssetTable make_asset_table(const RobotFiles& files) {
  return TableMaker(files).make();
}

}  // namespace doppel
