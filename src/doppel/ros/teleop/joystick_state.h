#pragma once
// The axes and buttons of a joystick from the events of Linux's joystick interface (linux/joystick.h: 8 bytes each), as
// ROS 2's joy_node publishes them: axes in SDL's order, forward and left positive, between -1 and 1 outside of a dead
// zone.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "doppel/export.h"
#include "doppel/ros/messages/sensor_msgs.h"

namespace doppel {

// For each axis of the kernel its place in SDL's order over evdev (SDL_sysjoystick.c): by ascending codes without the
// hats, then two places for each hat, left and right before up and down. `codes`: of linux/input-event-codes.h, in the
// kernel's order (JSIOCGAXMAP), at most 256.
DOPPEL_API std::vector<std::size_t> sdl_axis_places(std::span<const std::uint8_t> codes);

struct DOPPEL_API JoystickChange {
  bool axes = false, buttons = false;
  [[nodiscard]] bool any() const { return axes || buttons; }
};

class DOPPEL_API JoystickState {
 public:
  // places: of sdl_axis_places(); an axis beyond them keeps its number. Of the device itself, so that axes and buttons
  // exist before they move: `axes` and `buttons`, their numbers.
  explicit JoystickState(std::vector<std::size_t> places = {}, std::size_t axes = 0, std::size_t buttons = 0);

  // deadzone: 0 to below 1, of an axis' range. sticky: a press changes the button's state, a release does not.
  void set_deadzone(double deadzone) { deadzone_ = deadzone; }
  void set_sticky_buttons(bool sticky) { sticky_ = sticky; }

  // The next bytes of the device, of any number; the bytes of an incomplete event are kept. An axis inside of the dead
  // zone does not change.
  JoystickChange take(std::span<const std::byte> bytes);
  // The values without a header.
  [[nodiscard]] sensor_msgs::msg::Joy values() const;

 private:
  [[nodiscard]] float scaled(int raw) const;

  std::vector<std::size_t> places_;
  std::vector<int> axes_;  // as the kernel has them, in SDL's order
  std::vector<std::int32_t> buttons_;
  std::vector<std::byte> rest_;  // of an incomplete event
  double deadzone_ = 0;
  bool sticky_ = false;
};

}  // namespace doppel
