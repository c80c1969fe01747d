#include "doppel/scenario/resolve/controllers_search.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>

#include "doppel/base/core/names.h"
#include "doppel/base/packages/find_expression.h"
#include "doppel/base/packages/package_folder.h"
#include "doppel/control/manager/controller_manager.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/ros/bus/name_rules.h"
#include "doppel/scenario/resolve/ros1_controllers.h"
#include "doppel/scenario/resolve/side_files.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxPackages = 200;  // beside the description's
constexpr std::size_t kMaxYamlFiles =
    500;  // of a folder: whose controllers stand in the last is not known before
constexpr std::size_t kMaxListed = 4;
constexpr std::array<std::string_view, 4> kRos1Bases{
    "diff_drive_controller/DiffDriveController", "mecanum_drive_controller/MecanumDriveController",
    "ackermann_steering_controller/AckermannSteeringController",
    "steer_drive_controller/SteerDriveController"};

struct Candidate {
  ControllersFile file;
  std::set<std::string> own, foreign;  // joints that its controllers name, of this robot and of others
  bool of_ros1 = false;
  std::string
      obstacle;       // a command interface that its controllers need and <ros2_control> lacks; "": can start
  bool near = false;  // in the description's package
  bool named_alike = false;  // its path holds the robot's name
  bool launched = false;     // a launch file of its package names it
  int usual = 0;             // 0: the usual name for such a file
  std::size_t words = 0;     // of the robot's name and its description's file, in the path

  [[nodiscard]] bool fits() const {
    return obstacle.empty() && (!own.empty() || (near && foreign.empty() && !of_ros1));
  }
  [[nodiscard]] auto order() const {
    return std::tuple(of_ros1, -static_cast<long>(own.size()), foreign.size(), !named_alike, !launched, usual,
                      -static_cast<long>(words), file.path);
  }
};

// True if <ros2_control> offers "joint/interface".
bool offers(const RobotDescription& robot, const std::string& joint, const std::string& interface) {
  return std::ranges::any_of(robot.hardware, [&](const HardwareDescription& hardware) {
    return std::ranges::any_of(hardware.joints, [&](const HardwareJointDescription& one) {
      return one.name == joint && std::ranges::any_of(one.command_interfaces, [&](const auto& offered) {
               return offered.name == interface;
             });
    });
  });
}

// A command interface that is missing, where no controller that commands joints finds all of its own.
std::string obstacle_of(const ControllersFile& file, const RobotDescription& robot) {
  std::string out;
  if (robot.hardware.empty()) return out;  // every joint gets simulated interfaces
  for (const DeclaredController& c : file.controllers) {
    if (c.broadcasts()) continue;
    const std::vector<std::string> joints = c.driven_joints();
    if (!c.known_kind() || joints.empty()) return "";
    std::string missing;
    for (const std::string& joint : joints) {
      if (robot.find_joint(joint) == nullptr) continue;
      for (const auto& [interface, where] : c.interfaces(true)) {
        if (missing.empty() && !offers(robot, joint, interface)) missing = joint + "/" + interface;
      }
    }
    if (missing.empty()) return "";
    if (out.empty()) out = missing;
  }
  return out;
}

// The first controller's type; nothing where no controller is declared.
std::optional<ParameterOverride> first_type(const std::vector<ParameterOverride>& overrides) {
  const auto type = std::find_if(overrides.begin(), overrides.end(),
                                 [](const auto& o) { return o.name.ends_with(".type"); });
  return type == overrides.end() ? std::nullopt : std::optional(*type);
}

// Throws InputError for values of the manager's own that would keep it from coming up.
void check_manager(const ParameterFile& file) {
  Bus bus;
  const Model model;
  const ControllerRegistry registry;
  const Log log;
  Diagnostics said_later;
  const ControllerManager manager(bus, model, registry, &file, {}, log, said_later);
}

// Throws InputError: it cannot be read, or the manager rejects its values.
ControllersFile usable_file(const SideFile& read, const RobotDescription& robot) {
  Diagnostics said_later;
  const ParameterFile file = parse_controllers(read.text, read.path.string(), robot, said_later);
  check_manager(file);
  return controllers_in(file);
}

// True if a file of ROS 1 drives a base. Those of arms are not taken: their gains are of another simulator.
bool drives_base_of_ros1(const std::string& text) {
  return !has_ros2_parameters(text) && std::ranges::any_of(kRos1Bases, [&](std::string_view type) {
    return text.find(type) != std::string::npos;
  });
}

int rank_of(const std::string& stem) {
  if (stem == "ros2_controllers") return 0;
  if (stem == "controllers") return 1;
  return stem.find("controller") != std::string::npos ? 2 : 3;
}

