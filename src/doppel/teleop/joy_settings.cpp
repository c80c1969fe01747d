#include "app/verbs/joy_settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "app/verbs/joystick.h"
#include "app/verbs/shell.h"
#include "doppel/bus/bus.h"
#include "doppel/bus/parameter_file.h"

namespace doppel::app {
namespace {

constexpr const char *kJoyNode = "joy_node", *kTwistJoyNode = "teleop_twist_joy_node";
constexpr auto kAskTime = std::chrono::seconds(30);
constexpr auto kHoldTime = std::chrono::milliseconds(300);
constexpr double kFarFromRest = 0.6;  // of an axis' range

using SteadyTime = std::chrono::steady_clock::time_point;

void declare_joy(Node& node, ParameterOverrides& written, JoySettings& settings) {
  Parameters& parameters = node.parameters();
  settings.deadzone =
      declare<double>(parameters, &written, "deadzone", settings.deadzone, {.range = ParameterRange{0, 0.9}});
  settings.autorepeat_rate = declare<double>(parameters, &written, "autorepeat_rate",
                                             settings.autorepeat_rate, {.range = ParameterRange{0, 1000}});
  // Of joy_node; the device is an option of the verb.
  declare<std::int64_t>(parameters, &written, "device_id", 0);
  declare<std::string>(parameters, &written, "device_name", "");
  declare<bool>(parameters, &written, "sticky_buttons", false);
  declare<std::int64_t>(parameters, &written, "coalesce_interval_ms", 1);
}

void declare_twist_joy(Node& node, ParameterOverrides& written, JoySettings& settings) {
  Parameters& parameters = node.parameters();
  settings.require_enable_button =
      declare<bool>(parameters, &written, "require_enable_button", settings.require_enable_button);
  settings.inverted_reverse =
      declare<bool>(parameters, &written, "inverted_reverse", settings.inverted_reverse);
  settings.enable_button =
      declare<std::int64_t>(parameters, &written, "enable_button", settings.enable_button);
  settings.enable_turbo_button =
      declare<std::int64_t>(parameters, &written, "enable_turbo_button", settings.enable_turbo_button);
  const auto declare_map = [&](const char* group, auto& map) {
    for (auto& [component, value] : map)
      value = declare<std::decay_t<decltype(value)>>(parameters, &written,
                                                     fmt::format("{}.{}", group, component), value);
  };
  declare_map("axis_linear", settings.axis_linear);
  declare_map("axis_angular", settings.axis_angular);
  declare_map("scale_linear", settings.scale_linear);
  declare_map("scale_linear_turbo", settings.scale_linear_turbo);
  declare_map("scale_angular", settings.scale_angular);
  declare_map("scale_angular_turbo", settings.scale_angular_turbo);
  // The type follows the topic.
  declare<bool>(parameters, &written, "publish_stamped_twist", false);
  declare<std::string>(parameters, &written, "frame", "teleop_twist_joy");
}

bool pressed(const std::vector<bool>& buttons, std::int64_t button) {
  return button >= 0 && button < static_cast<std::int64_t>(buttons.size()) &&
         buttons[static_cast<std::size_t>(button)];
}

void check_plugged(const Joystick& joystick) {
  if (joystick.has_ended()) throw ClientError("the joystick has been unplugged");
}

void settle(Joystick& joystick) {
  const SteadyTime end = std::chrono::steady_clock::now() + kHoldTime;
  while (std::chrono::steady_clock::now() < end && !joystick.has_ended()) joystick.wait(end);
}

// The axis that is moved, and its sign in that direction.
std::pair<std::int64_t, double> ask_axis(Joystick& joystick, const char* what) {
  print_note(fmt::format("{}: move the stick there and hold it ...", what));
  settle(joystick);
  const std::vector<double> rest = joystick.axes();
  const SteadyTime end = std::chrono::steady_clock::now() + kAskTime;
  while (std::chrono::steady_clock::now() < end) {
    joystick.wait(end);
    check_plugged(joystick);
    for (std::size_t i = 0; i < joystick.axes().size(); ++i) {
      const double moved = joystick.axes()[i] - (i < rest.size() ? rest[i] : 0.0);
      if (std::abs(moved) < kFarFromRest) continue;
      print_note(fmt::format("  axis {}; release it", i));
      settle(joystick);
      settle(joystick);
      return {static_cast<std::int64_t>(i), moved > 0 ? 1.0 : -1.0};
    }
  }
  throw ClientError("no axis was moved within 30 s");
}

std::int64_t ask_button(Joystick& joystick, const char* what) {
  print_note(fmt::format("{}: press it ...", what));
  settle(joystick);
  const std::vector<bool> before = joystick.buttons();
  const SteadyTime end = std::chrono::steady_clock::now() + kAskTime;
  while (std::chrono::steady_clock::now() < end) {
    joystick.wait(end);
    check_plugged(joystick);
    for (std::size_t i = 0; i < joystick.buttons().size(); ++i) {
      if (!joystick.buttons()[i] || (i < before.size() && before[i])) continue;
      print_note(fmt::format("  button {}", i));
      return static_cast<std::int64_t>(i);
    }
  }
  throw ClientError("no button was pressed within 30 s");
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

JoySettings read_joy_settings(const std::filesystem::path& file) {
  const ParameterFile yaml = ParameterFile::load(file);
  JoySettings settings;
  Bus bus;
  Node joy(bus, fmt::format("/{}", kJoyNode)), twist(bus, fmt::format("/{}", kTwistJoyNode));
  Diagnostics diagnostics;
  ParameterOverrides of_joy = yaml.overrides_for(joy.name()), of_twist = yaml.overrides_for(twist.name());
  declare_joy(joy, of_joy, settings);
  declare_twist_joy(twist, of_twist, settings);
  report_unused(of_joy, kJoyNode, joy.parameters().names(), diagnostics);
  report_unused(of_twist, kTwistJoyNode, twist.parameters().names(), diagnostics);
  for (const Diagnostic& finding : diagnostics.all()) print_note(finding.str());
  return settings;
}

std::filesystem::path own_joy_file() {
  const char* config = std::getenv("XDG_CONFIG_HOME");
  const char* home = std::getenv("HOME");
  const std::filesystem::path folder = config != nullptr && *config != '\0'
                                           ? std::filesystem::path(config)
                                           : std::filesystem::path(home == nullptr ? "" : home) / ".config";
  return folder / "doppel" / "joy.yaml";
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

bool is_enabled(const JoySettings& settings, const std::vector<bool>& buttons) {
  return pressed(buttons, settings.enable_turbo_button) || !settings.require_enable_button ||
         pressed(buttons, settings.enable_button);
}

geometry_msgs::msg::Twist joy_twist(const JoySettings& settings, const std::vector<double>& axes,
                                    const std::vector<bool>& buttons) {
  if (!is_enabled(settings, buttons)) return {};
  const bool turbo = pressed(buttons, settings.enable_turbo_button);
  const auto& linear = turbo ? settings.scale_linear_turbo : settings.scale_linear;
  const auto& angular = turbo ? settings.scale_angular_turbo : settings.scale_angular;
  const auto value = [&](const auto& axis_of, const auto& scale_of, const char* component) {
    const std::int64_t axis = axis_of.at(component);
    if (axis < 0 || axis >= static_cast<std::int64_t>(axes.size())) return 0.0;
    return axes[static_cast<std::size_t>(axis)] * scale_of.at(component);
  };
  geometry_msgs::msg::Twist twist{
      {value(settings.axis_linear, linear, "x"), value(settings.axis_linear, linear, "y"),
       value(settings.axis_linear, linear, "z")},
      {value(settings.axis_angular, angular, "roll"), value(settings.axis_angular, angular, "pitch"),
       value(settings.axis_angular, angular, "yaw")}};
  if (settings.inverted_reverse && twist.linear.x < 0) twist.angular.z = -twist.angular.z;
  return twist;
}

JoySettings calibrate_joystick(Joystick& joystick, JoySettings settings) {
  const auto take = [](const std::pair<std::int64_t, double>& moved, std::int64_t& axis, double& scale,
                       double& turbo) {
    axis = moved.first;
    scale = std::copysign(scale, moved.second);
    turbo = std::copysign(turbo, moved.second);
  };
  take(ask_axis(joystick, "forward"), settings.axis_linear["x"], settings.scale_linear["x"],
       settings.scale_linear_turbo["x"]);
  take(ask_axis(joystick, "turn to the left"), settings.axis_angular["yaw"], settings.scale_angular["yaw"],
       settings.scale_angular_turbo["yaw"]);
  settings.enable_button = ask_button(joystick, "the button that has to be held to drive");
  settle(joystick);
  settings.enable_turbo_button = ask_button(joystick, "the button to be held to drive fast");
  return settings;
}

}  // namespace doppel::app
