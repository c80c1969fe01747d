#include "doppel/ros/teleop/joy_settings.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <type_traits>
#include <utility>

namespace doppel {
namespace {

// Declares a parameter whose later values are stored in `field`, too.
template <class T>
void bind_parameter(Node& node, ParameterOverrides& written, const std::string& name, T& field,
                    DeclareOptions options = {}) {
  field = declare<T>(node.parameters(), &written, name, field, std::move(options));
  node.parameters().on_change([name, &field](const std::string& changed, const ParameterValue& value) {
    if (changed == name) field = std::get<T>(value);
  });
}

template <class Map>
void bind_parameters(Node& node, ParameterOverrides& written, const char* group, Map& values) {
  for (auto& [component, value] : values)
    bind_parameter(node, written, fmt::format("{}.{}", group, component), value);
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

template <class Map>
std::string flow_map(const Map& map) {
  std::string out;
  for (const auto& [component, value] : map) {
    out += fmt::format("{}{}: ", out.empty() ? "" : ", ", component);
    if constexpr (std::is_same_v<std::decay_t<decltype(value)>, std::int64_t>) {
      out += std::to_string(value);
    } else {
      out += yaml_number(value);
    }
  }
  return "{" + out + "}";
}

}  // namespace

void declare_joy(Node& node, ParameterOverrides& written, JoySettings& settings) {
  bind_parameter(
      node, written, "deadzone", settings.deadzone,
      {.description = "Part of an axis' range that counts as its rest", .range = ParameterRange{0, 0.9}});
  bind_parameter(node, written, "autorepeat_rate", settings.autorepeat_rate,
                 {.description = "Hz; 0: only changes are published", .range = ParameterRange{0, 1000}});
  bind_parameter(node, written, "sticky_buttons", settings.sticky_buttons,
                 {.description = "A press changes the state of a button, a release does not"});
  bind_parameter(
      node, written, "coalesce_interval_ms", settings.coalesce_interval_ms,
      {.description = "Time for which further events of axes are awaited", .range = ParameterRange{0, 1000}});
  bind_parameter(
      node, written, "device_id", settings.device_id,
      {.description = "Number of the joystick", .read_only = true, .range = ParameterRange{0, 31}});
  bind_parameter(node, written, "device_name", settings.device_name,
                 {.description = "Name of the joystick", .read_only = true});
}

void declare_twist_joy(Node& node, ParameterOverrides& written, JoySettings& settings, bool stamped) {
  bind_parameter(node, written, "require_enable_button", settings.require_enable_button);
  bind_parameter(node, written, "inverted_reverse", settings.inverted_reverse);
  bind_parameter(node, written, "enable_button", settings.enable_button);
  bind_parameter(node, written, "enable_turbo_button", settings.enable_turbo_button);
  bind_parameters(node, written, "axis_linear", settings.axis_linear);
  bind_parameters(node, written, "axis_angular", settings.axis_angular);
  bind_parameters(node, written, "scale_linear", settings.scale_linear);
  bind_parameters(node, written, "scale_linear_turbo", settings.scale_linear_turbo);
  bind_parameters(node, written, "scale_angular", settings.scale_angular);
  bind_parameters(node, written, "scale_angular_turbo", settings.scale_angular_turbo);
  bind_parameter(node, written, "frame", settings.frame);
  const bool is_written = written.find("publish_stamped_twist") != nullptr;
  const bool value =
      declare<bool>(node.parameters(), &written, "publish_stamped_twist", stamped,
                    {.description = "Whether TwistStamped is published instead of Twist", .read_only = true});
  if (is_written) settings.publish_stamped_twist = value;
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

std::string to_yaml(const JoySettings& s) {
  std::string out;
  const auto node = [&out](const char* name) { out += fmt::format("{}:\n  ros__parameters:\n", name); };
  const auto put = [&out](const char* name, const std::string& value) {
    out += fmt::format("    {}: {}\n", name, value);
  };
  const auto whole = [](std::int64_t value) { return std::to_string(value); };
  const auto truth = [](bool value) { return std::string(value ? "true" : "false"); };
  node(kJoyNode);
  put("device_id", whole(s.device_id));
  put("device_name", yaml_text(s.device_name));
  put("deadzone", yaml_number(s.deadzone));
  put("autorepeat_rate", yaml_number(s.autorepeat_rate));
  put("sticky_buttons", truth(s.sticky_buttons));
  put("coalesce_interval_ms", whole(s.coalesce_interval_ms));
  node(kTwistJoyNode);
  put("require_enable_button", truth(s.require_enable_button));
  put("inverted_reverse", truth(s.inverted_reverse));
  put("enable_button", whole(s.enable_button));
  put("enable_turbo_button", whole(s.enable_turbo_button));
  put("axis_linear", flow_map(s.axis_linear));
  put("axis_angular", flow_map(s.axis_angular));
  put("scale_linear", flow_map(s.scale_linear));
  put("scale_linear_turbo", flow_map(s.scale_linear_turbo));
  put("scale_angular", flow_map(s.scale_angular));
  put("scale_angular_turbo", flow_map(s.scale_angular_turbo));
  put("frame", yaml_text(s.frame));
  if (s.publish_stamped_twist) put("publish_stamped_twist", truth(*s.publish_stamped_twist));
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
