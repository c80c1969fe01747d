#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "doppel/description/overlay/detail/overlay.h"

namespace doppel {
namespace {

using namespace overlay_detail;

// A plain scalar where YAML reads it back as it is, else in double quotes. `flow`: inside of [] or {}.
std::string scalar(const std::string& text, bool flow = false) {
  const std::string probe = flow ? fmt::format("[{}]", text) : fmt::format("x: {}", text);
  const bool plain = !text.empty() && text.find_first_of("\n\t\r\"'\\{}[]&*!|>%@`#") == std::string::npos &&
                     text.front() != ' ' && text.back() != ' ' && text != "~" && text != "null";
  if (plain || number_of(text) || vector_of(text)) {
    try {
      const YAML::Node read = YAML::Load(probe);
      const YAML::Node value = flow ? read[0] : read["x"];
      if (value.IsScalar() && value.Scalar() == text && (!flow || read.size() == 1)) return text;
    } catch (const YAML::Exception&) {
    }
  }
  YAML::Emitter quoted;
  quoted << YAML::DoubleQuoted << text;
  return quoted.c_str();
}

// In degrees where the value is exactly a short number of degrees; a large one with its original unit.
std::string angle(double rad, const LargeAngle* large = nullptr) {
  if (large != nullptr && large->unit.empty()) return number_text(rad);
  if (large != nullptr && large->unit == "m") return number_text(rad) + " m";
  const double degrees = std::round(rad * 180 / std::numbers::pi * 1e6) / 1e6;
  if (degrees != 0 && degrees * (std::numbers::pi / 180) == rad) return number_text(degrees) + " deg";
  return number_text(rad) + (large != nullptr ? " rad" : "");
}

std::string list(const std::vector<std::string>& words) {
  std::string out;
  for (const std::string& word : words) out += (out.empty() ? "" : ", ") + scalar(word, true);
  return "[" + out + "]";
}

std::string vector(const Eigen::Vector3d& v) {
  return list({number_text(v.x()), number_text(v.y()), number_text(v.z())});
}

// The settings beyond one turn, by key and value.
class Large {
 public:
  explicit Large(const std::vector<LargeAngle>& all) : all_(all) {}
  const LargeAngle* find(std::string_view key, double value) const {
    const auto at = std::ranges::find_if(
        all_, [&](const LargeAngle& large) { return large.key == key && large.value == value; });
    return at != all_.end() ? &*at : nullptr;
  }
  std::string angles(std::string_view key, const Eigen::Vector3d& v) const {
    return fmt::format("[{}, {}, {}]", angle(v.x(), find(key, v.x())), angle(v.y(), find(key, v.y())),
                       angle(v.z(), find(key, v.z())));
  }
  // Small limits stay in radians: their last digits may be the correction.
  std::string position(std::string_view key, double value) const {
    const LargeAngle* large = find(key, value);
    return large != nullptr ? angle(value, large) : number_text(value);
  }

 private:
  const std::vector<LargeAngle>& all_;
};

template <class Value, class Write>
std::string map(const std::vector<std::pair<std::string, Value>>& entries, Write write) {
  std::string out;
  for (const auto& [key, value] : entries)
    out += fmt::format("{}{}: {}", out.empty() ? "" : ", ", scalar(key, true), write(value));
  return "{" + out + "}";
}

class SettingLines {
 public:
  explicit SettingLines(std::string& out) : out_(out) {}
  void line(std::string_view key, const std::string& value) { out_ += fmt::format("  {}: {}\n", key, value); }
  void maybe(std::string_view key, const std::optional<double>& value) {
    if (value) line(key, number_text(*value));
  }

 private:
  std::string& out_;
};

void write_settings(const OperationAction& action, const Large& large, SettingLines& out) {
  std::visit(
      Overloaded{
          [&](const SetAxis& a) { out.line("axis", vector(a.axis)); },
          [&](const RotateFrame& a) { out.line("rpy", large.angles("rpy", a.rpy)); },
          [&](const BakeZero& a) { out.line("offset", angle(a.offset, large.find("offset", a.offset))); },
          [&](const SetOrigin& a) {
            if (a.xyz) out.line("xyz", vector(*a.xyz));
            if (a.rpy) out.line("rpy", large.angles("rpy", *a.rpy));
          },
          [&](const SetLimit& a) {
            if (a.lower) out.line("lower", large.position("lower", *a.lower));
            if (a.upper) out.line("upper", large.position("upper", *a.upper));
            out.maybe("effort", a.effort);
            out.maybe("velocity", a.velocity);
          },
          [&](const SetDynamics& a) {
            out.maybe("damping", a.damping);
            out.maybe("friction", a.friction);
          },
          [&](const SetServo& a) {
            for (const ServoField& field : servo_fields()) out.maybe(field.key, a.*field.value);
          },
          [&](const SetJointType& a) { out.line("type", a.type); },
          [&](const SetInertia& a) {
            out.maybe("mass", a.mass);
            if (a.com) out.line("com", vector(*a.com));
            for (const auto& [name, value] : a.components) out.maybe(name, value);
          },
          [&](const ComputeInertia& a) {
            out.maybe("mass", a.mass);
            out.maybe("density", a.density);
          },
          [&](const AttachToWorld& a) {
            if (!a.xyz.isZero()) out.line("xyz", vector(a.xyz));
            if (!a.rpy.isZero()) out.line("rpy", large.angles("rpy", a.rpy));
          },
          [&](const AddMimic& a) {
            out.line("leader", scalar(a.leader));
            if (a.multiplier != 1) out.maybe("multiplier", a.multiplier);
            if (a.offset != 0) out.line("offset", large.position("offset", a.offset));
          },
          [&](const ReplaceCollision& a) { out.line("by", a.by); },
          [&](const SetMeshScale& a) { out.line("scale", vector(a.scale)); },
          [&](const Rename& a) { out.line("to", scalar(a.to)); },
          [&](const AddRos2Control& a) {
            out.line("plugin", scalar(a.plugin));
            out.line("joints", list(a.joints));
            out.line("command_interfaces", list(a.command_interfaces));
            out.line("state_interfaces", list(a.state_interfaces));
            if (!a.params.empty())
              out.line("params", map(a.params, [](const std::string& v) { return scalar(v, true); }));
            if (!a.initial_values.empty()) out.line("initial_values", map(a.initial_values, number_text));
          },
          [](const auto&) {},
      },
      action);
}

}  // namespace

namespace overlay_detail {

std::string to_yaml(const Operation& operation) {
  std::string target = scalar(target_name(operation.action));
  if (const auto* scaling = std::get_if<ScaleMasses>(&operation.action)) target = number_text(scaling->total);
  std::string out = fmt::format("- {}: {}\n", operation_name(operation.action), target);
  SettingLines lines(out);
  write_settings(operation.action, Large(operation.beyond_a_turn), lines);
  if (!operation.why.empty()) lines.line("why", scalar(operation.why));
  if (operation.evidence.size() == 1) lines.line("evidence", scalar(operation.evidence.front()));
  if (operation.evidence.size() > 1) {
    out += "  evidence:\n";
    for (const std::string& evidence : operation.evidence) out += fmt::format("    - {}\n", scalar(evidence));
  }
  if (!operation.was.empty())
    lines.line("was", map(operation.was, [](const std::string& v) { return scalar(v, true); }));
  return out;
}

}  // namespace overlay_detail

std::string to_yaml(const Overlay& overlay) {
  std::string out;
  for (const Operation& operation : overlay.operations) {
    if (!out.empty()) out += '\n';
    out += overlay_detail::to_yaml(operation);
  }
  return out;
}

}  // namespace doppel
