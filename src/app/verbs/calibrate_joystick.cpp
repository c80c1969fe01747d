#include "app/verbs/calibrate_joystick.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <cstdlib>

#include "app/verbs/joystick.h"
#include "app/verbs/shell.h"

namespace doppel::app {
namespace {

constexpr auto kAskTime = std::chrono::seconds(30);
constexpr auto kHoldTime = std::chrono::milliseconds(300);
constexpr double kFarFromRest = 0.6;  // of an axis' range

using SteadyTime = std::chrono::steady_clock::time_point;

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
  const std::vector<float> rest = joystick.values().axes;
  const SteadyTime end = std::chrono::steady_clock::now() + kAskTime;
  while (std::chrono::steady_clock::now() < end) {
    joystick.wait(end);
    check_plugged(joystick);
    const std::vector<float> now = joystick.values().axes;
    for (std::size_t i = 0; i < now.size(); ++i) {
      const double moved = now[i] - (i < rest.size() ? rest[i] : 0.0F);
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
  const std::vector<std::int32_t> before = joystick.values().buttons;
  const SteadyTime end = std::chrono::steady_clock::now() + kAskTime;
  while (std::chrono::steady_clock::now() < end) {
    joystick.wait(end);
    check_plugged(joystick);
    const std::vector<std::int32_t> now = joystick.values().buttons;
    for (std::size_t i = 0; i < now.size(); ++i) {
      if (now[i] == 0 || (i < before.size() && before[i] != 0)) continue;
      print_note(fmt::format("  button {}", i));
      return static_cast<std::int64_t>(i);
    }
  }
  throw ClientError("no button was pressed within 30 s");
}

}  // namespace

std::filesystem::path own_joy_file() {
  const char* config = std::getenv("XDG_CONFIG_HOME");
  const char* home = std::getenv("HOME");
  const std::filesystem::path folder = config != nullptr && *config != '\0'
                                           ? std::filesystem::path(config)
                                           : std::filesystem::path(home == nullptr ? "" : home) / ".config";
  return folder / "doppel" / "joy.yaml";
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
