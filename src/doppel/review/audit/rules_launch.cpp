// Launch files of the package: their arguments for xacro and for the spawner, and the packages that they use.
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <map>
#include <set>
#include <tuple>

#include "doppel/review/audit/detail/package_files.h"
#include "doppel/review/audit/detail/ros_rules.h"
#include "doppel/scenario/launch/launch_survey.h"
#include "doppel/scenario/resolve/open_target.h"
#include "doppel/scenario/resolve/side_files.h"

namespace doppel::audit_rules {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxDependencies = 50;  // reported for one package

constexpr int kMaxLines = 60;  // of one action, which a place is searched in

// Texts for places: records have the line where their action begins.
class LaunchTexts {
 public:
  void add(SideFile file) { files_.emplace(file.path, std::move(file)); }

  // The first of these words from a line on, each with its offset to the place that is shown.
  [[nodiscard]] SourceLocation place(const SourceLocation& action,
                                     std::initializer_list<std::string> words) const {
    const auto found = action.known() ? files_.find(*action.file) : files_.end();
    if (found == files_.end() || action.line < 1) return action;
    const SideFile& file = found->second;
    const auto line = static_cast<std::size_t>(action.line) - 1;
    if (line >= file.line_starts.size()) return action;
    const std::size_t last = line + kMaxLines;
    const std::string_view text = std::string_view(file.text).substr(
        0, last < file.line_starts.size() ? file.line_starts[last] : file.text.size());
    std::size_t first = std::string_view::npos;
    for (const std::string& word : words) first = std::min(first, text.find(word, file.line_starts[line]));
    return first == std::string_view::npos ? action : file.place(first);
  }

 private:
  std::map<fs::path, SideFile> files_;
};

bool is_launch_file(const SideFile& file) {
  const std::string extension = file.path.extension().string();
  const auto says = [&](std::string_view word) { return file.text.find(word) != std::string::npos; };
  if (extension == ".py") return says("generate_launch_description");
  if (extension == ".yaml" || extension == ".yml")
    return file.text.starts_with("launch:") || says("\nlaunch:");
  return says("<launch");
}

std::vector<fs::path> launch_files(const fs::path& package, LaunchTexts& texts, Findings& out) {
  std::vector<fs::path> files;
  Diagnostics skipped;
  for (const fs::path& path :
       side_files_of(package / "launch", {".py", ".xml", ".launch", ".yaml", ".yml"}, skipped)) {
    try {
      SideFile file = read_side_file(path);
      if (is_launch_file(file)) files.push_back(path);
      texts.add(std::move(file));
    } catch (const InputError& error) {
      report_skipped(error, out);
    }
  }
  report_skipped(skipped, out);
  return files;
}

// A file that others include is read with each of them.
class Places {
 public:
  // False: it is there.
  bool add(const std::string& rule, const SourceLocation& where) {
    return found_.emplace(rule, where.known() ? *where.file : "", where.line, where.column).second;
  }

