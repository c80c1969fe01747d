#include "doppel/scenario/launch/read_launch.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "doppel/base/core/names.h"
#include "doppel/base/core/shown_path.h"
#include "doppel/scenario/launch/detail/launch_json.h"
#include "doppel/scenario/launch/detail/launch_reader.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

bool is_launch_file(const fs::path& path) {
  const std::string name = path.filename().string();
  for (const char* end : {".launch.py", ".launch.xml", ".launch.yaml", ".launch.yml", ".launch", "_launch.py",
                          "launch.py", "_launch.xml", "_launch.yaml"}) {
    if (name.ends_with(end)) return true;
  }
  return false;
}

std::vector<std::string> launch_files_of(const fs::path& package) {
  std::vector<std::string> out;
  std::error_code error;
  fs::recursive_directory_iterator entry(package, fs::directory_options::skip_permission_denied, error);
  for (; !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    constexpr int kMaxDepth = 4;
    if (entry.depth() > kMaxDepth) entry.disable_recursion_pending();
    const bool below_launch = entry->path().parent_path().filename() == "launch";
    if (is_launch_file(entry->path()) || (below_launch && entry->path().extension() == ".py"))
      out.push_back(fs::relative(entry->path(), package).string());
  }
  std::sort(out.begin(), out.end());
  return out;
}

[[noreturn]] void refuse_file_of_package(const std::string& package, const std::string& file,
                                         const fs::path& folder) {
  std::vector<std::string> names;
  for (const std::string& one : launch_files_of(folder)) names.push_back(fs::path(one).filename().string());
  throw InputError(
      "launch.no_file", {},
      fmt::format("the package '{}' has no launch file '{}'{}", package, file, did_you_mean(file, names)),
      names.empty() ? "name the file by its path"
                    : fmt::format("its launch files: {}", fmt::join(names, ", ")));
}

// Runs the reader and answers its requests; returns its result.
Json converse(const fs::path& file, const NamedTexts& arguments, PackageResolver& resolver,
              const fs::path& folder) {
  std::vector<std::string> words = {file.string()};
  for (const auto& [name, value] : arguments) words.push_back(name + ":=" + value);
  LaunchReader reader(std::move(words), resolver, folder, nullptr);
  Json result = reader.next();
  if (result.is_discarded()) {
    throw InputError("launch.unreadable", make_location(file.string()),
                     "the launch file ended its reader before it was read",
                     "its own output is above; a launch file may not call exit()");
  }
  return result;
}

void check_arguments(const NamedTexts& arguments, const LaunchDescription& description,
                     const fs::path& file) {
  std::vector<std::string> names;
  for (const LaunchArgument& argument : description.arguments) names.push_back(argument.name);
  for (const auto& [name, value] : arguments) {
    if (std::find(names.begin(), names.end(), name) != names.end()) continue;
    throw InputError("launch.argument", make_location(file.string()),
                     fmt::format("the launch file has no argument '{}'{}", name, did_you_mean(name, names)),
                     fmt::format("'doppel launch {} --show-args' lists them", shown_path(file)));
  }
}

}  // namespace

fs::path find_launch_file(const std::string& word, const std::string& file, PackageResolver& resolver) {
  std::error_code error;
  if (file.empty()) {
    const fs::path path = fs::absolute(word);
    if (fs::is_regular_file(path, error)) return path;
    if (fs::is_directory(path, error)) {
      const std::vector<std::string> files = launch_files_of(path);
      if (files.size() == 1) return path / files.front();
      throw InputError(
          "launch.no_file", {},
          files.empty() ? fmt::format("'{}' contains no launch file", word)
                        : fmt::format("'{}' contains {} launch files", word, files.size()),
          files.empty() ? "name a launch file" : fmt::format("name one: {}", fmt::join(files, ", ")));
    }
    throw InputError("launch.no_file", {}, fmt::format("there is no launch file '{}'", word),
                     "name a launch file, or a package and a launch file: doppel launch PACKAGE FILE");
  }
  resolver.add_context(fs::current_path());
  const PackageResolver::Resolved package = resolver.find_package(word);
  if (package.path.empty()) {
    const fs::path path = fs::absolute(word);
    if (!fs::is_directory(path, error)) {
      const std::vector<std::string> names = resolver.package_names();
      throw InputError(
          "launch.no_package", {},
          fmt::format("there is no package '{}' around this folder{}", word, did_you_mean(word, names)),
          "start it in the workspace, or name the launch file by its path");
    }
    resolver.add_context(path);
  }
  const fs::path folder = package.path.empty() ? fs::absolute(word) : package.path;
  for (const std::string& one : launch_files_of(folder)) {
    if (fs::path(one).filename() == file || one == file) return folder / one;
  }
  refuse_file_of_package(word, file, folder);
}

LaunchDescription read_launch(const fs::path& file, const NamedTexts& arguments, PackageResolver& resolver,
                              const fs::path& folder) {
  resolver.add_context(file);
  const Json result = converse(file, arguments, resolver, folder);
  if (const auto error = result.find("error"); error != result.end()) {
    throw InputError("launch.invalid", launch_place(*error), error->value("text", ""),
                     error->value("fix", ""));
  }
  LaunchDescription out = launch_from_json(result);
  check_arguments(arguments, out, file);
  return out;
}

}  // namespace doppel
