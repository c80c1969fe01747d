#include "doppel/review/audit/detail/datasheet.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/names.h"
#include "doppel/base/core/text.h"
#include "doppel/base/core/yaml_fix.h"
#include "doppel/base/math/units.h"
#include "doppel/scenario/resolve/side_files.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using Names = std::vector<std::string>;

struct Unit {
  const char* name;
  double factor;  // value * factor is SI
  bool divides;   // factor / value is SI: seconds for 60 degrees, steps in a turn
};
constexpr double kKilogramForce = 9.80665;  // N, by definition
constexpr double kOunceForce = 0.27801385;  // N

const std::vector<Unit> kTorque = {{"N m", 1, false},
                                   {"N cm", 0.01, false},
                                   {"kg cm", kKilogramForce * 0.01, false},
                                   {"kgf cm", kKilogramForce * 0.01, false},
                                   {"oz in", kOunceForce * 0.0254, false}};
const std::vector<Unit> kForce = {{"N", 1, false}, {"kgf", kKilogramForce, false}};
const std::vector<Unit> kSpeed = {{"rad/s", 1, false},
                                  {"deg/s", kDegree, false},
                                  {"rpm", std::numbers::pi / 30, false},
                                  {"s/60deg", 60 * kDegree, true}};
const std::vector<Unit> kLinearSpeed = {{"m/s", 1, false}, {"mm/s", 1e-3, false}};
const std::vector<Unit> kAngle = {{"rad", 1, false}, {"deg", kDegree, false}};
const std::vector<Unit> kFineAngle = {
    {"rad", 1, false}, {"deg", kDegree, false}, {"arcmin", kDegree / 60, false}};
const std::vector<Unit> kStep = {{"rad", 1, false},
                                 {"deg", kDegree, false},
                                 {"arcmin", kDegree / 60, false},
                                 {"steps/turn", 2 * std::numbers::pi, true}};
const std::vector<Unit> kLength = {{"m", 1, false}, {"mm", 1e-3, false}};
const std::vector<Unit> kMass = {{"kg", 1, false}, {"g", 1e-3, false}};

Datasheet find_datasheet(const fs::path& name, const fs::path& library, bool of_actuator);

class Reader {
 public:
  Reader(const fs::path& file, const fs::path& library) : file_(file), library_(library) {}

  // An arm's sheet names actuators, and no other arm: sheets that name each other would never end.
  Datasheet read(bool of_actuator) {
    const YAML::Node root = load();
    if (!root.IsMap()) refuse(root, "a datasheet is a map of names and values");
    Datasheet out;
    out.file = file_;
    if (root["actuator"]) {
      out.actuator = actuator(root);
      out.name = out.actuator->name;
    } else if (root["joints"]) {
      if (!of_actuator) arm(root, out);
    } else {
      refuse(root,
             "this is neither an actuator datasheet ('actuator: NAME') nor an arm datasheet ('joints: ...')");
    }
    return out;
  }

 private:
  [[noreturn]] void refuse(const YAML::Node& at, const std::string& message, std::string fix = "") const {
    throw InputError("datasheet.invalid", place(at), message, std::move(fix));
  }
  [[nodiscard]] SourceLocation place(const YAML::Node& at) const {
    const YAML::Mark mark = at.Mark();
    if (mark.line < 0) return make_location(file_.string());
    return make_location(file_.string(), mark.line + 1, mark.column + 1);
  }

  [[nodiscard]] YAML::Node load() const {
    std::string written;
    try {
      written = read_side_file(file_).text;
    } catch (const InputError& error) {
      throw InputError("datasheet.invalid", make_location(file_.string()),
                       "this datasheet cannot be read: " + error.diagnostics().front().message);
    }
    try {
      return YAML::Load(written);
    } catch (const YAML::Exception& error) {
      throw InputError("datasheet.invalid",
                       make_location(file_.string(), error.mark.line + 1, error.mark.column + 1),
                       "this is not valid YAML: " + error.msg, yaml_fix(error.msg));
    }
  }

