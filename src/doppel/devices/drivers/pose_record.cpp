#include "doppel/devices/drivers/pose_record.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <system_error>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/names.h"
#include "doppel/base/core/output_file.h"
#include "doppel/base/core/text.h"
#include "doppel/base/core/user_folders.h"
#include "doppel/base/yaml/placed_yaml.h"
#include "doppel/base/yaml/yaml_text.h"

namespace doppel {
namespace {

const YamlRules kPoseRules{"hardware.pose", "hardware.pose", "hardware.pose", "hardware.pose",
                           "hardware.pose"};

std::string file_name(std::string text) {
  for (char& c : text) {
    const bool plain =
        (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '-' || c == '.';
    if (!plain) c = '_';
  }
  return text;
}

constexpr double kSlack = 1e-6;  // rad

void check_position(const ServoSetup& setup, const std::string& joint, double position, Diagnostics& errors) {
  std::vector<std::string> names;
  for (const JointServo& one : setup.joints) names.push_back(one.joint);
  const auto servo = std::ranges::find(setup.joints, joint, &JointServo::joint);
  if (servo == setup.joints.end())
    return errors.error("hardware.unknown_joint", {},
                        fmt::format("no servo drives '{}'{}", joint, did_you_mean(joint, names)));
  if (!(position >= servo->lower - kSlack && position <= servo->upper + kSlack))
    errors.error("hardware.outside", servo->source,
                 fmt::format("{:.4g} rad are outside of the limits {:.4g} to {:.4g} of '{}'", position,
                             servo->lower, servo->upper, joint));
}

}  // namespace

void check_pose(const ServoSetup& setup, std::span<const std::pair<std::string, double>> positions) {
  Diagnostics errors;
  for (const auto& [joint, position] : positions) check_position(setup, joint, position, errors);
  for (const JointServo& one : setup.joints) {
    const auto named = std::ranges::find(positions, one.joint, &std::pair<std::string, double>::first);
    if (one.enabled && named == positions.end())
      errors.error("hardware.pose", one.source, fmt::format("the position of '{}' is missing", one.joint),
                   "name every joint: \"joint 1=90\" \"joint 2=45\"");
  }
  errors.throw_if_errors();
}

std::optional<PoseRecord> read_pose_record(const std::filesystem::path& file) {
  std::error_code failed;
  if (file.empty() || !std::filesystem::is_regular_file(file, failed)) return {};
  PlacedYaml root;
  try {
    root = load_yaml(file, kPoseRules, "record of a pose");
  } catch (const InputError&) {
    return {};  // the person confirms the pose again
  }
  PoseRecord out;
  const std::string& boot = root["boot"].text;
  const auto [end, error] = std::from_chars(boot.data(), boot.data() + boot.size(), out.boot, 16);
  if (error != std::errc() || end != boot.data() + boot.size()) return {};
  out.parked = root["parked"].text == "true";
  const PlacedYaml& positions = root["positions"];
  for (std::size_t i = 0; i < positions.keys.size(); ++i) {
    const std::optional<double> value = parse_number(positions.items[i].text);
    if (!value) return {};
    out.positions.emplace_back(positions.keys[i].text, *value);
  }
  return out;
}

void write_pose_record(const std::filesystem::path& file, const PoseRecord& record) {
  std::error_code ignored;
  std::filesystem::create_directories(file.parent_path(), ignored);
  std::string text = fmt::format(
      "# The pose that was confirmed; written by doppel.\nboot: \"{:08X}\"\nparked: {}\npositions:\n",
      record.boot, record.parked);
  for (const auto& [joint, position] : record.positions)
    text += fmt::format("  {}: {:.6f}\n", yaml_text(joint), position);
  write_whole(file, text);
}

std::filesystem::path pose_record_file(const std::string& component, const std::string& port) {
  const std::filesystem::path folder = state_folder();
  if (folder.empty()) return {};
  return folder / "poses" / (file_name(component) + "_" + file_name(port) + ".yaml");
}

}  // namespace doppel
