#include "doppel/ros/teleop/joystick_state.h"

#include <linux/input-event-codes.h>
#include <linux/joystick.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace doppel {
namespace {

constexpr double kFullScale = 32767.0;
constexpr std::size_t kHats = (ABS_HAT3Y - ABS_HAT0X + 1) / 2;

bool is_hat(std::uint8_t code) {
  return code >= ABS_HAT0X && code <= ABS_HAT3Y;
}

template <class T>
T& element(std::vector<T>& all, std::size_t at) {
  if (at >= all.size()) all.resize(at + 1);
  return all[at];
}

}  // namespace

std::vector<std::size_t> sdl_axis_places(std::span<const std::uint8_t> codes) {
  std::vector<std::uint8_t> plain;
  std::array<bool, kHats> has_hat{};
  for (const std::uint8_t code : codes) {
    if (is_hat(code)) {
      has_hat[(code - ABS_HAT0X) / std::size_t{2}] = true;
    } else {
      plain.push_back(code);
    }
  }
  std::ranges::sort(plain);
  std::vector<std::size_t> places;
  for (const std::uint8_t code : codes) {
    if (is_hat(code)) {
      const std::size_t offset = code - std::size_t{ABS_HAT0X};
      const auto hats_before =
          std::count(has_hat.begin(), has_hat.begin() + static_cast<int>(offset / 2), true);
      places.push_back(plain.size() + 2 * static_cast<std::size_t>(hats_before) + offset % 2);
    } else {
      places.push_back(static_cast<std::size_t>(std::ranges::lower_bound(plain, code) - plain.begin()));
    }
  }
  return places;
}

JoystickState::JoystickState(std::vector<std::size_t> places, std::size_t axes, std::size_t buttons)
    : places_(std::move(places)), buttons_(buttons) {
  for (const std::size_t place : places_) axes = std::max(axes, place + 1);
  axes_.resize(axes);
}

// As joy_node: the range outside of the dead zone to [-1, 1], inverted, because Linux counts forward and left as
// negative.
float JoystickState::scaled(int raw) const {
  const double part = std::clamp(raw / kFullScale, -1.0, 1.0);
  if (std::abs(part) <= deadzone_) return 0;
  return static_cast<float>(-(part - std::copysign(deadzone_, part)) / (1 - deadzone_));
}

JoystickChange JoystickState::take(std::span<const std::byte> bytes) {
  JoystickChange change;
  rest_.insert(rest_.end(), bytes.begin(), bytes.end());
  std::size_t at = 0;
  for (; at + sizeof(js_event) <= rest_.size(); at += sizeof(js_event)) {
    js_event event{};
    std::memcpy(&event, rest_.data() + at, sizeof(event));
    const int type = event.type & ~JS_EVENT_INIT;
    if (type == JS_EVENT_AXIS) {
      int& axis = element(axes_, event.number < places_.size() ? places_[event.number] : event.number);
      change.axes = change.axes || scaled(axis) != scaled(event.value);
      axis = event.value;
    } else if (type == JS_EVENT_BUTTON) {
      std::int32_t& button = element(buttons_, event.number);
      const std::int32_t before = button;
      const bool is_initial = (event.type & JS_EVENT_INIT) != 0;
      if (!sticky_ || is_initial) {
        button = event.value != 0 ? 1 : 0;
      } else if (event.value != 0) {
        button = 1 - button;
      }
      change.buttons = change.buttons || button != before;
    }
  }
  rest_.erase(rest_.begin(), rest_.begin() + static_cast<std::ptrdiff_t>(at));
  return change;
}

sensor_msgs::msg::Joy JoystickState::values() const {
  sensor_msgs::msg::Joy joy;
  for (const int raw : axes_) joy.axes.push_back(scaled(raw));
  joy.buttons = buttons_;
  return joy;
}

}  // namespace doppel
