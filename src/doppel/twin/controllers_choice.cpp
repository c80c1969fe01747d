#include "doppel/twin/controllers_choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>
#include <iterator>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>

#include "doppel/bus/bus.h"
#include "doppel/bus/name_rules.h"
#include "doppel/control/controller_manager.h"
#include "doppel/packages/package_folder.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kLargestFile = 1 << 20;  // bytes; nobody writes larger ones by hand
constexpr std::size_t kMostFiles = 500;           // of one package: a folder of logs is not read whole
constexpr std::size_t kMostPackages = 200;        // beside the description's
constexpr std::size_t kMostListed = 4;

struct Candidate {
  fs::path file;
  std::set<std::string> own, foreign;  // joints that its controllers name, of this robot and of others
  bool near = false;                   // in the description's package
  bool named_alike = false;            // its path holds the robot's name
  bool launched = false;               // a launch file of its package names it
  int usual = 0;                       // 0: the usual name for such a file
  std::size_t words = 0;               // of the robot's name and its description's file, in the path

  [[nodiscard]] bool fits() const { return !own.empty() || (near && foreign.empty()); }
  [[nodiscard]] auto order() const {
    return std::tuple(-static_cast<long>(own.size()), foreign.size(), !named_alike, !launched, usual,
                      -static_cast<long>(words), file);
  }
};

std::string text_of(const fs::path& file) {
  std::error_code none;
  if (!fs::is_regular_file(file, none) || fs::file_size(file, none) > kLargestFile) return "";
  std::ifstream in(file, std::ios::binary);
  return std::string(std::istreambuf_iterator<char>(in), {});
}

bool is_manager(std::string_view node) {
  return node == "controller_manager" || node.ends_with("/controller_manager");
}

// What a manager is told in a file, whichever namespace it is in.
std::vector<ParameterOverride> manager_parameters(const ParameterFile& file) {
  std::vector<ParameterOverride> out = file.overrides_for("/controller_manager").all();
  if (!out.empty()) return out;
  for (const std::string& node : file.nodes()) {
    if (is_manager(node)) return file.overrides_for(node).all();
  }
  return out;
}

// The first controller's type; nothing where no controller is declared.
std::optional<ParameterOverride> first_type(const std::vector<ParameterOverride>& told) {
  const auto type =
      std::find_if(told.begin(), told.end(), [](const auto& o) { return o.name.ends_with(".type"); });
  return type == told.end() ? std::nullopt : std::optional(*type);
}

bool declares_controllers(const ParameterFile& file) {
  const auto nodes = file.nodes();
  if (std::any_of(nodes.begin(), nodes.end(), is_manager)) return true;
  return first_type(file.overrides_for("/controller_manager").all()).has_value();
}

// "joints", "left_wheel_names", "command_joints" and the like.
bool names_joints(std::string_view parameter) {
  const std::string_view leaf = parameter.substr(parameter.find_last_of('.') + 1);
  if (leaf == "extra_joints") return false;  // a broadcaster's, which the robot need not have
  constexpr std::array kEnds{"joint", "joints", "joint_name", "joint_names", "wheel_names", "wheels_names"};
  return std::any_of(kEnds.begin(), kEnds.end(), [&](const char* end) { return leaf.ends_with(end); });
}