  void only(const YAML::Node& map, const Names& keys) const {
    for (const auto& entry : map) {
      const auto key = text(entry.first);
      if (std::find(keys.begin(), keys.end(), key) != keys.end()) continue;
      refuse(entry.first, fmt::format("unknown key '{}'{}", key, did_you_mean(key, keys)));
    }
  }
  [[nodiscard]] std::string text(const YAML::Node& node) const {
    if (!node.IsScalar()) refuse(node, "a text or a number is expected here");
    return node.Scalar();
  }
  [[nodiscard]] int count(const YAML::Node& node) const {
    constexpr int kMaxCount = 1'000;
    const double value = number(node);
    if (value > kMaxCount || value != std::floor(value))
      refuse(node, fmt::format("'{}' is not a whole number up to {}", text(node), kMaxCount));
    return static_cast<int>(value);
  }
  [[nodiscard]] double number(const YAML::Node& node) const {
    const std::string written = text(node);
    double value = 0;
    const auto [end, error] = std::from_chars(written.data(), written.data() + written.size(), value);
    if (error != std::errc() || end != written.data() + written.size() || !(value > 0)) {
      refuse(node, fmt::format("'{}' is not a positive number", written));
    }
    return value;
  }
  [[nodiscard]] YAML::Node required(const YAML::Node& map, const char* key) const {
    if (!map.IsMap()) refuse(map, fmt::format("a map with '{}' is expected here", key));
    const YAML::Node node = map[key];
    if (!node) refuse(map, fmt::format("'{}' is missing", key));
    return node;
  }

  // {value: 36, unit: kg cm}
  [[nodiscard]] double quantity(const YAML::Node& map, const std::vector<Unit>& units,
                                std::string* written = nullptr) const {
    const double value = number(required(map, "value"));
    const YAML::Node unit_node = required(map, "unit");
    const std::string unit = text(unit_node);
    Names known;
    for (const Unit& candidate : units) {
      known.emplace_back(candidate.name);
      if (unit != candidate.name) continue;
      if (written != nullptr) *written = fmt::format("{:g} {}", value, unit);
      return candidate.divides ? candidate.factor / value : candidate.factor * value;
    }
    refuse(unit_node, fmt::format("unknown unit '{}' for this quantity{}", unit, did_you_mean(unit, known)),
           fmt::format("write one of: {}", fmt::join(known, ", ")));
  }

