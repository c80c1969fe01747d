#include "doppel/scenario/launch/read_launch.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <nlohmann/json.hpp>
#include <system_error>

#include "doppel/base/core/child_process.h"
#include "doppel/base/core/installation.h"
#include "doppel/base/core/names.h"
#include "doppel/base/core/shown_path.h"
#include "doppel/base/packages/package_folder.h"
#include "doppel/description/xacro/xacro.h"
#include "doppel/scenario/launch/detail/installed_view.h"
#include "doppel/scenario/launch/detail/launch_json.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr std::size_t kMaxLine = 256U
                                 << 20;  // of the reader's answers; a description with its text is some MB

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

// One line of a pipe; empty: its end.
class LineReader {
 public:
  explicit LineReader(int fd) : fd_(fd) {}
  std::string next() {
    while (true) {
      const std::size_t end = buffer_.find('\n', searched_);
      if (end != std::string::npos) {
        std::string line = buffer_.substr(0, end);
        buffer_.erase(0, end + 1);
        searched_ = 0;
        return line;
      }
      searched_ = buffer_.size();
      std::array<char, 65536> part{};
      const ssize_t size = read(fd_, part.data(), part.size());
      if (size < 0 && errno == EINTR) continue;
      if (size <= 0 || buffer_.size() > kMaxLine) return "";
      buffer_.append(part.data(), static_cast<std::size_t>(size));
    }
  }

 private:
  int fd_;
  std::string buffer_;
  std::size_t searched_ = 0;
};

bool write_line(int fd, const std::string& line) {
  const std::string text = line + "\n";
  std::size_t written = 0;
  while (written < text.size()) {
    const ssize_t size = write(fd, text.data() + written, text.size() - written);
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) return false;
    written += static_cast<std::size_t>(size);
  }
  return true;
}

// Packages that xacro's own $(find ...) would find in another layout than that of their installation.
void add_views(const fs::path& file, PackageResolver& resolver, const fs::path& folder) {
  const fs::path package = package_around(fs::weakly_canonical(file));
  if (package.empty()) return;
  const std::string name = package_name(package);
  const fs::path view = installed_view(package, name, folder);
  if (!view.empty()) resolver.add_package(name, view);
}

Json answer_xacro(const Json& request, PackageResolver& resolver, const fs::path& folder) {
  const fs::path file = request.at("xacro").get<std::string>();
  try {
    XacroArguments arguments;
    for (const Json& pair : request.at("arguments"))
      arguments.emplace_back(pair.at(0).get<std::string>(), pair.at(1).get<std::string>());
    resolver.add_context(file);
    add_views(file, resolver, folder);
    Diagnostics diagnostics;  // printed when the robot is loaded
    const XacroResult result = expand_xacro(file, arguments, resolver, diagnostics);
    // A file of a view is read from a folder that ends with the launch; its text is kept instead.
    const bool viewed = std::any_of(result.files.begin(), result.files.end(), [&](const fs::path& one) {
      return one.string().starts_with((folder / "share").string());
    });
    return {{"text", xacro_text(result.tree, file.string())}, {"source", viewed ? "" : file.string()}};
  } catch (const InputError& error) {
    return {{"error", error.what()}};
  }
}

// The share folder of a package, which is that of its source where the layout is the same.
Json answer_package(const std::string& name, PackageResolver& resolver, const fs::path& folder) {
  const fs::path source = resolver.find_package(name).path;
  const fs::path view = source.empty() ? fs::path() : installed_view(source, name, folder);
  if (!view.empty()) resolver.add_package(name, view);
  return {{"folder", (view.empty() ? source : view).string()}};
}

Json answer(const Json& request, PackageResolver& resolver, const fs::path& folder) {
  if (request.contains("package"))
    return answer_package(request.at("package").get<std::string>(), resolver, folder);
  if (request.contains("xacro")) return answer_xacro(request, resolver, folder);
  return Json::object();
}

[[noreturn]] void refuse_without_python(const std::string& reason) {
  throw InputError("launch.python", {},
                   fmt::format("launch files in Python need python3, which cannot be started: {}", reason),
                   "apt-get install python3 python3-yaml, or start the robot itself: doppel up TARGET");
}

// Runs the reader and answers its requests; returns its result.
Json converse(const fs::path& file, const NamedTexts& arguments, PackageResolver& resolver,
              const fs::path& folder) {
  // The system's Python has PyYAML and the packages of ROS; one of an environment in PATH has its own.
  const bool of_system = access("/usr/bin/python3", X_OK) == 0;
  const fs::path reader = data_folder() / "python" / "launch_reader" / "read_launch_file.py";
  ChildStart start{
      .words = {of_system ? "/usr/bin/python3" : "python3", "-B", reader.string(), file.string()},
      .environment = {{"DOPPEL_LAUNCH_PIPES", "3,4"}, {"DOPPEL_LAUNCH_FOLDER", folder.string()}},
      .converses = true,
      .own_group = false};
  for (const auto& [name, value] : arguments) start.words.push_back(name + ":=" + value);
  std::optional<ChildProcess> python;
  try {
    python.emplace(start);
  } catch (const std::system_error& error) {
    refuse_without_python(error.code().message());
  }
  LineReader lines(python->requests());
  while (true) {
    const std::string line = lines.next();
    const Json request = Json::parse(line, nullptr, false);
    if (request.is_discarded()) {
      throw InputError("launch.unreadable", make_location(file.string()),
                       "the launch file ended its reader before it was read",
                       "its own output is above; a launch file may not call exit()");
    }
    if (request.contains("result")) return request.at("result");
    if (!write_line(python->answers(), answer(request, resolver, folder).dump())) return {};
  }
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
