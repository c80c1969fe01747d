#include "doppel/review/calibration/lerobot.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numbers>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/read_file.h"

namespace doppel {
namespace {

using nlohmann::json;

constexpr double kTicks = 4096.0;  // a turn of an STS3215 or a Dynamixel X

[[noreturn]] void refuse(const std::string& file, const std::string& message) {
  throw InputError(
      "calibrate.lerobot", make_location(file), message,
      "give the JSON file written by LeRobot's calibration (~/.cache/huggingface/lerobot/calibration/...)");
}

int whole(const json& node, const std::string& what, const std::string& file) {
  if (!node.is_number_integer()) refuse(file, fmt::format("{} is not an integer", what));
  const auto value = node.get<std::int64_t>();
  if (value < -1'000'000 || value > 1'000'000)
    refuse(file, fmt::format("{} is {}, which is not a valid number of ticks", what, value));
  return static_cast<int>(value);
}

void check_range(const LerobotMotor& motor, const std::string& file) {
  if (motor.range_min == motor.range_max) {
    refuse(file, fmt::format("the range of '{}' is empty: both ends are {}", motor.name, motor.range_min));
  }
}

std::vector<LerobotMotor> read_map(const json& root, const std::string& file) {
  std::vector<LerobotMotor> out;
  for (const auto& item : root.items()) {
    const std::string& name = item.key();
    const json& entry = item.value();
    LerobotMotor motor;
    motor.name = name;
    const auto field = [&](const char* key) {
      if (!entry.is_object() || !entry.contains(key))
        refuse(file, fmt::format("the motor '{}' has no '{}'", name, key));
      return whole(entry[key], fmt::format("'{}' of '{}'", key, name), file);
    };
    motor.id = field("id");
    motor.inverted = field("drive_mode") != 0;
    motor.homing_offset = field("homing_offset");
    motor.range_min = field("range_min");
    motor.range_max = field("range_max");
    check_range(motor, file);
    out.push_back(motor);
  }
  return out;
}

std::vector<LerobotMotor> read_lists(const json& root, const std::string& file) {
  const json& names = root["motor_names"];
  if (!names.is_array()) refuse(file, "'motor_names' is not a list");
  std::vector<LerobotMotor> out;
  for (std::size_t i = 0; i < names.size(); ++i) {
    LerobotMotor motor;
    motor.older = true;
    if (!names[i].is_string()) refuse(file, fmt::format("entry {} of 'motor_names' is not a string", i));
    motor.name = names[i].get<std::string>();
    const auto field = [&](const char* key) {
      if (!root.contains(key) || !root[key].is_array() || root[key].size() != names.size())
        refuse(file, fmt::format("'{}' must be a list with as many entries as 'motor_names', {}", key,
                                 names.size()));
      return whole(root[key][i], fmt::format("'{}' of '{}'", key, motor.name), file);
    };
    motor.homing_offset = field("homing_offset");
    motor.inverted = field("drive_mode") != 0;
    motor.range_min = field("start_pos");
    motor.range_max = field("end_pos");
    check_range(motor, file);
    out.push_back(motor);
  }
  return out;
}

}  // namespace

double LerobotMotor::angle(double ticks) const {
  constexpr double kTurn = 2.0 * std::numbers::pi;
  if (older) return ((inverted ? -ticks : ticks) + homing_offset) / kTicks * kTurn;
  const double middle = 0.5 * (static_cast<double>(range_min) + range_max);
  return (ticks - middle) / (kTicks - 1.0) * kTurn;
}

double LerobotMotor::lower() const {
  return std::min(angle(range_min), angle(range_max));
}
double LerobotMotor::upper() const {
  return std::max(angle(range_min), angle(range_max));
}

std::vector<LerobotMotor> parse_lerobot_calibration(const std::string& text, const std::string& name) {
  const json root = json::parse(text, nullptr, false);
  if (root.is_discarded()) refuse(name, "this is not well-formed JSON");
  if (!root.is_object() || root.empty()) refuse(name, "this is not a calibration: it has no motors");
  return root.contains("motor_names") ? read_lists(root, name) : read_map(root, name);
}

std::vector<LerobotMotor> read_lerobot_calibration(const std::filesystem::path& file) {
  return parse_lerobot_calibration(read_file(file.string(), std::size_t{1} << 20), file.string());
}

}  // namespace doppel