  [[nodiscard]] std::vector<RatedValue> rows(const YAML::Node& list, const std::vector<Unit>& units) const {
    std::vector<RatedValue> out;
    if (!list) return out;
    if (!list.IsSequence()) refuse(list, "a list of {voltage, value, unit} is expected here");
    for (const YAML::Node& row : list) {
      only(row, {"voltage", "value", "unit"});
      RatedValue value;
      value.voltage = number(required(row, "voltage"));
      value.value = quantity(row, units, &value.written);
      value.written += fmt::format(" at {:g} V", value.voltage);
      out.push_back(std::move(value));
    }
    std::sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.voltage < b.voltage; });
    return out;
  }

  [[nodiscard]] ActuatorSheet actuator(const YAML::Node& root) const {
    only(root, {"actuator", "type", "stall_torque", "no_load_speed", "travel", "gear_reduction", "mass",
                "resolution", "backlash", "noise", "source"});
    ActuatorSheet out;
    out.file = file_;
    out.name = text(root["actuator"]);
    if (const YAML::Node type = root["type"]) {
      const Names known{"rotary", "linear"};
      const std::string name = text(type);
      if (name != "rotary" && name != "linear") {
        refuse(type, fmt::format("an actuator cannot be '{}'{}", name, did_you_mean(name, known)));
      }
      out.linear = name == "linear";
    }
    out.stall_torque = rows(root["stall_torque"], out.linear ? kForce : kTorque);
    out.no_load_speed = rows(root["no_load_speed"], out.linear ? kLinearSpeed : kSpeed);
    if (root["travel"]) out.travel = quantity(root["travel"], out.linear ? kLength : kAngle);
    if (root["gear_reduction"]) out.gear_reduction = number(root["gear_reduction"]);
    if (root["resolution"]) out.resolution = quantity(root["resolution"], out.linear ? kLength : kStep);
    if (root["backlash"]) out.backlash = quantity(root["backlash"], out.linear ? kLength : kFineAngle);
    if (root["noise"]) out.noise = quantity(root["noise"], out.linear ? kLength : kFineAngle);
    if (root["mass"]) out.mass = quantity(root["mass"], kMass);
    const YAML::Node source = required(root, "source");
    out.source = fmt::format("{}, {}, read {}", text(required(source, "title")),
                             text(required(source, "url")), text(required(source, "date")));
    return out;
  }

  void arm(const YAML::Node& root, Datasheet& out) const {
    only(root, {"arm", "voltage", "joints"});
    out.name = root["arm"] ? text(root["arm"]) : file_.stem().string();
    std::optional<double> voltage;
    if (root["voltage"]) voltage = number(root["voltage"]);
    if (!root["joints"].IsMap()) refuse(root["joints"], "'joints' maps each joint's name to its actuator");
    for (const auto& entry : root["joints"]) {
      JointDrive drive;
      drive.joint = text(entry.first);
      drive.source = place(entry.first);
      drive.voltage = voltage;
      YAML::Node name = entry.second;
      if (entry.second.IsMap()) {
        only(entry.second, {"actuator", "voltage", "reduction", "count"});
        name.reset(required(entry.second, "actuator"));  // assigning would write into the file's tree
        if (entry.second["voltage"]) drive.voltage = number(entry.second["voltage"]);
        if (entry.second["reduction"]) drive.reduction = number(entry.second["reduction"]);
        if (entry.second["count"]) drive.count = count(entry.second["count"]);
      }
      drive.actuator = named(name);
      out.drives.push_back(std::move(drive));
    }
  }

  [[nodiscard]] ActuatorSheet named(const YAML::Node& node) const {
    const std::string name = text(node);
    const fs::path beside = file_.parent_path() / name;
    std::error_code ignored;
    const bool is_file = fs::is_regular_file(beside, ignored);
    Datasheet sheet;
    try {
      sheet = find_datasheet(is_file ? beside : fs::path(name), library_, true);
    } catch (const InputError& error) {
      if (error.diagnostics().front().where.known()) throw;
      refuse(node, error.diagnostics().front().message, error.diagnostics().front().fix);
    }
    if (!sheet.actuator) refuse(node, fmt::format("'{}' is not an actuator datasheet", name));
    return *sheet.actuator;
  }

  fs::path file_, library_;
};

Datasheet find_datasheet(const fs::path& name, const fs::path& library, bool of_actuator) {
  std::error_code ignored;
  if (fs::exists(name, ignored)) return Reader(name, library).read(of_actuator);
  Names known;
  for (const auto& entry : fs::directory_iterator(library, ignored)) {
    if (entry.path().extension() != ".yaml") continue;
    const std::string stem = entry.path().stem().string();
    if (lowered(stem) == lowered(name.string())) return Reader(entry.path(), library).read(of_actuator);
    known.push_back(stem);
  }
  std::sort(known.begin(), known.end());
  throw InputError(
      "datasheet.not_found", {},
      fmt::format("there is no datasheet '{}', neither as a file nor in the library{}", name.string(),
                  did_you_mean(name.string(), known)),
      "write the sheet into a YAML file ('doppel man datasheets.md'), or choose one of the library");
}

}  // namespace

std::optional<RatedValue> rated(const std::vector<RatedValue>& rows, std::optional<double> voltage) {
  if (rows.empty()) return std::nullopt;
  const auto by_value = [](const auto& a, const auto& b) { return a.value < b.value; };
  if (!voltage) return *std::max_element(rows.begin(), rows.end(), by_value);
  if (*voltage <= rows.front().voltage) return rows.front();
  for (std::size_t i = 1; i < rows.size(); ++i) {
    const RatedValue &a = rows[i - 1], &b = rows[i];
    if (*voltage > b.voltage) continue;
    if (*voltage == b.voltage) return b;
    const double share = (*voltage - a.voltage) / (b.voltage - a.voltage);
    return RatedValue{*voltage, a.value + share * (b.value - a.value),
                      fmt::format("between {} and {}", a.written, b.written)};
  }
  return rows.back();
}

Datasheet load_datasheet(const fs::path& name, const fs::path& library) {
  return find_datasheet(name, library, false);
}

}  // namespace doppel
