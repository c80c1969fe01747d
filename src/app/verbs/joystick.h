#pragma once
// A joystick of Linux (/dev/input/js*), or a recording of its events in a file or a pipe: 8 bytes each, as in
// linux/joystick.h. Values are those of ROS 2's joy_node: axes in SDL's order with the hats last, forward and left
// positive, between -1 and 1 outside of a dead zone; buttons from 0.

#include <chrono>
#include <string>
#include <vector>

namespace doppel::app {

class Joystick {
 public:
  // Throws InputError if the device cannot be opened. deadzone: 0 to below 1, of an axis' range.
  Joystick(const std::string& device, double deadzone);
  ~Joystick();
  Joystick(const Joystick&) = delete;
  Joystick& operator=(const Joystick&) = delete;

  // The first present device; throws InputError if there is none.
  static std::string find();

  // Waits for an event until the time. True: a value has changed.
  bool wait(std::chrono::steady_clock::time_point until);
  // The device was unplugged, or the recording has ended.
  [[nodiscard]] bool has_ended() const { return ended_; }
  [[nodiscard]] const std::vector<double>& axes() const { return axes_; }
  [[nodiscard]] const std::vector<bool>& buttons() const { return buttons_; }

 private:
  bool read_events();
  [[nodiscard]] double scaled(int raw) const;

  int fd_ = -1;
  const double deadzone_;
  std::vector<double> axes_;
  std::vector<bool> buttons_;
  std::vector<char> rest_;  // of an incomplete event
  bool ended_ = false;
};

}  // namespace doppel::app
