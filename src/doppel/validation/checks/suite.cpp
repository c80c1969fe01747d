#include "doppel/validation/checks/suite.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "doppel/base/core/names.h"
#include "doppel/base/math/quantity.h"
#include "doppel/base/yaml/yaml_fields.h"
#include "doppel/validation/checks/check.h"

namespace doppel {
namespace {

const YamlRules kRules{"suite.syntax", "suite.unreadable", "suite.too_large", "suite.invalid",
                       "suite.unknown_key"};

// A date "2027-06-01".
bool is_date(const std::string& text) {
  int year = 0, month = 0, day = 0, end = 0;
  return text.size() == 10 && std::sscanf(text.c_str(), "%4d-%2d-%2d%n", &year, &month, &day, &end) == 3 &&
         end == 10 && month >= 1 && month <= 12 && day >= 1 && day <= 31;
}

class SuiteReader {
 public:
  Suite read(const std::filesystem::path& file) {
    out_.file = file;
    const PlacedYaml root = load_yaml(file, kRules, "suite file");
    const std::vector<std::string> keys = {"workspace",    "tool",           "poses",    "step_response",
                                           "reachability", "self_collision", "coverage", "drop",
                                           "datasheet",    "waive",          "contact",  "supply"};
    if (fields_.fields(root, "the suite", keys)) {
      if (const PlacedYaml& value = root["workspace"]) read_workspace(value);
      if (const PlacedYaml& value = root["tool"]) read_tool(value);
      if (const PlacedYaml& value = root["poses"]) read_poses(value);
      if (const PlacedYaml& value = root["step_response"]) read_steps(value);
      if (const PlacedYaml& value = root["drop"]) read_drop(value);
      if (const PlacedYaml& value = root["contact"]) read_contact(value);
      if (const PlacedYaml& value = root["supply"]) read_supply(value);
      read_shares(root);
      if (const PlacedYaml& value = root["datasheet"]) {
        const std::filesystem::path name = fields_.text(value, "datasheet");
        out_.datasheet = name.is_absolute() || !name.has_extension() ? name : file.parent_path() / name;
      }
      if (const PlacedYaml& value = root["waive"]) read_waivers(value);
    }
    fields_.errors().throw_if_errors();
    return std::move(out_);
  }

 private:
  // A positive quantity, or not negative with `zero`.
  double quantity(const PlacedYaml& value, const std::string& what, QuantityKind kind, bool zero = false) {
    const auto number = value.is_scalar() ? parse_quantity(value.text, kind) : std::nullopt;
    if (!number) {
      fields_.error(value, fmt::format("{} must be a number with a unit", what),
                    fmt::format("for example {}", example_of(kind)));
      return 1;
    }
    if (*number < 0 || (*number == 0 && !zero))
      fields_.error(value, fmt::format("{} must be {}", what, zero ? "zero or more" : "more than zero"));
    return *number;
  }

  void read_quantity(const PlacedYaml& map, const char* key, QuantityKind kind, double& out) {
    if (const PlacedYaml& value = map[key]) out = quantity(value, key, kind);
  }

  Eigen::Vector3d point(const PlacedYaml& value, const std::string& what) {
    Eigen::Vector3d out = Eigen::Vector3d::Zero();
    if (!value.is_list() || value.items.size() != 3) {
      fields_.error(value, what + " must be a list of three lengths");
      return out;
    }
    for (std::size_t i = 0; i < 3; ++i) {
      const auto number = value.items[i].is_scalar()
                              ? parse_quantity(value.items[i].text, QuantityKind::length)
                              : std::nullopt;
      if (!number) fields_.error(value.items[i], what + " must be a list of three lengths");
      out[static_cast<Eigen::Index>(i)] = number.value_or(0);
    }
    return out;
  }

