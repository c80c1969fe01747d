#include "doppel/devices/drivers/detail/lerobot_calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <optional>
#include <string_view>

#include "doppel/base/core/names.h"
#include "doppel/base/core/text.h"
#include "doppel/base/yaml/placed_yaml.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

const YamlRules kMotorRules{"calibration.syntax", "calibration.unreadable", "calibration.too_large",
                            "calibration.invalid", "calibration.unknown_key"};

struct MotorEntry {
  std::string_view name;
  int RecordedMotor::*member;
  int least, most;
};
constexpr int kLastTick = 4095, kMaxHoming = 2047;
constexpr std::array<MotorEntry, 5> kMotorEntries{
    {{"id", &RecordedMotor::id, 0, 252},
     {"drive_mode", &RecordedMotor::drive_mode, 0, 1},
     {"homing_offset", &RecordedMotor::homing_offset, -kMaxHoming, kMaxHoming},
     {"range_min", &RecordedMotor::range_min, 0, kLastTick},
     {"range_max", &RecordedMotor::range_max, 0, kLastTick}}};

fs::path calibration_path(const std::string& written, const SourceLocation& beside) {
  const char* const home = std::getenv("HOME");
  if (home != nullptr && written.starts_with("~/")) return fs::path(home) / written.substr(2);
  if (fs::path(written).is_absolute() || !beside.known()) return written;
  return fs::path(*beside.file).parent_path() / written;
}

void check_motor_keys(const PlacedYaml& motor, const std::string& name, Diagnostics& errors) {
  std::vector<std::string> names;
  for (const MotorEntry& one : kMotorEntries) names.emplace_back(one.name);
  for (const PlacedYaml& key : motor.keys) {
    if (std::ranges::find(names, key.text) == names.end())
      errors.error(kMotorRules.unknown_key, key.where,
                   fmt::format("the motor '{}' has no '{}'{}", name, key.text, did_you_mean(key.text, names)),
                   "each motor has id, drive_mode, homing_offset, range_min and range_max");
  }
}

std::optional<RecordedMotor> motor_of(const PlacedYaml& key, const PlacedYaml& item, Diagnostics& errors) {
  RecordedMotor out;
  out.motor = key.text;
  out.where = key.where;
  if (!item.is_map()) {
    errors.error(kMotorRules.invalid, item.where, fmt::format("the motor '{}' must be a map", key.text),
                 "use a file that lerobot-calibrate wrote");
    return {};
  }
  check_motor_keys(item, key.text, errors);
  bool whole = true;
  for (const MotorEntry& one : kMotorEntries) {
    const PlacedYaml& value = item[one.name];
    const std::optional<double> number = value.is_scalar() ? parse_number(value.text) : std::nullopt;
    if (number && *number == static_cast<int>(*number) && *number >= one.least && *number <= one.most) {
      out.*one.member = static_cast<int>(*number);
      continue;
    }
    whole = false;
    errors.error(kMotorRules.invalid, value ? value.where : key.where,
                 fmt::format("{} of the motor '{}' must be a whole number from {} to {}", one.name, key.text,
                             one.least, one.most),
                 "use a file that lerobot-calibrate wrote");
  }
  if (whole && out.range_min >= out.range_max) {
    whole = false;
    errors.error(kMotorRules.invalid, item["range_min"].where,
                 fmt::format("the motor '{}' was not moved: its range is {} to {}", key.text, out.range_min,
                             out.range_max),
                 "calibrate again, and move each joint through its whole range");
  }
  return whole ? std::optional(out) : std::nullopt;
}

}  // namespace

std::vector<RecordedMotor> read_recorded_motors(const std::string& written, const SourceLocation& beside,
                                                Diagnostics& errors) {
  const PlacedYaml root = load_yaml(calibration_path(written, beside), kMotorRules, "calibration of LeRobot");
  std::vector<RecordedMotor> out;
  if (!root.is_map() || root.keys.empty()) {
    errors.error(kMotorRules.invalid, root.where, "a calibration of LeRobot is a map of motors",
                 "use a file that lerobot-calibrate wrote");
    return out;
  }
  for (std::size_t i = 0; i < root.keys.size(); ++i) {
    if (const auto motor = motor_of(root.keys[i], root.items[i], errors)) out.push_back(*motor);
  }
  return out;
}

}  // namespace doppel
