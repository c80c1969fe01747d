#include "doppel/twin/spawn/entity_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "doppel/base/core/path_below.h"
#include "doppel/base/core/read_file.h"
#include "doppel/base/core/text.h"
#include "doppel/base/packages/package_folder.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMaxMeshBytes = std::uintmax_t{16} << 20;
constexpr const char* kRule = "entity.mesh";

bool is_mesh_name(const fs::path& file) {
  const std::string end = lowered(file.extension().string());
  constexpr std::array kKnown{".stl", ".obj", ".dae"};
  return std::ranges::find(kKnown, end) != kKnown.end();
}

std::vector<fs::path> folders_of(const std::string& scheme, const std::string& rest,
                                 const PackageResolver& resolver, const Target& target) {
  if (scheme == "file") return {target.description.parent_path(), target.package_folder};
  // A folder that only has the name of a package may belong to any user: services can only use real packages.
  const fs::path folder = resolver.find_package(rest.substr(0, rest.find('/'))).path;
  return {is_package(folder) ? folder : fs::path()};
}

}  // namespace

fs::path package_above(const fs::path& file) {
  std::error_code none;
  for (fs::path at = file.parent_path(); at.has_relative_path(); at = at.parent_path()) {
    if (fs::is_regular_file(at / "package.xml", none)) return at;
  }
  return {};
}

fs::path find_entity_mesh(const std::string& uri, const PackageResolver& resolver, const Target& target) {
  const auto refuse = [&uri](const std::string& why) {
    return InputError(kRule, {}, fmt::format("the mesh '{}' {}", uri.substr(0, 200), why),
                      "use a mesh in the robot's packages, such as package://PACKAGE/meshes/part.stl");
  };
  const std::size_t colon = uri.find("://");
  const std::string scheme = uri.substr(0, colon == std::string::npos ? 0 : colon);
  if (scheme != "package" && scheme != "model" && scheme != "file")
    throw refuse("is neither package:// nor file://");
  if (uri.find('\0') != std::string::npos) throw refuse("has a NUL in its name");
  if (!is_mesh_name(uri)) throw refuse("is not a .stl, .obj or .dae file");

  std::error_code failed;
  const fs::path base = fs::absolute(target.description, failed).parent_path();
  const std::string rest = uri.substr(colon + 3);
  fs::path file = scheme == "file" ? fs::path(rest) : fs::path();
  if (file.is_relative() && scheme == "file") file = base / file;
  const std::vector<fs::path> folders = folders_of(scheme, rest, resolver, target);
  if (scheme != "file") {
    if (folders.front().empty()) throw refuse("is in a package that is not found");
    file = folders.front() / rest.substr(std::min(rest.size(), rest.find('/') + 1));
  }
  file = fs::absolute(file, failed).lexically_normal();
  // The name is checked before the disk is read, so that no response reveals which other files exist.
  const auto holds = [&file, &failed](const fs::path& folder) {
    return !folder.empty() && path_below(file, fs::absolute(folder, failed));
  };
  if (std::ranges::none_of(folders, holds)) throw refuse("is outside the robot's packages");
  const fs::path real = fs::canonical(file, failed);
  if (failed || !fs::is_regular_file(real, failed)) throw refuse("is not found");
  const auto really_holds = [&real](const fs::path& folder) {
    std::error_code gone;
    const fs::path canonical = folder.empty() ? folder : fs::canonical(folder, gone);
    return path_below(real, canonical).has_value();
  };
  if (std::ranges::none_of(folders, really_holds) && package_above(real).empty())
    throw refuse("is a symbolic link that points outside the robot's packages");
  if (!is_mesh_name(real)) throw refuse("is a symbolic link to a file that is not a .stl, .obj or .dae file");
  if (fs::file_size(real, failed) > kMaxMeshBytes || failed)
    throw refuse("is larger than 16 MB and would block the loop for too long");
  return real;
}

std::string read_entity_file(const std::string& file) {
  constexpr std::size_t kMaxBytes = std::size_t{4} << 20;
  const auto refuse = [&file](const std::string& why) {
    return InputError("entity.file", {}, fmt::format("the file '{}' {}", file.substr(0, 200), why),
                      "name an .sdf or .urdf file in a package, or send its text");
  };
  const fs::path path(file.starts_with("file://") ? file.substr(7) : file);
  const std::string end = lowered(path.extension().string());
  if (!path.is_absolute() || (end != ".sdf" && end != ".urdf" && end != ".model"))
    throw refuse("is not an absolute path of an .sdf, .model or .urdf file");
  std::error_code failed;
  const fs::path real = fs::canonical(path, failed);
  if (failed || !fs::is_regular_file(real, failed)) throw refuse("is not found");
  if (package_above(real).empty() && !fs::is_regular_file(real.parent_path() / "model.config", failed))
    throw refuse("is in no package and beside no model.config");
  return read_file(real.string(), kMaxBytes);
}

}  // namespace doppel