  void read_workspace(const PlacedYaml& value) {
    if (!fields_.fields(value, "workspace", {"frame", "box", "step", "directions"})) return;
    WorkspaceBox& box = out_.workspace.emplace();
    if (const PlacedYaml& frame = value["frame"]) box.frame = fields_.text(frame, "frame");
    const PlacedYaml& corners = value["box"];
    if (!corners.is_list() || corners.items.size() != 2) {
      fields_.error(corners ? corners : value, "workspace needs a box of two corners",
                    "box: [[-0.3, 0.05, 0.0], [0.3, 0.35, 0.4]]");
    } else {
      box.low = point(corners.items[0], "a corner of the box");
      box.high = point(corners.items[1], "a corner of the box");
      if (!(box.low.array() < box.high.array()).all())
        fields_.error(corners, "the first corner of the box must be below the second one in x, y and z");
    }
    read_quantity(value, "step", QuantityKind::length, box.step);
    constexpr double kMaxCells = 2e6;
    const Eigen::Vector3d cells = (box.high - box.low) / box.step;
    if (cells.prod() > kMaxCells)
      fields_.error(value["step"] ? value["step"] : value,
                    "the box has more than 2 million cells of this step", "use a larger step");
    if (const PlacedYaml& directions = value["directions"]) {
      const double count = fields_.number(directions, "directions");
      constexpr double kMaxDirections = 1000;
      if (count < 1 || count > kMaxDirections || count != std::floor(count))
        fields_.error(directions, "directions must be a whole number from 1 to 1000");
      box.directions = static_cast<int>(std::clamp(count, 1.0, kMaxDirections));
    }
  }

  void read_tool(const PlacedYaml& value) {
    if (!fields_.fields(value, "tool", {"link", "payload"})) return;
    if (const PlacedYaml& link = value["link"]) out_.tool.link = fields_.text(link, "link");
    const PlacedYaml& payload = value["payload"];
    if (!payload || !fields_.fields(payload, "payload", {"mass", "at"})) return;
    if (!payload["mass"])
      fields_.error(payload, "payload needs a mass", "payload: {mass: 0.2 kg, at: [0, 0, 0.06]}");
    if (const PlacedYaml& mass = payload["mass"])
      out_.tool.mass = quantity(mass, "mass", QuantityKind::mass, true);
    if (const PlacedYaml& place = payload["at"]) out_.tool.p_LoC_L = point(place, "at");
  }

  void read_poses(const PlacedYaml& value) {
    if (!value.is_map()) return fields_.error(value, "poses must be a map of names");
    for (std::size_t i = 0; i < value.keys.size(); ++i) {
      const PlacedYaml& joints = value.items[i];
      if (!joints.is_map()) {
        fields_.error(joints, "a pose must be a map from joints to positions");
        continue;
      }
      for (std::size_t k = 0; k < joints.keys.size(); ++k) {
        const auto number = joints.items[k].is_scalar()
                                ? parse_quantity(joints.items[k].text, QuantityKind::position)
                                : std::nullopt;
        if (!number)
          fields_.error(joints.items[k], "a position must be a number with a unit, for example 90 deg");
        out_.poses[value.keys[i].text][joints.keys[k].text] = number.value_or(0);
      }
    }
  }

  void read_step(const PlacedYaml& value, StepResponseLimits& limits) {
    if (const PlacedYaml& size = value["size"]) {
      limits.size = quantity(size, "size", QuantityKind::position);
      limits.slide_size = limits.size;
    }
    read_quantity(value, "overshoot", QuantityKind::share, limits.overshoot);
    read_quantity(value, "settling", QuantityKind::time, limits.settling);
    if (const PlacedYaml& error = value["error"]) {
      limits.error = quantity(error, "error", QuantityKind::position);
      limits.slide_error = limits.error;
    }
  }

  // Keys besides the limits are joints with limits of their own.
  void read_steps(const PlacedYaml& value) {
    const std::vector<std::string> limits = {"size", "overshoot", "settling", "error"};
    if (!value.is_map()) return fields_.error(value, "step_response must be a map");
    read_step(value, out_.step);
    for (std::size_t i = 0; i < value.keys.size(); ++i) {
      const std::string& name = value.keys[i].text;
      if (std::ranges::find(limits, name) != limits.end()) continue;
      if (!value.items[i].is_map()) {
        fields_.error(value.keys[i],
                      fmt::format("step_response has no key '{}'{}", name, did_you_mean(name, limits)),
                      "limits of one joint are a map: \"Revolute 8\": {size: 0.3 rad}");
        continue;
      }
      StepResponseLimits& of_joint = out_.joint_steps.emplace(name, out_.step).first->second;
      if (fields_.fields(value.items[i], name, limits)) read_step(value.items[i], of_joint);
    }
  }

  void read_drop(const PlacedYaml& value) {
    DropLimits& drop = out_.drop;
    if (!fields_.fields(value, "drop", {"settling", "penetration", "deepest", "energy", "rebound", "spread"}))
      return;
    read_quantity(value, "settling", QuantityKind::time, drop.settling);
    read_quantity(value, "penetration", QuantityKind::length, drop.penetration);
    read_quantity(value, "deepest", QuantityKind::length, drop.deepest);
    read_quantity(value, "energy", QuantityKind::share, drop.energy);
    read_quantity(value, "rebound", QuantityKind::share, drop.rebound);
    read_quantity(value, "spread", QuantityKind::length, drop.spread);
  }

