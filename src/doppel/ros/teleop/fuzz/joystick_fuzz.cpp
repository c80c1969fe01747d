// Fuzz target: bytes of a joystick's device, with axes of any codes. Values stay in their range, and their numbers in
// what the interface can name; it does not matter how the bytes are divided.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <span>

#include "doppel/ros/teleop/joystick_state.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 3) return 0;
  constexpr std::size_t kNumbers = 256;  // of axes or buttons, which a byte counts
  const std::size_t codes = std::min<std::size_t>(data[0], size - 3);
  const std::span<const std::uint8_t> all(data + 3, size - 3);
  const auto places = doppel::sdl_axis_places(all.first(codes));
  doppel::JoystickState whole(places), parts(places);
  for (doppel::JoystickState* state : {&whole, &parts}) {
    state->set_deadzone(data[1] / 300.0);
    state->set_sticky_buttons(data[2] % 2 == 1);
  }
  const auto events = std::as_bytes(all.subspan(codes));
  whole.take(events);
  for (std::size_t at = 0; at < events.size(); at += 1 + data[2]) {
    parts.take(events.subspan(at, std::min<std::size_t>(1 + data[2], events.size() - at)));
  }
  const doppel::sensor_msgs::msg::Joy joy = whole.values();
  if (joy.axes != parts.values().axes || joy.buttons != parts.values().buttons) std::abort();
  if (joy.axes.size() > kNumbers + 8 || joy.buttons.size() > kNumbers) std::abort();
  for (const float axis : joy.axes) {
    if (!(axis >= -1 && axis <= 1)) std::abort();
  }
  for (const std::int32_t button : joy.buttons) {
    if (button != 0 && button != 1) std::abort();
  }
  return 0;
}
