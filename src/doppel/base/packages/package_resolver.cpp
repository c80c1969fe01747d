#include "doppel/base/packages/package_resolver.h"

#include <algorithm>
#include <cstdlib>
#include <sstream>

#include "doppel/base/core/files_read.h"
#include "doppel/base/core/names.h"
#include "doppel/base/packages/package_folder.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> folders_of_variable(const char* variable) {
  std::vector<fs::path> out;
  const char* value = std::getenv(variable);
  std::istringstream list(value == nullptr ? "" : value);
  for (std::string entry; std::getline(list, entry, ':');) {
    if (!entry.empty()) out.emplace_back(entry);
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
  const fs::path context = fs::is_directory(absolute, none) ? absolute : absolute.parent_path();
  if (std::find(contexts_.begin(), contexts_.end(), context) != contexts_.end()) return;
  contexts_.push_back(context);
  cache_.clear();
}

void PackageResolver::add_bundled(const fs::path& robots_folder) {
  bundled_.push_back(robots_folder);
  cache_.clear();
}

const PackageIndex& PackageResolver::index_of(const fs::path& root) const {
  const auto known = indices_.find(root);
  return known != indices_.end() ? known->second : indices_.emplace(root, crawl_packages(root)).first->second;
}

// One search, from the nearest place to the farthest; each step does nothing once the package is found.
struct PackageResolver::Search {
  const PackageResolver& resolver;
  const std::string& name;
  Resolved out;

  [[nodiscard]] bool found() const { return !out.path.empty(); }

  // Each place once, because the ways up from two contexts meet.
  bool first_time(const std::string& place) {
    if (std::find(out.tried.begin(), out.tried.end(), place) != out.tried.end()) return false;
    out.tried.push_back(place);
    return true;
  }
  void look(const fs::path& folder) {
    if (found() || !first_time(folder.string())) return;
    out.path = package_in(folder, name);
  }
  void look_for_folder(const fs::path& folder) {
    std::error_code none;
    if (!found() && fs::is_directory(folder, none)) out.path = folder;
  }

  void near(const fs::path& context) {
    std::error_code none;
    for (fs::path at = context; at.has_relative_path() && !found(); at = at.parent_path()) {
      if (is_package(at)) {
        if (package_name(at) == name) out.path = at;
        look(at.parent_path());
      }
      for (const char* below : {"src", "install/share", "share"}) {
        if (fs::is_directory(at / below, none)) look(at / below);
      }
      look_for_folder(at / "install" / name / "share" / name);
    }
  }
  void crawled(const fs::path& root) {
    if (found() || !first_time(root.string() + " and below")) return;
    const PackageIndex& index = resolver.index_of(root);
    if (const auto here = index.packages.find(name); here != index.packages.end()) out.path = here->second;
  }
  // A folder that bears the name, or the package of that name in it, as in a repository named after its
  // package.
  void guess(const fs::path& folder) {
    std::error_code none;
    if (found() || !fs::is_directory(folder, none)) return;
    const PackageIndex& index = resolver.index_of(folder);
    const auto inside = index.packages.find(name);
    out.path = inside != index.packages.end() ? inside->second : folder;
  }
  void without_package_xml(const fs::path& context) {
    for (fs::path at = context; at.has_relative_path() && !found(); at = at.parent_path()) {
      if (at.filename() == name) guess(at);
      guess(at / name);
    }
    for (const fs::path& root : folders_to_crawl(context)) {
      if (found()) return;
      const PackageIndex& index = resolver.index_of(root);
      if (const auto here = index.folders.find(name); here != index.folders.end()) out.path = here->second;
    }
  }
  void environment() {
    for (const fs::path& folder : folders_of_variable("ROS_PACKAGE_PATH")) {
      look(folder);
      crawled(folder);
    }
    for (const char* variable : {"AMENT_PREFIX_PATH", "COLCON_PREFIX_PATH"}) {
      for (const fs::path& prefix : folders_of_variable(variable)) {
        look(prefix / "share");
        look_for_folder(prefix / name / "share" / name);
      }
    }
    for (const char* variable : {"GZ_SIM_RESOURCE_PATH", "IGN_GAZEBO_RESOURCE_PATH", "GAZEBO_MODEL_PATH"}) {
      for (const fs::path& folder : folders_of_variable(variable)) {
        look(folder);
        look_for_folder(folder / name);
      }
    }
  }
};

PackageResolver::Resolved PackageResolver::search(const std::string& name) const {
  Search search{*this, name, {}};
  for (const fs::path& context : contexts_) search.near(context);
  for (const fs::path& context : contexts_) {
    for (const fs::path& root : folders_to_crawl(context)) search.crawled(root);
  }
  search.environment();
  for (const fs::path& context : contexts_) search.without_package_xml(context);
  for (const fs::path& folder : bundled_) search.look(folder);
  if (!search.found()) {
    if (const auto near = nearest_name(name, package_names())) search.out.nearest = *near;
  }
  return std::move(search.out);
}

PackageResolver::Resolved PackageResolver::find_package(const std::string& name) const {
  if (const auto given = packages_.find(name); given != packages_.end()) return {given->second, {}, ""};
  // An empty name, or one with a slash or dots, would be a folder and no package.
  if (name.empty() || name == "." || name == ".." || name.find('/') != std::string::npos) return {};
  const auto known = cache_.find(name);
  return known != cache_.end() ? known->second : cache_.emplace(name, search(name)).first->second;
}

PackageResolver::Resolved PackageResolver::resolve(const std::string& uri, const fs::path& base) const {
  Resolved out;
  std::error_code none;
  const auto take = [&](const fs::path& candidate) {
    FilesRead::note(candidate);
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
    out.tried.push_back("'" + kind + "://' is not one of package://, model://, file://");
    return out;
  }
  const std::size_t slash = rest.find('/');
  const std::string name = rest.substr(0, slash);
  const Resolved package = find_package(name);
  if (package.path.empty()) {
    // Exporters write package:///part.stl and package://part.stl for files beside the description.
    const std::string file_name = rest.substr(std::min(rest.find_first_not_of('/'), rest.size()));
    const bool has_package = !name.empty() && slash != std::string::npos;
    if (!has_package && !file_name.empty() && take(base / file_name)) return out;
    if (name.empty() && file_name.find('/') != std::string::npos)
      return resolve(kind + "://" + file_name, base);
    out.tried.insert(out.tried.end(), package.tried.begin(), package.tried.end());
    out.tried.push_back("(no package '" + name + "')");
    out.nearest = package.nearest;
    return out;
  }
  const fs::path candidate =
      slash == std::string::npos ? package.path : package.path / rest.substr(slash + 1);
  if (take(candidate)) return out;
  out.nearest = nearest_in(candidate);
  // Another folder of that name around the robot may contain the file that the package lacks.
  if (slash == std::string::npos) return out;
  for (const fs::path& context : contexts_) {
    for (fs::path at = context; at.has_relative_path() && out.path.empty(); at = at.parent_path()) {
      const fs::path other = at / rest;
      if (fs::exists(other, none)) out.path = other.lexically_normal();
    }
  }
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
  for (const auto& [root, index] : indices_) {
    for (const auto& [name, folder] : index.packages) out.push_back(name);
  }
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

}  // namespace doppel