  void read_contact(const PlacedYaml& value) {
    if (!value.is_map()) return fields_.error(value, "contact must be a map of regions of the body");
    for (std::size_t i = 0; i < value.keys.size(); ++i) {
      const PlacedYaml& entry = value.items[i];
      if (!fields_.fields(entry, "a region", {"force", "stiffness", "mass"})) continue;
      ContactRegion& region = out_.contact[value.keys[i].text];
      for (const char* key : {"force", "stiffness", "mass"})
        if (!entry[key])
          fields_.error(entry, fmt::format("a region needs a {}", key),
                        "hand: {force: 140 N, stiffness: 75 N/mm, mass: 0.6 kg}");
      read_quantity(entry, "force", QuantityKind::force, region.force);
      read_quantity(entry, "stiffness", QuantityKind::stiffness, region.stiffness);
      read_quantity(entry, "mass", QuantityKind::mass, region.mass);
    }
  }

  void read_supply(const PlacedYaml& value) {
    if (!fields_.fields(value, "supply", {"voltage", "current", "efficiency"})) return;
    PowerSupply& supply = out_.supply.emplace();
    for (const char* key : {"voltage", "current"})
      if (!value[key])
        fields_.error(value, fmt::format("supply needs a {}", key),
                      "supply: {voltage: 5 V, current: 10 A, efficiency: 60 %}");
    read_quantity(value, "voltage", QuantityKind::voltage, supply.voltage);
    read_quantity(value, "current", QuantityKind::current, supply.current);
    read_quantity(value, "efficiency", QuantityKind::share, supply.efficiency);
    if (supply.efficiency > 1) fields_.error(value["efficiency"], "efficiency must be at most 100 %");
  }

  void read_shares(const PlacedYaml& root) {
    if (const PlacedYaml& value = root["reachability"];
        value && fields_.fields(value, "reachability", {"max_missed"}))
      read_quantity(value, "max_missed", QuantityKind::share, out_.max_missed);
    if (const PlacedYaml& value = root["self_collision"];
        value && fields_.fields(value, "self_collision", {"max_share"}) && value["max_share"])
      out_.max_share = quantity(value["max_share"], "max_share", QuantityKind::share, true);
    if (const PlacedYaml& value = root["coverage"];
        value && fields_.fields(value, "coverage", {"min_seen"}) && value["min_seen"])
      out_.min_seen = quantity(value["min_seen"], "min_seen", QuantityKind::share, true);
  }

  void read_waivers(const PlacedYaml& value) {
    if (!value.is_list()) return fields_.error(value, "waive must be a list");
    for (const PlacedYaml& entry : value.items) {
      if (!fields_.fields(entry, "a waiver", {"gate", "test", "check", "link", "joint", "why", "until"}))
        continue;
      Waiver& waiver = out_.waivers.emplace_back();
      waiver.where = entry.where;
      for (const char* key : {"gate", "test", "check"})
        if (const PlacedYaml& id = entry[key]) read_check(id, waiver);
      for (const char* key : {"link", "joint"})
        if (const PlacedYaml& subject = entry[key]) waiver.subject = fields_.text(subject, key);
      if (waiver.check.empty()) fields_.error(entry, "a waiver needs a gate or a test", "gate: G05");
      if (!entry["why"]) {
        fields_.error(entry, "a waiver needs a reason", "why: \"scan of the real base\"");
      } else {
        waiver.why = fields_.text(entry["why"], "why");
      }
      if (const PlacedYaml& until = entry["until"]) {
        waiver.until = fields_.text(until, "until");
        if (!is_date(waiver.until)) fields_.error(until, "until must be a date", "until: 2027-06-01");
      }
    }
  }

  void read_check(const PlacedYaml& value, Waiver& waiver) {
    waiver.check = fields_.text(value, "gate");
    if (find_check(waiver.check) != nullptr) return;
    std::vector<std::string> ids;
    for (const CheckInfo& info : check_table()) ids.emplace_back(info.id);
    fields_.error(
        value, fmt::format("there is no gate or test '{}'{}", waiver.check, did_you_mean(waiver.check, ids)));
  }

  YamlFields fields_{kRules};
  Suite out_;
};

}  // namespace

Suite load_suite(const std::filesystem::path& file) {
  return SuiteReader().read(file);
}

}  // namespace doppel