void read_joints(const ParameterFile& file, const RobotDescription& robot, Candidate& out) {
  const auto add = [&](const std::string& name) {
    (robot.find_joint(name) != nullptr ? out.own : out.foreign).insert(name);
  };
  for (const ParameterOverride& told : manager_parameters(file)) {
    if (!told.name.ends_with(".type")) continue;
    const std::string controller = told.name.substr(0, told.name.find('.'));
    const ParameterOverrides its = file.overrides_for("/" + controller);
    for (const ParameterOverride& o : its.all()) {
      if (!names_joints(o.name)) continue;
      if (const auto* one = std::get_if<std::string>(&o.value)) add(*one);
      if (const auto* many = std::get_if<std::vector<std::string>>(&o.value))
        std::for_each(many->begin(), many->end(), add);
    }
  }
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

// Nothing, and a warning, where the file cannot be used.
std::optional<ParameterFile> usable_file(const fs::path& path, const std::string& text,
                                         Diagnostics& diagnostics) {
  try {
    ParameterFile file = ParameterFile::parse(text, path.string());
    check_manager(file);
    return file;
  } catch (const InputError& error) {
    const Diagnostic& first = error.diagnostics().front();
    diagnostics.warning(
        "up.controllers_unreadable", first.where,
        fmt::format("this file, which may hold the robot's controllers, cannot be used: {}", first.message),
        first.mend);
    return std::nullopt;
  }
}

// Nothing where the file declares no controllers for ROS 2, as those for ROS 1 do not.
std::optional<Candidate> read_candidate(const fs::path& path, const RobotDescription& robot,
                                        Diagnostics& diagnostics) {
  const std::string text = text_of(path);
  if (text.find("ros__parameters") == std::string::npos ||
      text.find("controller_manager") == std::string::npos)
    return std::nullopt;
  const auto file = usable_file(path, text, diagnostics);
  if (!file || !declares_controllers(*file)) return std::nullopt;
  Candidate out;
  out.file = path;
  read_joints(*file, robot, out);
  return out;
}

int rank_of(const std::string& stem) {
  if (stem == "ros2_controllers") return 0;
  if (stem == "controllers") return 1;
  return stem.find("controller") != std::string::npos ? 2 : 3;
}

// In the order of their names, at most kMostFiles of those that the system gives first; what cannot be read
// is empty.
std::vector<fs::directory_entry> entries_of(const fs::path& folder) {
  std::vector<fs::directory_entry> out;
  std::error_code problem;
  for (fs::directory_iterator at(folder, problem), end; !problem && at != end && out.size() < kMostFiles;
       at.increment(problem))
    out.push_back(*at);
  std::sort(out.begin(), out.end());
  return out;
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

// How many of the words of the robot's name and of its description's file stand in the path.
std::size_t words_shared(const std::string& path, const RobotDescription& robot,
                         const fs::path& description) {
  const std::set<std::string> there = words_with_digits(path);
  std::set<std::string> words = words_with_digits(robot.name);
  words.merge(words_with_digits(description.stem().string()));
  return static_cast<std::size_t>(std::count_if(
      words.begin(), words.end(), [&](const std::string& word) { return there.contains(word); }));
}

// The launch files of a package, which name the controllers' files that they start.
std::vector<std::string> launch_texts(const fs::path& package) {
  std::vector<std::string> out;
  for (const fs::directory_entry& entry : entries_of(package / "launch"))
    out.push_back(text_of(entry.path()));
  return out;
}

void add_files(const fs::path& folder, bool deeper, std::vector<fs::path>& out) {
  std::error_code none;
  for (const fs::directory_entry& entry : entries_of(folder)) {
    const fs::path extension = entry.path().extension();
    if (extension == ".yaml" || extension == ".yml") out.push_back(entry.path());
    if (deeper && entry.is_directory(none)) add_files(entry.path(), false, out);
  }
}

std::vector<Candidate> candidates_of(const fs::path& package, bool near, const RobotDescription& robot,
                                     const fs::path& description, Diagnostics& diagnostics) {
  std::vector<fs::path> files;
  for (const char* folder : {"config", "controllers"}) add_files(package / folder, true, files);
  std::sort(files.begin(), files.end());
  std::vector<Candidate> out;
  for (const fs::path& file : files) {
    auto candidate = read_candidate(file, robot, diagnostics);
    if (!candidate) continue;
    candidate->near = near;
    candidate->usual = rank_of(file.stem().string());
    const std::string path = (package.filename() / file.lexically_relative(package)).string();
    candidate->named_alike = !robot.name.empty() && path.find(robot.name) != std::string::npos;
    candidate->words = words_shared(path, robot, description);
    out.push_back(std::move(*candidate));
  }
  if (out.empty()) return out;
  const std::vector<std::string> launches = launch_texts(package);
  for (Candidate& candidate : out) {
    candidate.launched = std::any_of(launches.begin(), launches.end(), [&](const std::string& text) {
      return text.find(candidate.file.filename().string()) != std::string::npos;
    });
  }
  return out;
}

std::vector<Candidate> candidates_beside(const fs::path& package, const RobotDescription& robot,
                                         const fs::path& description, Diagnostics& diagnostics) {
  std::vector<Candidate> out;
  std::error_code none;
  std::size_t packages = 0;
  for (const fs::directory_entry& entry : entries_of(package.parent_path())) {
    if (entry.path() == package || !entry.is_directory(none) || !is_package(entry.path())) continue;
    if (++packages > kMostPackages) break;
    for (Candidate& one : candidates_of(entry.path(), false, robot, description, diagnostics))
      out.push_back(std::move(one));
  }
  return out;
}

std::string listed(const std::vector<Candidate>& candidates) {
  std::string out;
  for (std::size_t i = 0; i < candidates.size() && i < kMostListed; ++i)
    out += "\n    " + candidates[i].file.string();
  if (candidates.size() > kMostListed)
    out += fmt::format("\n    and {} more", candidates.size() - kMostListed);
  return out;
}

std::string reason(const Candidate& best, const Candidate& second) {
  if (best.own.size() != second.own.size()) return "it names most of the robot's joints";
  if (best.foreign.size() != second.foreign.size())
    return "it names the fewest joints that the robot does not have";
  if (best.named_alike != second.named_alike) return "its path holds the robot's name";
  if (best.launched != second.launched) return "a launch file names it";
  if (best.usual != second.usual) return "its name is the usual one";
  return best.words != second.words ? "its path shares most words with the robot's name"
                                    : "it is the first by name";
}

void report_others(const std::vector<Candidate>& others, const RobotDescription& robot,
                   Diagnostics& diagnostics) {
  if (others.empty()) return;
  const std::set<std::string>& foreign = others.front().foreign;
  diagnostics.note(
      "up.controllers_of_others", robot.source,
      fmt::format("{} file{} with controllers {} left alone, for {} of another robot{}:{}", others.size(),
                  others.size() == 1 ? "" : "s", others.size() == 1 ? "is" : "are",
                  others.size() == 1 ? "it is" : "they are",
                  foreign.empty() ? "" : fmt::format(" ('{}' is not a joint here)", *foreign.begin()),
                  listed(others)),
      "give the robot's own with --controllers FILE");
}

// The best of those that fit, with a note where it was a choice.
std::vector<fs::path> best_of(std::vector<Candidate> all, const RobotDescription& robot,
                              Diagnostics& diagnostics) {
  std::sort(all.begin(), all.end(),
            [](const Candidate& a, const Candidate& b) { return a.order() < b.order(); });
  std::stable_partition(all.begin(), all.end(), [](const Candidate& c) { return c.fits(); });
  if (all.empty() || !all.front().fits()) {
    report_others(all, robot, diagnostics);
    return {};
  }
  std::erase_if(all, [](const Candidate& c) { return !c.fits(); });
  if (all.size() > 1) {
    diagnostics.note("up.controllers_chosen", make_location(all.front().file.string()),
                     fmt::format("{} files declare controllers that fit this robot; this one is taken: {}.{}",
                                 all.size(), reason(all[0], all[1]), listed(all)),
                     "choose another with --controllers FILE");
  }
  return {all.front().file};
}

std::vector<fs::path> named_by_plugins(const RobotDescription& robot, Diagnostics& diagnostics) {
  std::vector<fs::path> files;
  std::error_code none;
  for (const GazeboExtension& gazebo : robot.gazebo) {
    for (const GazeboPlugin& plugin : gazebo.plugins) {
      for (const std::string& file : plugin.parameter_files) {
        if (!fs::is_regular_file(file, none)) {
          diagnostics.warning(
              "up.controllers_missing", plugin.source,
              fmt::format("the plugin's <parameters> name the file '{}', which does not exist; others are "
                          "looked for",
                          file),
              "correct the path, or give the file with --controllers FILE");
        } else if (std::find(files.begin(), files.end(), fs::path(file)) == files.end()) {
          files.emplace_back(file);
        }
      }
    }
  }
  std::vector<ParameterFile> usable;
  std::erase_if(files, [&](const fs::path& file) {
    auto parsed = usable_file(file, text_of(file), diagnostics);
    if (parsed) usable.push_back(std::move(*parsed));
    return !parsed.has_value();
  });
  return std::any_of(usable.begin(), usable.end(), declares_controllers) ? files : std::vector<fs::path>{};
}

}  // namespace

bool is_controllers_file(const fs::path& file) {
  Diagnostics unused;
  const auto parsed = usable_file(file, text_of(file), unused);
  return parsed && declares_controllers(*parsed);
}

void report_other_managers(const ParameterFile& file, std::string_view manager, Diagnostics& diagnostics) {
  const auto declared_by = [&file](std::string_view node) {
    return first_type(file.overrides_for(node, "/controller_manager").all());
  };
  if (declared_by(manager)) return;
  std::vector<std::string> others;
  SourceLocation where = make_location(file.name());
  for (const std::string& node : file.nodes()) {
    if (!is_manager(node)) continue;
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

std::vector<fs::path> find_controllers_files(const RobotDescription& robot, const Target& target,
                                             Diagnostics& diagnostics) {
  std::vector<fs::path> named = named_by_plugins(robot, diagnostics);
  if (!named.empty() || target.package_folder.empty()) return named;
  const fs::path& package = target.package_folder;
  std::vector<Candidate> all = candidates_of(package, true, robot, target.description, diagnostics);
  if (std::none_of(all.begin(), all.end(), [](const Candidate& c) { return c.fits(); })) {
    for (Candidate& one : candidates_beside(package, robot, target.description, diagnostics))
      all.push_back(std::move(one));
  }
  return best_of(std::move(all), robot, diagnostics);
}

}  // namespace doppel