// The words of a name in small letters, with their digits: "CR5_Robot" is cr5, robot.
std::set<std::string> words_with_digits(const std::string& name) {
  std::set<std::string> out;
  std::string word;
  for (const char c : name + '_') {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) {
      word += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    } else if (!word.empty()) {
      out.insert(std::exchange(word, ""));
    }
  }
  return out;
}

std::string listed(const std::vector<Candidate>& candidates) {
  std::string out;
  for (std::size_t i = 0; i < candidates.size() && i < kMaxListed; ++i)
    out += "\n    " + candidates[i].file.path.string();
  if (candidates.size() > kMaxListed) out += fmt::format("\n    and {} more", candidates.size() - kMaxListed);
  return out;
}

std::string reason(const Candidate& best, const Candidate& second) {
  if (best.of_ros1 != second.of_ros1) return "it is of ROS 2";
  if (best.own.size() != second.own.size()) return "it lists most of the robot's joints";
  if (best.foreign.size() != second.foreign.size()) return "it lists the fewest unknown joints";
  if (best.named_alike != second.named_alike) return "its path contains the robot's name";
  if (best.launched != second.launched) return "a launch file refers to it";
  if (best.usual != second.usual) return "its name is the usual one";
  return best.words != second.words ? "its path has the most words in common with the robot's name"
                                    : "it is the first by name";
}

// The launch files of a package, which name the controllers' files that they start.
std::vector<std::string> launch_texts(const fs::path& package) {
  std::vector<std::string> out;
  std::error_code none;
  for (const fs::path& entry : list_side_folder(package / "launch").entries) {
    if (out.size() == kMaxSideFiles || !fs::is_regular_file(entry, none)) continue;
    try {
      out.push_back(read_side_file(entry).text);
    } catch (const InputError&) {
      continue;  // what it names only breaks a tie
    }
  }
  return out;
}

ControllersSearch::Missing missing_file(const GazeboPlugin& plugin, const fs::path& file) {
  std::vector<std::string> there;
  for (const fs::path& entry : list_side_folder(file.parent_path()).entries)
    there.push_back(entry.filename().string());
  return {&plugin, file, there.empty() ? "" : did_you_mean(file.filename().string(), there), !there.empty()};
}

class Search {
 public:
  Search(const RobotDescription& robot, const Target& target, const PackageResolver& resolver)
      : robot_(robot), target_(target), resolver_(resolver) {}

  ControllersSearch run() {
    take_named();
    const fs::path& package = target_.package_folder;
    if (!found_.files.empty() || package.empty()) return std::move(found_);
    std::vector<Candidate> all = candidates_of(package, true);
    if (std::none_of(all.begin(), all.end(), [](const Candidate& c) { return c.fits(); })) {
      if (all.size() == 1) found_.of_another = all.front().file;
      for (Candidate& one : candidates_beside()) all.push_back(std::move(one));
    }
    choose(std::move(all));
    if (!found_.files.empty()) found_.of_another.reset();
    return std::move(found_);
  }

 private:
  void take_named();
  static std::optional<SideFile> read(const fs::path& path, Diagnostics& skipped);
  std::optional<ControllersFile> usable(const SideFile& file, const GazeboPlugin* plugin);
  std::optional<Candidate> candidate(const fs::path& path, Diagnostics& skipped);
  std::vector<Candidate> candidates_of(const fs::path& package, bool near);
  std::vector<Candidate> candidates_beside();
  static std::vector<fs::path> yaml_files(const fs::path& package, Diagnostics& skipped);
  [[nodiscard]] std::size_t words_shared(const std::string& path) const;
  void choose(std::vector<Candidate> all);
  void report_others(std::vector<Candidate> others);
  void report_blocked(const std::vector<Candidate>& files);

  const RobotDescription& robot_;
  const Target& target_;
  const PackageResolver& resolver_;
  ControllersSearch found_;
};

// Nothing, and why, where the file cannot be used.
std::optional<ControllersFile> Search::usable(const SideFile& file, const GazeboPlugin* plugin) {
  try {
    return usable_file(file, robot_);
  } catch (const InputError& error) {
    Diagnostics why;
    for (const Diagnostic& d : error.diagnostics()) why.add(d);
    found_.unusable.push_back({file.path, plugin, std::move(why)});
    return std::nullopt;
  }
}

std::optional<SideFile> Search::read(const fs::path& path, Diagnostics& skipped) {
  try {
    return read_side_file(path);
  } catch (const InputError& error) {
    for (const Diagnostic& d : error.diagnostics()) skipped.note(d.rule, d.where, d.message, d.fix);
    return std::nullopt;
  }
}

