#include "doppel/scenario/launch/detail/own_programs.h"

#include <fmt/format.h>

#include "doppel/base/core/child_process.h"
#include "doppel/base/core/output_file.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

// install/NAME/lib/NAME and install/lib/NAME of the workspaces around a package, and devel/ of ROS 1.
std::vector<fs::path> folders_of_executables(const fs::path& package, const std::string& name) {
  std::vector<fs::path> out;
  if (package.parent_path().filename() == "share")
    out.push_back(package.parent_path().parent_path() / "lib" / name);
  for (fs::path above = package; above.has_relative_path(); above = above.parent_path()) {
    out.push_back(above / "install" / name / "lib" / name);
    out.push_back(above / "install" / "lib" / name);
    out.push_back(above / "devel" / "lib" / name);
  }
  for (const char* part : {"scripts", "nodes", "bin", "src", "script"}) out.push_back(package / part);
  out.push_back(package / name);
  return out;
}

// The words that start a file: a script without the permission is Python's.
std::vector<std::string> words_of(const fs::path& file) {
  if (is_program(file)) return {file.string()};
  return {"python3", file.string()};
}

std::vector<std::string> find_executable(const fs::path& package, const std::string& name,
                                         const std::string& executable) {
  std::error_code error;
  for (const fs::path& folder : folders_of_executables(package, name)) {
    if (is_program(folder / executable)) return {(folder / executable).string()};
    for (const fs::path& script : {folder / executable, folder / (executable + ".py")}) {
      if (script.extension() == ".py" && fs::is_regular_file(script, error)) return words_of(script);
    }
  }
  return {};
}

std::string yaml_file_of(const LaunchRecord& node, const LaunchParameters& set, const fs::path& folder,
                         std::size_t number) {
  const fs::path file = folder / fmt::format("parameters_{}_{}.yaml", node.id, number);
  std::string text = "/**:\n  ros__parameters:\n";
  for (const auto& [name, value] : set.values) text += fmt::format("    {}: {}\n", name, value);
  write_whole(file, text);
  return file.string();
}

void add_ros_arguments(const LaunchRecord& node, const fs::path& folder, std::vector<std::string>& words) {
  std::vector<std::string> options;
  const auto add = [&](const char* flag, std::string value) {
    options.emplace_back(flag);
    options.push_back(std::move(value));
  };
  if (!node.name.empty()) add("-r", "__node:=" + node.name);
  if (!node.name_space.empty()) add("-r", "__ns:=/" + bare_namespace(node.name_space));
  for (const auto& [from, to] : node.remappings) add("-r", fmt::format("{}:={}", from, to));
  for (std::size_t i = 0; i < node.parameters.size(); ++i) {
    const LaunchParameters& set = node.parameters[i];
    if (!set.file.empty()) add("--params-file", set.file.string());
    if (!set.values.empty()) add("--params-file", yaml_file_of(node, set, folder, i));
  }
  if (options.empty()) return;
  words.emplace_back("--ros-args");
  words.insert(words.end(), options.begin(), options.end());
}

}  // namespace

OwnProgram own_program(const LaunchRecord& node, const PackageResolver& resolver, const fs::path& folder) {
  OwnProgram out;
  const std::string shown = fmt::format("{} {}", node.package, node.executable);
  if (node.ros1) {
    out.problem = fmt::format("'{}' is a node of ROS 1, which has no master here; it is not started", shown);
    return out;
  }
  const fs::path package = node.package.empty() ? fs::path() : resolver.find_package(node.package).path;
  std::vector<std::string> words;
  if (!package.empty()) words = find_executable(package, node.package, node.executable);
  if (words.empty() && node.package.empty()) {
    const fs::path program = find_program(node.executable);
    if (!program.empty()) words = {program.string()};
  }
  if (words.empty()) {
    out.problem = package.empty()
                      ? fmt::format("the package '{}' is not on this machine; '{}' is not started",
                                    node.package, node.executable)
                      : fmt::format("'{}' is not built; it is not started", shown);
    out.fix = package.empty() ? "" : fmt::format("colcon build --packages-select {}", node.package);
    return out;
  }
  words.insert(words.end(), node.words.begin(), node.words.end());
  add_ros_arguments(node, folder, words);
  out.start = {.label = node.name.empty() ? node.executable : node.name,
               .words = std::move(words),
               .folder = node.folder,
               .environment = node.environment};
  return out;
}

OwnProgram own_command(const LaunchRecord& process, const std::vector<std::string>& words) {
  OwnProgram out;
  const std::string& program = words.front();
  if (find_program(program).empty()) {
    out.problem = fmt::format("there is no program '{}' on this machine; it is not started", program);
    return out;
  }
  out.start = {.label = process.name.empty() ? fs::path(program).filename().string() : process.name,
               .words = words,
               .folder = process.folder,
               .environment = process.environment};
  return out;
}

}  // namespace doppel
