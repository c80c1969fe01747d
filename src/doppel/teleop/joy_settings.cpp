#include "doppel/teleop/joy_settings.h"

#include <fmt/format.h>

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

template <class Map>
std::string flow_map(const Map& map) {
  std::string out;
  for (const auto& [component, value] : map) {
    const bool is_whole = std::is_same_v<std::decay_t<decltype(value)>, std::int64_t>;
    out +=
        fmt::format("{}{}: {}", out.empty() ? "" : ", ", component,
                    is_whole ? fmt::format("{}", value) : fmt::format("{:#.6g}", static_cast<double>(value)));
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
  declare<bool>(node.parameters(), &written, "publish_stamped_twist", stamped,
                {.description = "Whether TwistStamped is published instead of Twist", .read_only = true});
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
  return fmt::format(
      "{}:\n  ros__parameters:\n    deadzone: {:#.6g}\n    autorepeat_rate: {:#.6g}\n{}:\n  "
      "ros__parameters:\n"
      "    require_enable_button: {}\n    enable_button: {}\n    enable_turbo_button: {}\n    axis_linear: "
      "{}\n"
      "    axis_angular: {}\n    scale_linear: {}\n    scale_linear_turbo: {}\n    scale_angular: {}\n"
      "    scale_angular_turbo: {}\n",
      kJoyNode, s.deadzone, s.autorepeat_rate, kTwistJoyNode, s.require_enable_button, s.enable_button,
      s.enable_turbo_button, flow_map(s.axis_linear), flow_map(s.axis_angular), flow_map(s.scale_linear),
      flow_map(s.scale_linear_turbo), flow_map(s.scale_angular), flow_map(s.scale_angular_turbo));
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