void Search::take_named() {
  std::vector<ControllersFile> files;
  std::set<fs::path> seen;
  std::error_code none;
  for (const GazeboExtension& gazebo : robot_.gazebo) {
    for (const GazeboPlugin& plugin : gazebo.plugins) {
      for (const std::string& written : plugin.parameter_files) {
        const fs::path path = with_found_package(written, resolver_);
        if (!seen.insert(path).second) continue;
        if (!fs::is_regular_file(path, none)) {
          found_.missing.push_back(missing_file(plugin, path));
          continue;
        }
        const auto text = read(path, found_.skipped);
        auto file = text ? usable(*text, &plugin) : std::nullopt;
        if (!file) continue;
        file->named = true;
        files.push_back(std::move(*file));
      }
    }
  }
  if (std::any_of(files.begin(), files.end(), [](const ControllersFile& file) { return file.for_ros2; }))
    found_.files = std::move(files);
}

// Nothing where the file declares no controllers for ROS 2, and no base for ROS 1.
std::optional<Candidate> Search::candidate(const fs::path& path, Diagnostics& skipped) {
  const auto text = read(path, skipped);
  if (!text) return std::nullopt;
  const bool of_ros1 = drives_base_of_ros1(text->text);
  if (!of_ros1 &&
      (!has_ros2_parameters(text->text) || (text->text.find("controller_manager") == std::string::npos &&
                                            text->text.find("_controller/") == std::string::npos)))
    return std::nullopt;
  auto file = usable(*text, nullptr);
  if (!file || !file->for_ros2) return std::nullopt;
  Candidate out;
  out.of_ros1 = of_ros1;
  if (!of_ros1) out.obstacle = obstacle_of(*file, robot_);
  for (const DeclaredController& c : file->controllers) {
    for (const std::string& name : c.named_joints())
      (robot_.find_joint(name) != nullptr ? out.own : out.foreign).insert(name);
  }
  out.file = std::move(*file);
  return out;
}

// Those of config/, controllers/ and bringup/ and of the folders in these.
std::vector<fs::path> Search::yaml_files(const fs::path& package, Diagnostics& skipped) {
  std::vector<fs::path> folders, out;
  std::error_code none;
  for (const char* name : {"config", "controllers", "bringup"}) {
    folders.push_back(package / name);
    for (const fs::path& entry : list_side_folder(package / name).entries) {
      if (fs::is_directory(entry, none)) folders.push_back(entry);
    }
  }
  for (const fs::path& folder : folders) {
    for (fs::path& file : side_files_of(folder, {".yaml", ".yml"}, skipped, kMaxYamlFiles))
      out.push_back(std::move(file));
  }
  std::sort(out.begin(), out.end());
  return out;
}

// The number of words of the robot's name and of its description's file that stand in the path.
std::size_t Search::words_shared(const std::string& path) const {
  const std::set<std::string> there = words_with_digits(path);
  std::set<std::string> words = words_with_digits(robot_.name);
  words.merge(words_with_digits(target_.description.stem().string()));
  return static_cast<std::size_t>(std::count_if(
      words.begin(), words.end(), [&](const std::string& word) { return there.contains(word); }));
}

std::vector<Candidate> Search::candidates_of(const fs::path& package, bool near) {
  std::vector<Candidate> out;
  Diagnostics of_others;  // what lies in other packages is not reported
  Diagnostics& skipped = near ? found_.skipped : of_others;
  for (const fs::path& path : yaml_files(package, skipped)) {
    auto one = candidate(path, skipped);
    if (!one) continue;
    one->near = near;
    one->usual = rank_of(path.stem().string());
    const std::string shown = (package.filename() / path.lexically_relative(package)).string();
    one->named_alike = !robot_.name.empty() && shown.find(robot_.name) != std::string::npos;
    one->words = words_shared(shown);
    out.push_back(std::move(*one));
  }
  if (out.empty()) return out;
  const std::vector<std::string> launches = launch_texts(package);
  for (Candidate& one : out) {
    one.launched = std::any_of(launches.begin(), launches.end(), [&](const std::string& text) {
      return text.find(one.file.path.filename().string()) != std::string::npos;
    });
  }
  return out;
}

std::vector<Candidate> Search::candidates_beside() {
  const fs::path& package = target_.package_folder;
  std::vector<Candidate> out;
  std::error_code none;
  std::size_t packages = 0;
  for (const fs::path& entry : list_side_folder(package.parent_path()).entries) {
    if (entry == package || !fs::is_directory(entry, none) || !is_package(entry)) continue;
    if (++packages > kMaxPackages) break;
    for (Candidate& one : candidates_of(entry, false)) out.push_back(std::move(one));
  }
  return out;
}

