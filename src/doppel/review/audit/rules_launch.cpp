// Launch files of the package, read as text: their arguments for xacro and for the spawner.
#include <algorithm>
#include <charconv>
#include <cmath>

#include "doppel/review/audit/detail/package_files.h"
#include "doppel/review/audit/detail/ros_rules.h"
#include "doppel/scenario/resolve/open_target.h"
#include "doppel/scenario/resolve/side_files.h"

namespace doppel::audit_rules {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxDependencies = 50;  // reported for one package

struct LaunchFile {
  SideFile file;
  std::string text;  // comments are blanks

  [[nodiscard]] SourceLocation place(std::size_t at) const { return file.place(at); }
  [[nodiscard]] bool says(std::string_view word) const { return text.find(word) != std::string::npos; }
  [[nodiscard]] bool simulates() const {
    return says("ros_gz_sim") || says("gz_sim") || says("gazebo_ros") || says("ros_ign") ||
           says("ign_gazebo") || says("spawn_entity");
  }
  [[nodiscard]] std::string subject() const {
    return fmt::format("launch file '{}'", file.path.filename().string());
  }
};

std::string blank_comments(std::string text) {
  char quote = 0;
  bool comment = false;
  for (char& c : text) {
    if (c == '\n') {
      comment = false;
      quote = 0;
    } else if (comment) {
      c = ' ';
    } else if (quote != 0) {
      if (c == quote) quote = 0;
    } else if (c == '\'' || c == '"') {
      quote = c;
    } else if (c == '#') {
      comment = true;
      c = ' ';
    }
  }
  return text;
}

std::vector<LaunchFile> launch_files(const fs::path& package, Findings& out) {
  std::vector<LaunchFile> files;
  Diagnostics skipped;
  for (const fs::path& path : side_files_of(package / "launch", {".py"}, skipped)) {
    try {
      SideFile file = read_side_file(path);
      std::string text = blank_comments(file.text);
      files.push_back({std::move(file), std::move(text)});
    } catch (const InputError& error) {
      report_skipped(error, out);
    }
  }
  report_skipped(skipped, out);
  return files;
}

bool fixed_to_world(const RobotDescription& robot) {
  const auto is_world = [](const Joint& joint) {
    return joint.parent == "world" && joint.type == JointType::fixed;
  };
  return robot.find_link("world") != nullptr &&
         std::any_of(robot.joints.begin(), robot.joints.end(), is_world);
}

// '-z', '0.32' in the spawner's arguments.
void check_spawn_height(const LaunchFile& file, Findings& out) {
  for (const char* option : {"'-z'", "\"-z\""}) {
    const std::size_t at = file.text.find(option);
    if (at == std::string::npos) continue;
    const std::size_t from = file.text.find_first_not_of(" \t\n,", at + 4);
    if (from == std::string::npos || (file.text[from] != '\'' && file.text[from] != '"')) return;
    double height = 0;
    const char* begin = file.text.data() + from + 1;
    const auto [end, error] = std::from_chars(begin, file.text.data() + file.text.size(), height);
    if (error != std::errc() || *end != file.text[from] || std::abs(height) < 1e-9) return;
    out.add("package.spawn_height", file.subject(), file.place(at),
            fmt::format("it spawns the robot at z = {:g} m, but the description fixes it to 'world'", height),
            "spawn at z = 0, or put the height into the joint to 'world'");
    return;
  }
}

std::size_t end_of_call(const std::string& text, std::size_t open) {
  int depth = 0;
  for (std::size_t at = open; at < text.size(); ++at) {
    if (text[at] == '(') ++depth;
    if (text[at] == ')' && --depth == 0) return at;
  }
  return text.size();
}

// The argument that a simulation requires; empty: none.
std::string simulation_switch(const AuditInput& in) {
  std::string wanted;
  for (const auto& argument : declared_xacro_arguments(in.expanded.file, in.resolver)) {
    const bool off = argument.has_default && argument.default_value == "false";
    if (off && switches_simulation(argument.name) && argument.name.find("hardware") == std::string::npos)
      wanted = argument.name;
  }
  return wanted;
}

// A simulator's launch file that expands the description without its switch.
void check_mapping(const LaunchFile& file, const std::string& wanted, Findings& out) {
  if (!file.simulates()) return;
  if (wanted.empty() || file.says(wanted)) return;
  for (const char* call : {"process_file(", "Command("}) {
    const std::size_t at = file.text.find(call);
    if (at == std::string::npos) continue;
    const std::size_t end = end_of_call(file.text, at + std::string_view(call).size() - 1);
    const std::string inside = file.text.substr(at, end - at);
    if (std::string_view(call) == "Command(" && inside.find("xacro") == std::string::npos) continue;
    if (inside.find("mappings") != std::string::npos || inside.find(":=") != std::string::npos) continue;
    out.add(
        "package.launch_mapping", file.subject(), file.place(at),
        fmt::format("it starts a simulator and expands the description without '{}', whose default is false",
                    wanted),
        std::string_view(call) == "Command("
            ? fmt::format("add ' {}:=true' to the command", wanted)
            : fmt::format("write process_file(..., mappings={{'{}': 'true'}})", wanted));
    return;
  }
}

// Packages that one dependency brings along.
bool brought_by(const std::string& name, const Names& dependencies) {
  return std::any_of(dependencies.begin(), dependencies.end(), [&](const std::string& d) {
    return name == d ||
           (name.starts_with(d + "_") && (d == "ros_gz" || d == "ros_ign" || d == "moveit_ros")) ||
           (d == "moveit" && name.starts_with("moveit_")) || (d == "gazebo_ros_pkgs" && name == "gazebo_ros");
  });
}

void check_packages(const LaunchFile& file, const PackageManifest& manifest, Names& reported, Findings& out) {
  for (const std::string_view open : {"package=", "FindPackageShare(", "get_package_share_directory("}) {
    for (std::size_t at = file.text.find(open); at != std::string::npos; at = file.text.find(open, at + 1)) {
      const std::size_t quote = at + open.size();
      if (quote >= file.text.size() || (file.text[quote] != '\'' && file.text[quote] != '"')) continue;
      const std::size_t end = file.text.find(file.text[quote], quote + 1);
      if (end == std::string::npos) break;
      const std::string name = file.text.substr(quote + 1, end - quote - 1);
      if (name == manifest.name || brought_by(name, manifest.dependencies) || contains(reported, name))
        continue;
      if (reported.size() == kMaxDependencies) return;
      reported.push_back(name);
      out.add("package.launch_dependency", file.subject(), file.place(at),
              fmt::format("it uses the package '{}', which package.xml does not depend on", name),
              fmt::format("add <exec_depend>{}</exec_depend> to package.xml", name));
    }
  }
}

}  // namespace

void check_launch(const AuditInput& in, const PackageManifest& manifest, Findings& out) {
  Names reported;
  const bool fixed = fixed_to_world(in.robot);
  const std::vector<LaunchFile> files = launch_files(in.options.package_folder, out);
  const std::string wanted = files.empty() ? "" : simulation_switch(in);
  for (const LaunchFile& file : files) {
    if (fixed) check_spawn_height(file, out);
    check_mapping(file, wanted, out);
    check_packages(file, manifest, reported, out);
  }
}

}  // namespace doppel::audit_rules
