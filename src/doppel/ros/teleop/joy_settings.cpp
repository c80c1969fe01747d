#include "doppel/ros/teleop/joy_settings.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <type_traits>
#include <vector>

#include "doppel/ros/bus/parameter_fields.h"

namespace doppel {
namespace {

// In the order of the file that to_yaml() writes.
std::vector<ParameterField> joy_fields(JoySettings& s) {
  return {{"device_id", &s.device_id, "Number of the joystick", read_only(value_range(0, 31))},
          {"device_name", &s.device_name, "Name of the joystick", read_only()},
          {"deadzone", &s.deadzone, "Part of an axis' range that counts as its rest", value_range(0, 0.9)},
          {"autorepeat_rate", &s.autorepeat_rate, "Hz; 0: only changes are published", value_range(0, 1000)},
          {"sticky_buttons", &s.sticky_buttons, "A press changes the state of a button, a release does not"},
          {"coalesce_interval_ms", &s.coalesce_interval_ms,
           "Time for which further events of axes are awaited", value_range(0, 1000)}};
}

std::vector<ParameterField> twist_joy_fields(JoySettings& s) {
  std::vector<ParameterField> fields{{"require_enable_button", &s.require_enable_button},
                                     {"inverted_reverse", &s.inverted_reverse},
                                     {"enable_button", &s.enable_button},
                                     {"enable_turbo_button", &s.enable_turbo_button}};
  const auto add = [&fields](const char* group, auto& values) {
    for (auto& [component, value] : values)
      fields.push_back({fmt::format("{}.{}", group, component), &value});
  };
  add("axis_linear", s.axis_linear);
  add("axis_angular", s.axis_angular);
  add("scale_linear", s.scale_linear);
  add("scale_linear_turbo", s.scale_linear_turbo);
  add("scale_angular", s.scale_angular);
  add("scale_angular_turbo", s.scale_angular_turbo);
  fields.push_back({"frame", &s.frame});
  return fields;
}

void declare_followed(Node& node, ParameterOverrides& written, const std::vector<ParameterField>& fields) {
  for (const ParameterField& field : fields) {
    declare_field(node.parameters(), &written, field);
    follow_field(node.parameters(), field);
  }
}

bool is_pressed(const sensor_msgs::msg::Joy& joy, std::int64_t button) {
  return button >= 0 && button < static_cast<std::int64_t>(joy.buttons.size()) &&
         joy.buttons[static_cast<std::size_t>(button)] != 0;
}

// ROS 2 does not accept an integer for a number: "20.0". The shortest text that reads back as the same value.
std::string yaml_number(double value) {
  const std::string text = fmt::format("{}", value);
  return text.find_first_not_of("-0123456789") == std::string::npos ? text + ".0" : text;
}

std::string yaml_text(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (static_cast<unsigned char>(c) < 0x20) {
      out += fmt::format("\\x{:02x}", static_cast<int>(c));
      continue;
    }
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + '"';
}

std::string yaml_value(const ParameterMember& member) {
  return std::visit(
      []<class T>(const T* value) {
        if constexpr (std::is_same_v<T, double>) return yaml_number(*value);
        if constexpr (std::is_same_v<T, std::string>) return yaml_text(*value);
        return to_string(ParameterValue(*value));
      },
      member);
}

// The section of a node. "axis_linear.x" and the components after it are one line: "axis_linear: {x: 5, y:
// -1}".
std::string yaml_section(const char* node, const std::vector<ParameterField>& fields) {
  std::string out = fmt::format("{}:\n  ros__parameters:\n", node), open_group;
  for (const ParameterField& field : fields) {
    const std::size_t dot = field.name.find('.');
    const std::string group = dot == std::string::npos ? "" : field.name.substr(0, dot);
    if (!open_group.empty() && group != open_group) out += "}\n";
    if (group.empty()) {
      out += fmt::format("    {}: {}\n", field.name, yaml_value(field.member));
    } else {
      out += group == open_group ? std::string(", ") : fmt::format("    {}: {{", group);
      out += fmt::format("{}: {}", field.name.substr(dot + 1), yaml_value(field.member));
    }
    open_group = group;
  }
  return out;
}

}  // namespace

void declare_joy(Node& node, ParameterOverrides& written, JoySettings& settings) {
  declare_followed(node, written, joy_fields(settings));
}

void declare_twist_joy(Node& node, ParameterOverrides& written, JoySettings& settings, bool stamped) {
  declare_followed(node, written, twist_joy_fields(settings));
  const bool is_written = written.find("publish_stamped_twist") != nullptr;
  declare_field(
      node.parameters(), &written,
      {"publish_stamped_twist", &stamped, "Whether TwistStamped is published instead of Twist", read_only()});
  if (is_written) settings.publish_stamped_twist = stamped;
}

JoySettings read_joy_settings(const std::filesystem::path& file, Diagnostics& diagnostics) {
  const ParameterFile yaml = ParameterFile::load(file);
  JoySettings settings;
  Bus bus;
  Node joy(bus, fmt::format("/{}", kJoyNode)), twist(bus, fmt::format("/{}", kTwistJoyNode));
  ParameterOverrides of_joy = yaml.overrides_for(joy.name()), of_twist = yaml.overrides_for(twist.name());
  declare_joy(joy, of_joy, settings);
  declare_twist_joy(twist, of_twist, settings, false);
  report_unused(of_joy, kJoyNode, joy.parameters().names(), diagnostics);
  report_unused(of_twist, kTwistJoyNode, twist.parameters().names(), diagnostics);
  return settings;
}

std::string to_yaml(const JoySettings& settings) {
  JoySettings s = settings;
  std::string out = yaml_section(kJoyNode, joy_fields(s)) + yaml_section(kTwistJoyNode, twist_joy_fields(s));
  if (s.publish_stamped_twist)
    out += fmt::format("    publish_stamped_twist: {}\n", *s.publish_stamped_twist);
  return out;
}

void check_replaceable(const std::filesystem::path& file) {
  const std::string fix = "write to another file: --config FILE";
  Diagnostics unknown, lost;
  read_joy_settings(file, unknown);
  for (const Diagnostic& one : unknown.all())
    lost.error("teleop.would_be_lost", one.where, one.message + "; it would be lost", fix);
  const std::array<std::string, 4> own{kJoyNode, fmt::format("/{}", kJoyNode), kTwistJoyNode,
                                       fmt::format("/{}", kTwistJoyNode)};
  for (const auto& section : YAML::Load(ParameterFile::load(file).text())) {
    const std::string& key = section.first.Scalar();
    if (std::ranges::find(own, key) != own.end()) continue;
    const YAML::Mark at = section.first.Mark();
    lost.error("teleop.would_be_lost", make_location(file.string(), at.line + 1, at.column + 1),
               fmt::format("the section '{}' would be lost: only {} and {} are written", key, kJoyNode,
                           kTwistJoyNode),
               fix);
  }
  lost.throw_if_errors();
}

std::chrono::steady_clock::time_point next_repetition(const JoySettings& settings,
                                                      std::chrono::steady_clock::time_point last) {
  using Steady = std::chrono::steady_clock;
  constexpr double kSlowest = 1e-9;  // Hz: a longer period is beyond the clock's range
  if (settings.autorepeat_rate < kSlowest) return Steady::time_point::max();
  return last + std::chrono::duration_cast<Steady::duration>(
                    std::chrono::duration<double>(1 / settings.autorepeat_rate));
}

bool is_enabled(const JoySettings& settings, const sensor_msgs::msg::Joy& joy) {
  return is_pressed(joy, settings.enable_turbo_button) || !settings.require_enable_button ||
         is_pressed(joy, settings.enable_button);
}

geometry_msgs::msg::Twist joy_twist(const JoySettings& settings, const sensor_msgs::msg::Joy& joy) {
  if (!is_enabled(settings, joy)) return {};
  const bool turbo = is_pressed(joy, settings.enable_turbo_button);
  const auto& linear = turbo ? settings.scale_linear_turbo : settings.scale_linear;
  const auto& angular = turbo ? settings.scale_angular_turbo : settings.scale_angular;
  const auto value = [&](const auto& axis_of, const auto& scale_of, const char* component) {
    const std::int64_t axis = axis_of.at(component);
    if (axis < 0 || axis >= static_cast<std::int64_t>(joy.axes.size())) return 0.0;
    return static_cast<double>(joy.axes[static_cast<std::size_t>(axis)]) * scale_of.at(component);
  };
  geometry_msgs::msg::Twist twist{
      {value(settings.axis_linear, linear, "x"), value(settings.axis_linear, linear, "y"),
       value(settings.axis_linear, linear, "z")},
      {value(settings.axis_angular, angular, "roll"), value(settings.axis_angular, angular, "pitch"),
       value(settings.axis_angular, angular, "yaw")}};
  if (settings.inverted_reverse && twist.linear.x < 0) twist.angular.z = -twist.angular.z;
  return twist;
}

}  // namespace doppel
