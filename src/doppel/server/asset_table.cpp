#include <algorithm>
#include <array>
#include <set>

#include "doppel/description/package_folder.h"
#include "doppel/description/package_resolver.h"
#include "doppel/server/asset_library.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 2> kPackageSchemes{"package://", "model://"};
constexpr std::string_view kFileScheme = "file://";

// "package://arm/" of "package://arm/meshes/a.stl"; "": it names no package.
std::string package_prefix(std::string_view uri) {
  for (const std::string_view scheme : kPackageSchemes) {
    if (!uri.starts_with(scheme)) continue;
    const std::size_t slash = uri.find('/', scheme.size());
    return slash == std::string_view::npos ? "" : std::string(uri.substr(0, slash + 1));
  }
  return "";
}

// The folder that `rest` begins in when it leads to `file`; empty: it leads out of it on the way.
fs::path without(const fs::path& file, const fs::path& rest) {
  const fs::path way = rest.lexically_normal();
  fs::path folder = file;
  for (auto part = way.begin(); part != way.end(); ++part) folder = folder.parent_path();
  return (folder / way).lexically_normal() == file && (way.empty() || *way.begin() != "..") ? folder
                                                                                            : fs::path();
}

// Without a package the description's folder holds all that belongs to it; or the one above, where the
// description lies in one of the folders that are called so beside meshes/.
fs::path folder_around(const fs::path& description) {
  const fs::path folder = description.parent_path();
  const std::set<std::string> inner{"urdf", "xacro", "robots"};
  return inner.contains(folder.filename().string()) ? folder.parent_path() : folder;
}

}  // namespace

RobotFiles files_of(const RobotDescription& robot) {
  RobotFiles out;
  std::error_code none;
  if (robot.source.file) out.description = fs::absolute(*robot.source.file, none).lexically_normal();
  const auto add = [&out](const Geometry& geometry) {
    const auto* mesh = std::get_if<MeshGeometry>(&geometry);
    if (mesh != nullptr && !mesh->path.empty())
      out.meshes.emplace_back(mesh->uri, fs::path(mesh->path).lexically_normal());
  };
  for (const Link& link : robot.links) {
    for (const Visual& visual : link.visuals) {
      add(visual.geometry);
      if (visual.material && !visual.material->texture.empty())
        out.textures.push_back(visual.material->texture);
    }
    for (const Collision& collision : link.collisions) add(collision.geometry);
  }
  return out;
}

AssetTable make_asset_table(const RobotFiles& files) {
  AssetTable out;
  PackageResolver resolver;
  resolver.add_context(files.description);
  std::set<std::string> known;
  std::set<std::pair<std::string, fs::path>> folders;
  const auto add = [&](const std::string& uri, const fs::path& file) {
    if (!known.insert(uri).second) return;
    fs::path root;
    if (const std::string prefix = package_prefix(uri); !prefix.empty()) {
      root = without(file, uri.substr(prefix.size()));
      if (!root.empty()) folders.insert({prefix, root});
    } else {
      root = package_around(file);
      if (root.empty()) root = folder_around(files.description);
      const bool absolute = uri.starts_with(kFileScheme) || uri.starts_with('/');
      if (uri.starts_with(kFileScheme)) folders.insert({std::string(kFileScheme), "/"});
      if (!absolute) folders.insert({"", files.description.parent_path()});
    }
    out.assets.push_back({uri, file, root});
  };
  for (const auto& [uri, file] : files.meshes) add(uri, file);
  for (const std::string& uri : files.textures) {
    const auto found = resolver.resolve(uri, files.description.parent_path());
    if (!found.path.empty()) add(uri, found.path);
  }
  out.folders.assign(folders.begin(), folders.end());
  return out;
}

}  // namespace doppel
