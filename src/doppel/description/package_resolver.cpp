#include "doppel/description/package_resolver.h"

#include <algorithm>
#include <cstdlib>
#include <sstream>

#include "doppel/core/names.h"
#include "doppel/description/package_folder.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> folders_of_variable(const char* variable, const char* below) {
  std::vector<fs::path> out;
  const char* value = std::getenv(variable);
  std::istringstream list(value == nullptr ? "" : value);
  for (std::string entry; std::getline(list, entry, ':');) {
    if (!entry.empty()) out.push_back(below == nullptr ? fs::path(entry) : fs::path(entry) / below);
  }
  return out;
}

// `name` as a package in `folder`: the folder itself, or one directly below it.
fs::path package_in(const fs::path& folder, const std::string& name) {
  std::error_code none;
  if (is_package(folder) && package_name(folder) == name) return folder;
  if (is_package(folder / name) && package_name(folder / name) == name) return folder / name;
  for (const auto& entry : fs::directory_iterator(folder, none)) {
    if (entry.is_directory(none) && is_package(entry.path()) && package_name(entry.path()) == name)
      return entry.path();
  }
  return fs::is_directory(folder / name, none) && is_package(folder / name) ? folder / name : fs::path();
}

std::string nearest_in(const fs::path& wanted) {
  std::error_code none;
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(wanted.parent_path(), none))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  const auto near = nearest_name(wanted.filename().string(), names);
  return near ? (wanted.parent_path() / *near).string() : "";
}

}  // namespace

PackageResolver::PackageResolver() = default;

void PackageResolver::add_package(std::string name, fs::path folder) {
  packages_[std::move(name)] = std::move(folder);
  cache_.clear();
}

void PackageResolver::add_context(const fs::path& file_or_folder) {
  std::error_code none;
  const fs::path absolute = fs::absolute(file_or_folder, none).lexically_normal();
  contexts_.push_back(fs::is_directory(absolute, none) ? absolute : absolute.parent_path());
  cache_.clear();
}

void PackageResolver::add_bundled(const fs::path& robots_folder) {
  bundled_.push_back(robots_folder);
  cache_.clear();
}

PackageResolver::Resolved PackageResolver::find_package(const std::string& name) const {
  Resolved out;
  if (const auto given = packages_.find(name); given != packages_.end()) {
    out.path = given->second;
    return out;
  }
  if (const auto known = cache_.find(name); known != cache_.end()) {
    out.path = known->second;
    return out;
  }
  const auto look = [&](const fs::path& folder) {
    if (!out.path.empty()) return;
    out.tried.push_back(folder.string());
    out.path = package_in(folder, name);
  };
  for (const fs::path& context : contexts_) {
    for (fs::path at = context; at.has_relative_path() && out.path.empty(); at = at.parent_path()) {
      if (is_package(at)) {
        if (package_name(at) == name) out.path = at;
        look(at.parent_path());
      }
      std::error_code none;
      for (const char* below : {"src", "install/share", "share"}) {
        if (out.path.empty() && fs::is_directory(at / below, none)) look(at / below);
      }
      if (out.path.empty() && fs::is_directory(at / "install" / name / "share" / name, none)) {
        out.path = at / "install" / name / "share" / name;
      }
    }
  }
  for (const auto& [variable, below] :
       {std::pair{"ROS_PACKAGE_PATH", static_cast<const char*>(nullptr)},
        std::pair{"AMENT_PREFIX_PATH", "share"}, std::pair{"COLCON_PREFIX_PATH", "share"},
        std::pair{"GZ_SIM_RESOURCE_PATH", static_cast<const char*>(nullptr)},
        std::pair{"GAZEBO_MODEL_PATH", static_cast<const char*>(nullptr)}}) {
    for (const fs::path& folder : folders_of_variable(variable, below)) look(folder);
  }
  for (const fs::path& folder : bundled_) look(folder);
  if (!out.path.empty()) {
    cache_[name] = out.path;
  } else if (const auto near = nearest_name(name, package_names())) {
    out.nearest = *near;
  }
  return out;
}

PackageResolver::Resolved PackageResolver::resolve(const std::string& uri, const fs::path& base) const {
  Resolved out;
  std::error_code none;
  const auto take = [&](const fs::path& candidate) {
    out.tried.push_back(candidate.lexically_normal().string());
    if (fs::exists(candidate, none)) out.path = candidate.lexically_normal();
    return !out.path.empty();
  };
  const std::size_t scheme = uri.find("://");
  if (scheme == std::string::npos) {
    fs::path candidate = uri;
    if (candidate.is_relative()) candidate = base / uri;
    if (!take(candidate)) out.nearest = nearest_in(candidate);
    return out;
  }
  const std::string kind = uri.substr(0, scheme), rest = uri.substr(scheme + 3);
  if (kind == "file") {
    if (!take(rest.starts_with('/') ? fs::path(rest) : base / rest)) out.nearest = nearest_in(rest);
    return out;
  }
  if (kind != "package" && kind != "model") {
    out.tried.push_back("'" + kind + "://' is none of package://, model://, file://");
    return out;
  }
  const std::size_t slash = rest.find('/');
  const std::string name = rest.substr(0, slash);
  const Resolved package = find_package(name);
  if (package.path.empty()) {
    out.tried = package.tried;
    out.tried.push_back("(no package '" + name + "')");
    out.nearest = package.nearest;
    return out;
  }
  const fs::path candidate =
      slash == std::string::npos ? package.path : package.path / rest.substr(slash + 1);
  if (!take(candidate)) out.nearest = nearest_in(candidate);
  return out;
}

std::vector<std::string> PackageResolver::package_names() const {
  std::vector<std::string> out;
  for (const auto& [name, folder] : packages_) out.push_back(name);
  std::error_code none;
  const auto list = [&](const fs::path& folder) {
    for (const auto& entry : fs::directory_iterator(folder, none)) {
      if (entry.is_directory(none) && is_package(entry.path())) out.push_back(package_name(entry.path()));
    }
  };
  for (const fs::path& context : contexts_) {
    for (fs::path at = context; at.has_relative_path(); at = at.parent_path()) {
      if (is_package(at)) list(at.parent_path());
    }
  }
  for (const fs::path& folder : bundled_) list(folder);
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

}  // namespace doppel
