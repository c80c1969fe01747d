#include "doppel/scenario/launch/detail/spawn_arguments.h"

#include <array>
#include <optional>
#include <sstream>

#include "doppel/base/core/text.h"

namespace doppel {
namespace {

// x, y, z, roll, pitch, yaw as far as they are given.
struct SixNumbers {
  std::array<double, 6> values{};
  bool is_given = false;

  void set(std::size_t i, const std::string& text) {
    if (const std::optional<double> number = parse_number(text)) {
      values.at(i) = *number;
      is_given = true;
    }
  }
  [[nodiscard]] std::optional<Pose> pose() const {
    if (!is_given) return std::nullopt;
    return make_pose({values[0], values[1], values[2]}, {values[3], values[4], values[5]});
  }
};

std::string without_dashes(const std::string& word) {
  const std::size_t begin = word.find_first_not_of('-');
  return begin == std::string::npos ? "" : word.substr(begin);
}

// The index of a coordinate by the name of its option; R, P and Y are capitals everywhere.
std::optional<std::size_t> coordinate(const std::string& name) {
  constexpr std::array kNames = {"x", "y", "z", "R", "P", "Y"};
  constexpr std::array kLongNames = {"x", "y", "z", "roll", "pitch", "yaw"};
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    if (name == kNames.at(i) || name == kLongNames.at(i)) return i;
  }
  return std::nullopt;
}

void set_value(const std::string& name, const std::string& value, ModelSpawn& out, SixNumbers& numbers) {
  if (const auto i = coordinate(name)) return numbers.set(*i, value);
  if (name == "topic" || name == "param") out.topic = value;
  if (name == "file" || name == "model_file") out.file = value;
  if (name == "string" || name == "model_string") out.text = value;
  if (name == "database") out.database = value;
  if (name == "name" || name == "entity" || name == "model" || name == "entity_name") out.name = value;
  if (name == "robot_namespace") out.name_space = value;
}

bool is_number(const std::string& text) {
  return parse_number(text).has_value();
}

// The two styles of static_transform_publisher without options.
std::optional<StaticTransform> positional_transform(std::vector<std::string> words) {
  std::size_t numbers = 0;
  while (numbers < words.size() && is_number(words[numbers])) ++numbers;
  if (words.size() < numbers + 2 || (numbers != 6 && numbers != 7)) return std::nullopt;
  std::array<double, 7> v{};
  for (std::size_t i = 0; i < numbers; ++i) v.at(i) = *parse_number(words[i]);
  StaticTransform out{words[numbers], words[numbers + 1]};
  const Eigen::Vector3d p(v[0], v[1], v[2]);
  if (numbers == 6) {
    out.X_PC = make_pose(p, {v[5], v[4], v[3]});  // yaw pitch roll
  } else {
    out.X_PC = Pose::Identity();
    out.X_PC.translation() = p;
    const Eigen::Quaterniond q(v[6], v[3], v[4], v[5]);
    if (q.norm() > 0) out.X_PC.linear() = q.normalized().toRotationMatrix();
  }
  return out;
}

}  // namespace

ModelSpawn model_spawn(const std::vector<std::string>& words) {
  ModelSpawn out;
  SixNumbers numbers;
  for (std::size_t i = 0; i + 1 < words.size(); ++i) {
    if (words[i].starts_with('-') && !is_number(words[i]))
      set_value(without_dashes(words[i]), words[i + 1], out, numbers);
  }
  out.X_WR = numbers.pose();
  return out;
}

ModelSpawn model_spawn(const NamedTexts& values) {
  ModelSpawn out;
  SixNumbers numbers;
  for (const auto& [name, value] : values) {
    if (value.empty()) continue;
    set_value(name, value, out, numbers);
  }
  out.X_WR = numbers.pose();
  return out;
}

ControllerSpawn controller_spawn(const std::vector<std::string>& words) {
  ControllerSpawn out;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string& word = words[i];
    const auto value = [&]() -> std::string { return i + 1 < words.size() ? words[++i] : ""; };
    if (word == "-c" || word == "--controller-manager") {
      out.manager = value();
    } else if (word == "-p" || word == "--param-file") {
      out.files.push_back(value());
    } else if (word == "-n" || word == "--namespace") {
      out.manager = "/" + bare_namespace(value()) + "/controller_manager";
    } else if (word == "--inactive" || word == "--load-only" || word == "--stopped") {
      out.active = false;
    } else if (word == "-t" || word == "--controller-type" || word == "--controller-manager-timeout" ||
               word == "--switch-timeout" || word == "--service-call-timeout" || word == "--timeout" ||
               word == "--fallback_controllers" || word == "--controller-ros-args") {
      value();
    } else if (word == "--ros-args") {
      break;
    } else if (!word.empty() && !word.starts_with('-') && word.find(":=") == std::string::npos) {
      out.names.push_back(word);
    }
  }
  return out;
}

std::optional<StaticTransform> static_transform(const std::vector<std::string>& words) {
  StaticTransform out;
  SixNumbers numbers;
  std::array<double, 4> q{};
  bool quaternion = false;
  std::vector<std::string> rest;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (words[i] == "--ros-args") break;
    if (!words[i].starts_with("--")) {
      rest.push_back(words[i]);
      continue;
    }
    const std::string name = without_dashes(words[i]);
    const std::string value = i + 1 < words.size() ? words[++i] : "";
    constexpr std::array kParts = {"qx", "qy", "qz", "qw"};
    for (std::size_t k = 0; k < kParts.size(); ++k) {
      if (name != kParts.at(k)) continue;
      q.at(k) = parse_number(value).value_or(0);
      quaternion = true;
    }
    if (const auto k = coordinate(name)) numbers.set(*k, value);
    if (name == "frame-id") out.parent = value;
    if (name == "child-frame-id") out.child = value;
  }
  if (out.parent.empty() && out.child.empty()) return positional_transform(rest);
  if (out.parent.empty() || out.child.empty()) return std::nullopt;
  out.X_PC = numbers.pose().value_or(Pose::Identity());
  const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
  if (quaternion && rotation.norm() > 0) out.X_PC.linear() = rotation.normalized().toRotationMatrix();
  return out;
}

std::string world_of_command(const std::vector<std::string>& words) {
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string& word = words[i];
    if (word == "-v" || word == "--verbose" || word == "-z" || word == "--render-engine" ||
        word == "--seed" || word == "--iterations" || word == "--physics-engine" || word == "--gui-config" ||
        word == "--force-version" || word == "--render-engine-gui" || word == "--render-engine-server") {
      if (i + 1 < words.size() &&
          (is_number(words[i + 1]) || word.starts_with("--render") || word == "--physics-engine" ||
           word == "--gui-config" || word == "--force-version"))
        ++i;
      continue;
    }
    // "-s libgazebo_ros_init.so": gzserver loads a plugin.
    if (word == "-s" && i + 1 < words.size() && words[i + 1].ends_with(".so")) ++i;
    const bool other_file = word.ends_with(".so") || word.ends_with(".yaml") || word.ends_with(".config");
    if (!word.empty() && !word.starts_with('-') && word != "sim" && word != "gazebo" && !other_file)
      return word;
  }
  return "";
}

std::vector<std::string> split_words(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> out;
  for (std::string word; in >> word;) out.push_back(word);
  return out;
}

}  // namespace doppel
