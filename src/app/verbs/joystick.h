#pragma once
// A joystick of Linux (/dev/input/js*), or a recording of its events in a file or a pipe.

#include <chrono>
#include <string>

#include "doppel/ros/teleop/joy_settings.h"
#include "doppel/ros/teleop/joystick_state.h"

namespace doppel::app {

class Joystick {
 public:
  // Throws InputError if the device cannot be opened.
  explicit Joystick(const std::string& device);
  ~Joystick();
  Joystick(const Joystick&) = delete;
  Joystick& operator=(const Joystick&) = delete;

  // The present device that the settings select; throws InputError if there is none.
  static std::string find(const JoySettings& settings);

  // Waits for an event until the time.
  JoystickChange wait(std::chrono::steady_clock::time_point until);
  // The device was unplugged, or the recording has ended.
  [[nodiscard]] bool has_ended() const { return ended_; }
  void use(const JoySettings& settings);  // the dead zone, sticky buttons
  [[nodiscard]] sensor_msgs::msg::Joy values() const { return state_.values(); }

 private:
  int fd_ = -1;
  JoystickState state_;
  bool ended_ = false;
};

}  // namespace doppel::app
