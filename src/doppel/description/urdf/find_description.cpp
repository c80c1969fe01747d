// Resolves the argument of a verb to a file.
#include <fmt/format.h>

#include <algorithm>

#include "doppel/base/core/names.h"
#include "doppel/base/core/read_file.h"
#include "doppel/base/packages/package_folder.h"
#include "doppel/description/urdf/load.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxCandidateBytes = std::size_t{16} << 20;  // bytes; a larger file has to be named

fs::path package_of(const fs::path& description) {
  std::error_code none;
  return package_around(fs::absolute(description, none));
}

// True if a file is a complete description: a <robot> with a name, and a link, a macro call or an include. A
// pipe or an unreadable file is not.
bool stands_alone(const fs::path& file) {
  std::string xml;
  try {
    xml = read_file(file.string(), kMaxCandidateBytes);
  } catch (const InputError&) {
    return false;
  }
  const std::size_t robot = xml.find("<robot");
  if (robot == std::string::npos) return false;
  const std::size_t end = xml.find('>', robot);
  if (xml.substr(robot, end - robot).find(" name=") == std::string::npos) return false;
  return xml.find("<link") != std::string::npos || xml.find("xacro:include") != std::string::npos;
}

std::vector<fs::path> descriptions_in(const fs::path& package) {
  std::vector<fs::path> out;
  std::error_code none;
  for (const char* folder : {"urdf", "robots", "robot", "xacro", "description", "."}) {
    for (const auto& entry : fs::directory_iterator(package / folder, none)) {
      const fs::path extension = entry.path().extension();
      if ((extension == ".urdf" || extension == ".xacro") && stands_alone(entry.path()))
        out.push_back(entry.path());
    }
    if (!out.empty()) break;
  }
  std::sort(out.begin(), out.end());
  return out;
}

fs::path choose(const std::vector<fs::path>& found, const fs::path& folder) {
  if (found.size() == 1) return found.front();
  // A generated .urdf next to its .xacro is the same robot.
  std::vector<fs::path> sources;
  std::copy_if(found.begin(), found.end(), std::back_inserter(sources),
               [](const fs::path& p) { return p.extension() == ".xacro"; });
  if (sources.size() == 1) return sources.front();
  if (found.empty()) {
    throw InputError("up.no_description", make_location(folder.string()),
                     "there is no robot description in this folder",
                     "doppel searches urdf/, robots/, xacro/ and the folder itself for a .urdf or .xacro "
                     "with <robot name=...>");
  }
  std::string list;
  for (const fs::path& file : found) list += "\n    " + file.string();
  throw InputError("up.ambiguous_description", make_location(folder.string()),
                   fmt::format("the folder contains several robot descriptions:{}", list),
                   "give the path of one of them");
}

std::vector<fs::path> packages_of_workspace(const fs::path& folder) {
  std::vector<fs::path> out;
  std::error_code none;
  const fs::path source = fs::is_directory(folder / "src", none) ? folder / "src" : folder;
  auto walk = fs::recursive_directory_iterator(source, fs::directory_options::skip_permission_denied, none);
  for (; walk != fs::recursive_directory_iterator(); walk.increment(none)) {
    if (walk.depth() > 3 || walk->path().filename().string().starts_with('.'))
      walk.disable_recursion_pending();
    if (walk->is_directory(none) && is_package(walk->path())) {
      out.push_back(walk->path());
      walk.disable_recursion_pending();
    }
  }
  std::sort(out.begin(), out.end());
  return out;
}

Target from_folder(const fs::path& folder) {
  if (is_package(folder)) return {choose(descriptions_in(folder), folder), folder};
  std::vector<fs::path> found;
  for (const fs::path& package : packages_of_workspace(folder)) {
    const auto here = descriptions_in(package);
    found.insert(found.end(), here.begin(), here.end());
  }
  if (found.empty()) found = descriptions_in(folder);
  const fs::path description = choose(found, folder);
  return {description, package_of(description)};
}

[[noreturn]] void refuse(const std::string& target, const fs::path& bundled) {
  std::error_code unseen;
  if (fs::exists(target, unseen)) {
    throw InputError("up.unknown_target", {}, fmt::format("'{}' is neither a file nor a folder", target),
                     "write the description into a file: it is read more than once");
  }
  std::vector<std::string> names;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(bundled, none)) {
    if (is_package(entry.path())) names.push_back(entry.path().filename().string());
  }
  const fs::path path(target);
  const fs::path folder = path.parent_path().empty() ? fs::path(".") : path.parent_path();
  if (!path.parent_path().empty()) names.clear();
  for (const auto& entry : fs::directory_iterator(folder, none))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  throw InputError("up.unknown_target", {},
                   fmt::format("'{}' is neither a bundled robot nor a file or folder{}", target,
                               did_you_mean(path.filename().string(), names)),
                   "'doppel robots' lists the bundled robots");
}

}  // namespace

Target resolve_target(const std::string& target, const fs::path& bundled_robots) {
  std::error_code none;
  const bool plain_name = target.find('/') == std::string::npos && !target.empty();
  if (plain_name && is_package(bundled_robots / target) && !fs::exists(target, none)) {
    return from_folder(bundled_robots / target);
  }
  if (fs::is_directory(target, none)) {
    const bool bundled = plain_name && is_package(bundled_robots / target) && !is_package(target);
    return from_folder(bundled ? bundled_robots / target : fs::path(target).lexically_normal());
  }
  if (fs::is_regular_file(target, none)) return {target, package_of(target)};
  // The robot's name finds the package that `doppel new` makes for it, and most others.
  if (const std::string package = target + "_description"; !target.empty() && is_package(package))
    return from_folder(fs::path(package).lexically_normal());
  refuse(target, bundled_robots);
}

}  // namespace doppel
