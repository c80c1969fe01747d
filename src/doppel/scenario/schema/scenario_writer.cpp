// A Scenario to a scenario file: a tree of JSON, printed as JSON or YAML.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <set>

#include "doppel/base/core/read_file.h"
#include "doppel/base/core/sha256.h"
#include "doppel/base/math/pose.h"
#include "doppel/scenario/schema/detail/scenario_paths.h"
#include "doppel/scenario/schema/scenario_file.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using Tree = nlohmann::ordered_json;
using schema_detail::written_path;
using schema_detail::written_word;

constexpr std::size_t kMaxHashedBytes = std::size_t{1} << 30;  // of a mesh

// Names of files and arguments may have bytes that are no text.
std::string json_text(const Tree& tree, int indent = -1) {
  return tree.dump(indent, ' ', false, Tree::error_handler_t::replace);
}

Tree tree_of(const Eigen::Vector3d& v) {
  return Tree{v.x(), v.y(), v.z()};
}

// By roll, pitch and yaw where these give the same bits, else by the matrix.
void add_pose(const Pose& X, Tree& out) {
  out["xyz"] = tree_of(X.translation());
  const Eigen::Vector3d rpy = rpy_from_rotation(X.linear());
  const Eigen::Matrix3d R = X.linear();
  if (rotation_from_rpy(rpy) == R) {
    if (!rpy.isZero(0)) out["rpy"] = tree_of(rpy);
    return;
  }
  Tree& rotation = out["rotation"] = Tree::array();
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) rotation.push_back(R(row, column));
}

Tree tree_of(const LinkMasses& masses) {
  Tree out = Tree::object();
  for (const auto& [link, mass] : masses) {
    const Eigen::Matrix3d& I = mass.I;
    out[link] = {{"mass", mass.mass},
                 {"com", tree_of(mass.com)},
                 {"inertia", Tree{I(0, 0), I(0, 1), I(0, 2), I(1, 1), I(1, 2), I(2, 2)}}};
  }
  return out;
}

Tree tree_of(const RobotChoices& choices, const fs::path& folder) {
  Tree out = Tree::object();
  for (const fs::path& file : choices.controllers) out["controllers"].push_back(written_path(file, folder));
  if (!choices.parameters.empty()) out["parameters"] = choices.parameters;
  if (!choices.active.empty()) out["active"] = choices.active;
  if (!choices.inactive.empty()) out["inactive"] = choices.inactive;
  if (choices.generated_hardware) out["generated_hardware"] = true;
  if (!choices.masses.empty()) out["masses"] = tree_of(choices.masses);
  return out;
}

Tree tree_of(const WorldRobot& robot, const fs::path& folder) {
  Tree out{{"robot", written_word(robot.target, folder)}};
  if (!robot.name_space.empty()) out["namespace"] = robot.name_space;
  if (robot.X_WR) add_pose(*robot.X_WR, out);
  for (const auto& [name, value] : robot.arguments) out["arguments"][name] = value;
  if (robot.controllers.size() == 1) out["controllers"] = written_path(robot.controllers.front(), folder);
  if (robot.controllers.size() > 1)
    for (const fs::path& file : robot.controllers) out["controllers"].push_back(written_path(file, folder));
  if (robot.tolerant) out["tolerant"] = true;
  if (!robot.activate.empty()) out["activate"] = robot.activate;
  if (robot.base) out["base"] = *robot.base == BaseKind::floating ? "floating" : "fixed";
  if (robot.tf != TfTopics::both) out["tf"] = kTfTopicsNames[static_cast<int>(robot.tf)];
  return out;
}

std::vector<std::string> words_of(const RosArguments& ros, const fs::path& folder) {
  std::vector<std::string> out;
  const auto add = [&out](const char* flag, std::string value) {
    out.emplace_back(flag);
    out.push_back(std::move(value));
  };
  for (const std::string& rule : ros.names.texts()) add("-r", rule);
  for (const auto& parameter : ros.parameters) {
    if (const auto* file = std::get_if<GivenParameterFile>(&parameter)) {
      add("--params-file", written_path(file->path, folder));
    } else {
      add("-p", std::get<GivenParameter>(parameter).text);
    }
  }
  constexpr std::array kLevels{"info", "warn", "error"};
  if (ros.log_level) add("--log-level", kLevels[static_cast<std::size_t>(*ros.log_level)]);
  if (ros.enclave) add("--enclave", *ros.enclave);
  return out;
}

Tree tree_of(const EmulationOptions& emulation, const fs::path& folder) {
  constexpr std::array kHands{"none", "guide", "sweep"};
  Tree out{{"seed", emulation.seed}, {"hand", kHands[static_cast<std::size_t>(emulation.hand)]}};
  if (!emulation.faults.empty()) out["faults"] = written_path(emulation.faults, folder);
  if (emulation.servos) out["servos"] = to_string(*emulation.servos);
  return out;
}

