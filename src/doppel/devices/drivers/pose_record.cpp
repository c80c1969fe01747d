#include "doppel/devices/drivers/pose_record.h"

#include <fmt/format.h>

#include <charconv>
#include <system_error>

#include "doppel/base/core/diagnostic.h"
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

}  // namespace

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