 private:
  std::set<std::tuple<std::string, std::string, int, int>> found_;
};

std::string subject_of(const SurveyedLaunch& file, const SourceLocation& where) {
  return fmt::format("launch file '{}'",
                     (where.known() ? fs::path(*where.file) : file.file).filename().string());
}

bool fixed_to_world(const RobotDescription& robot) {
  const auto is_world = [](const Joint& joint) {
    return joint.parent == "world" && joint.type == JointType::fixed;
  };
  return robot.find_link("world") != nullptr &&
         std::any_of(robot.joints.begin(), robot.joints.end(), is_world);
}

void check_spawn_height(const SurveyedLaunch& file, const LaunchTexts& texts, Places& places, Findings& out) {
  for (const SpawnedRobot& robot : file.spawned) {
    const SourceLocation where = texts.place(robot.source, {"'-z'", "\"-z\"", "-z "});
    if (std::abs(robot.height) < 1e-9 || !places.add("package.spawn_height", where)) continue;
    out.add("package.spawn_height", subject_of(file, where), where,
            fmt::format("it spawns the robot at z = {:g} m, but the description fixes it to 'world'",
                        robot.height),
            "spawn at z = 0, or put the height into the joint to 'world'");
  }
}

// The argument that a simulation requires; empty: none.
std::string simulation_switch(const AuditInput& in) {
  std::string simulation_argument;
  for (const auto& argument : declared_xacro_arguments(in.expanded.file, in.resolver)) {
    const bool off = argument.has_default && argument.default_value == "false";
    if (off && switches_simulation(argument.name) && argument.name.find("hardware") == std::string::npos)
      simulation_argument = argument.name;
  }
  return simulation_argument;
}

// A simulator's launch file that expands the description without its switch.
void check_mapping(const SurveyedLaunch& file, const std::string& simulation_argument,
                   const fs::path& description, const LaunchTexts& texts, Places& places, Findings& out) {
  if (!file.simulates || simulation_argument.empty()) return;
  std::error_code none;
  for (const LaunchExpansion& one : file.expansions) {
    const auto is_switch = [&](const auto& argument) { return argument.first == simulation_argument; };
    if (std::any_of(one.arguments.begin(), one.arguments.end(), is_switch)) continue;
    const SourceLocation where = texts.place(one.source, {one.by_command ? "Command(" : "process_file("});
    if (!fs::equivalent(one.file, description, none) || !places.add("package.launch_mapping", where))
      continue;
    out.add(
        "package.launch_mapping", subject_of(file, where), where,
        fmt::format("it starts a simulator and expands the description without '{}', whose default is false",
                    simulation_argument),
        one.by_command
            ? fmt::format("add ' {}:=true' to the command", simulation_argument)
            : fmt::format("write process_file(..., mappings={{'{}': 'true'}})", simulation_argument));
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

// The place at which a launch file names a package.
SourceLocation place_of(const NamedPackage& package, const LaunchTexts& texts) {
  const std::string &name = package.name, single = "'" + name + "'", twice = "\"" + name + "\"";
  return texts.place(package.source, {"package=" + single, "package=" + twice, "FindPackageShare(" + single,
                                      "FindPackageShare(" + twice, "get_package_share_directory(" + single,
                                      "get_package_share_directory(" + twice, "pkg=" + twice, "pkg=" + single,
                                      " " + name + ")", single, twice});
}

void check_packages(const SurveyedLaunch& file, const PackageManifest& manifest, const LaunchTexts& texts,
                    Names& reported, Findings& out) {
  for (const NamedPackage& package : file.packages) {
    const std::string& name = package.name;
    if (name == manifest.name || brought_by(name, manifest.dependencies) || contains(reported, name))
      continue;
    if (reported.size() == kMaxDependencies) return;
    reported.push_back(name);
    out.add("package.launch_dependency", subject_of(file, package.source), place_of(package, texts),
            fmt::format("it uses the package '{}', which package.xml does not depend on", name),
            fmt::format("add <exec_depend>{}</exec_depend> to package.xml", name));
  }
}

void report_unread(const Diagnostic& one, const std::string& subject, Places& places, Findings& out) {
  if (places.add(one.message, one.where))
    out.add("package.launch_unread", subject, one.where, one.message, one.fix);
}

}  // namespace

void check_launch(const AuditInput& in, const PackageManifest& manifest, Findings& out) {
  LaunchTexts texts;
  Places places;
  const fs::path& package = in.options.package_folder;
  const LaunchSurvey survey = survey_launch_files(package, launch_files(package, texts, out), in.resolver);
  if (survey.unread) report_unread(*survey.unread, "the launch files", places, out);
  const bool fixed = fixed_to_world(in.robot);
  const std::string simulation_argument = survey.files.empty() ? "" : simulation_switch(in);
  Names reported;
  for (const SurveyedLaunch& file : survey.files) {
    if (fixed) check_spawn_height(file, texts, places, out);
    check_mapping(file, simulation_argument, in.expanded.file, texts, places, out);
    check_packages(file, manifest, texts, reported, out);
    for (const Diagnostic& note : file.notes.all())
      report_unread(note, subject_of(file, note.where), places, out);
  }
}

}  // namespace doppel::audit_rules