// The best of those that fit, with a note where it was a choice.
void Search::choose(std::vector<Candidate> all) {
  std::sort(all.begin(), all.end(),
            [](const Candidate& a, const Candidate& b) { return a.order() < b.order(); });
  std::stable_partition(all.begin(), all.end(), [](const Candidate& c) { return c.fits(); });
  if (all.empty()) return;
  if (!all.front().fits()) return report_others(std::move(all));
  std::erase_if(all, [](const Candidate& c) { return !c.fits(); });
  if (all.size() > 1) {
    found_.choices.note("up.controllers_chosen", make_location(all.front().file.path.string()),
                        fmt::format("{} files declare controllers for this robot; this one is used: {}.{}",
                                    all.size(), reason(all[0], all[1]), listed(all)),
                        "choose another with --controllers FILE");
  }
  found_.files.push_back(std::move(all.front().file));
}

void Search::report_blocked(const std::vector<Candidate>& files) {
  const bool one = files.size() == 1;
  found_.choices.note(
      "up.controllers_of_others", robot_.source,
      fmt::format("{} file{} with controllers of this robot {} ignored because <ros2_control> has no command "
                  "interface '{}':{}",
                  files.size(), one ? "" : "s", one ? "is" : "are", files.front().obstacle, listed(files)),
      "add the <command_interface>, or give a file with --controllers FILE");
}

void Search::report_others(std::vector<Candidate> others) {
  const auto rest = std::stable_partition(others.begin(), others.end(),
                                          [](const Candidate& c) { return !c.obstacle.empty(); });
  const std::vector<Candidate> blocked(others.begin(), rest);
  if (!blocked.empty()) report_blocked(blocked);
  others.erase(others.begin(), rest);
  if (others.empty()) return;
  const std::set<std::string>& foreign = others.front().foreign;
  const bool one = others.size() == 1;
  found_.choices.note(
      "up.controllers_of_others", robot_.source,
      fmt::format("{} file{} with controllers {} ignored because {} of another robot{}:{}", others.size(),
                  one ? "" : "s", one ? "is" : "are", one ? "it is" : "they are",
                  foreign.empty() ? "" : fmt::format(" ('{}' is not a joint here)", *foreign.begin()),
                  listed(others)),
      "give the robot's file with --controllers FILE");
}

}  // namespace

ControllersSearch find_controllers_files(const RobotDescription& robot, const Target& target,
                                         const PackageResolver& resolver) {
  return Search(robot, target, resolver).run();
}

void report(const ControllersSearch& search, Diagnostics& diagnostics) {
  for (const ControllersSearch::Missing& missing : search.missing) {
    diagnostics.warning("up.controllers_missing", missing.plugin->source,
                        fmt::format("the plugin's <parameters> refer to the file '{}', which does not "
                                    "exist{}; other files are searched",
                                    missing.file.string(), missing.did_you_mean),
                        "correct the path, or give the file with --controllers FILE");
  }
  for (const ControllersSearch::Unusable& file : search.unusable) {
    const Diagnostic& why = file.why.all().front();
    diagnostics.warning(
        "up.controllers_unreadable", why.where,
        fmt::format("this file, which may hold the robot's controllers, cannot be used: {}", why.message),
        why.fix);
  }
  for (const auto* notes : {&search.skipped, &search.choices}) {
    for (const Diagnostic& d : notes->all()) diagnostics.add(d);
  }
}

bool is_controllers_file(const fs::path& file) {
  try {
    return usable_file(read_side_file(file), RobotDescription()).for_ros2;
  } catch (const InputError&) {
    return false;
  }
}

void report_other_managers(const ParameterFile& file, std::string_view manager, Diagnostics& diagnostics) {
  const auto declared_by = [&file](std::string_view node) {
    return first_type(file.overrides_for(node, "/controller_manager").all());
  };
  if (declared_by(manager)) return;
  std::vector<std::string> others;
  SourceLocation where = make_location(file.name());
  for (const std::string& node : file.nodes()) {
    if (!is_controller_manager(node)) continue;
    const auto type = first_type(file.overrides_for(node).all());
    if (!type) continue;
    if (others.empty()) where = type->source;
    others.push_back(node.starts_with('/') ? node : '/' + node);
  }
  if (others.empty()) return;
  diagnostics.warning(
      "up.controllers_of_other_manager", where,
      fmt::format("the controllers of this file belong to '{}'{}; the manager here is '{}', and none of them "
                  "is loaded",
                  others.front(),
                  others.size() > 1 ? fmt::format(" and {} more managers", others.size() - 1) : "", manager),
      fmt::format("start with --ros-args -r __ns:={}", node_namespace(others.front())));
}

}  // namespace doppel