Tree tree_of(const Scenario& scenario, const fs::path& folder) {
  Tree out{{"doppel_scenario", 1}, {"complete", scenario.complete}, {"robots", Tree::array()}};
  for (const WorldRobot& robot : scenario.robots) {
    Tree& entry = out["robots"].emplace_back(tree_of(robot, folder));
    if (const RobotChoices* const choices = scenario.choices_of(robot))
      entry["choices"] = tree_of(*choices, folder);
  }
  if (scenario.world) out["world"] = written_word(scenario.world->string(), folder);
  out["engine"] = scenario.engine;
  if (scenario.step) out["step"] = to_seconds(*scenario.step);
  out["start_controllers"] = scenario.start_controllers;
  for (const std::string& plugin : scenario.plugins) out["plugins"].push_back(written_word(plugin, folder));
  if (scenario.hardware != HardwareUse::simulated) {
    out["guard"] = scenario.guard;
    constexpr std::array kNames{"simulated", "emulated", "ports", "real"};
    out["hardware"] = kNames[static_cast<std::size_t>(scenario.hardware)];
    constexpr std::array kMirrors{"shadow", "follow", "off", "rehearse"};
    const bool real = scenario.hardware == HardwareUse::real;
    if (real || scenario.mirror == MirrorMode::rehearse)
      out["mirror"] = kMirrors[static_cast<std::size_t>(scenario.mirror)];
    if (!real) out["emulation"] = tree_of(scenario.emulation, folder);
  }
  out["ideal"] = scenario.ideal;
  out["enforce_limits"] = scenario.enforce_limits;
  out["strict"] = scenario.strict;
  out["stamp"] = scenario.wall_stamps ? "wall" : "sim";
  // A complete scenario without a distribution is one of Jazzy, as those that were written before there were
  // others.
  if (scenario.distro && !(scenario.complete && *scenario.distro == Distro::jazzy))
    out["distro"] = std::string(to_string(*scenario.distro));
  for (const StaticTransform& transform : scenario.transforms) {
    Tree& entry =
        out["transforms"].emplace_back(Tree{{"parent", transform.parent}, {"child", transform.child}});
    add_pose(transform.X_PC, entry);
  }
  const std::vector<std::string> words = words_of(scenario.ros, folder);
  if (!words.empty()) out["ros_args"] = words;
  out["sensors"] = {{"seed", scenario.sensors.seed},
                    {"lockstep", scenario.sensors.lockstep},
                    {"threads", scenario.sensors.threads}};
  return out;
}

// -- YAML
bool is_plain(const std::string& text) {
  static const std::set<std::string> kOtherMeanings{"true", "false", "yes", "no",  "on",
                                                    "off",  "y",     "n",   "null"};
  std::string lower = text;
  std::ranges::transform(lower, lower.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const auto fits = [](unsigned char c) { return std::isalnum(c) != 0 || c == '_' || c == '/' || c == '.'; };
  return !text.empty() && std::isalpha(static_cast<unsigned char>(text.front())) != 0 &&
         std::ranges::all_of(text, fits) && !kOtherMeanings.contains(lower);
}

std::string yaml_scalar(const Tree& value) {
  return value.is_string() && is_plain(value.get<std::string>()) ? value.get<std::string>()
                                                                 : json_text(value);
}

// A text whose lines a block of YAML keeps as they are.
bool is_block(const Tree& value) {
  if (!value.is_string()) return false;
  const std::string text = value.get<std::string>();
  return text.ends_with('\n') && !text.ends_with("\n\n") && text != "\n" && !text.starts_with(' ');
}

bool is_scalar_list(const Tree& value) {
  return value.is_array() &&
         std::ranges::all_of(value, [](const Tree& item) { return item.is_primitive() && !is_block(item); });
}

// Ends with a newline. A text of several lines is a block, so that it can be edited.
void print_yaml(const Tree& value, const std::string& indent, std::string& out) {
  if (is_block(value)) {
    out += " |\n";
    const std::string text = value.get<std::string>();
    for (std::size_t begin = 0; begin < text.size();) {
      const std::size_t end = text.find('\n', begin);
      out += indent + text.substr(begin, end - begin) + "\n";
      begin = end + 1;
    }
  } else if (value.is_object() && !value.empty()) {
    out += "\n";
    for (const auto& [key, item] : value.items()) {
      out += indent + (is_plain(key) ? key : json_text(key)) + ":";
      print_yaml(item, indent + "  ", out);
    }
  } else if (is_scalar_list(value)) {
    std::string items;
    for (const Tree& item : value) items += (items.empty() ? "" : ", ") + yaml_scalar(item);
    out += " [" + items + "]\n";
  } else if (value.is_array()) {
    out += "\n";
    for (const Tree& item : value) {
      std::string entry;
      print_yaml(item, indent + "  ", entry);
      // The first key of a map stands behind the dash.
      out += indent + "-" + (item.is_object() ? " " + entry.substr(indent.size() + 3) : entry);
    }
  } else {
    out += " " + yaml_scalar(value) + "\n";
  }
}

std::string yaml_of(const Tree& tree) {
  std::string out;
  print_yaml(tree, "", out);
  return out.substr(1);
}

Tree tree_of(const Scenario& scenario, const std::vector<ReadFile>& files, const fs::path& folder) {
  Tree out = tree_of(scenario, folder);
  for (const ReadFile& file : files) out["files"][written_path(file.file, folder)] = file.sha256;
  return out;
}

}  // namespace

std::vector<ReadFile> files_with_hashes(const std::vector<fs::path>& files) {
  std::vector<ReadFile> out;
  std::set<fs::path> seen;
  for (const fs::path& file : files) {
    if (!seen.insert(file.lexically_normal()).second) continue;
    const FileContent content = read_content(file, kMaxHashedBytes);
    out.push_back({file, content.was_read() ? sha256_hex(content.bytes) : kNoFile});
  }
  return out;
}

std::string content_hash(const Scenario& scenario, const std::vector<ReadFile>& files,
                         const fs::path& folder) {
  return sha256_hex(json_text(tree_of(scenario, files, folder)));
}

std::string scenario_text(const Scenario& scenario, const std::vector<ReadFile>& files,
                          const fs::path& folder, ScenarioFormat format) {
  Tree tree = tree_of(scenario, files, folder);
  tree["content_hash"] = sha256_hex(json_text(tree));
  return format == ScenarioFormat::json ? json_text(tree, 2) + "\n" : yaml_of(tree);
}

}  // namespace doppel
