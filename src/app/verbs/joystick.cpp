#include "app/verbs/joystick.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <linux/joystick.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/names.h"

namespace doppel::app {
namespace {

constexpr int kMaxDevices = 32;

int open_joystick(const std::string& device) {
  return open(device.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
}

// The state as the kernel describes the device; a recording has no description, and is in SDL's order.
JoystickState described_state(int fd) {
  std::uint8_t axes = 0, buttons = 0;
  std::array<std::uint8_t, ABS_CNT> codes{};
  if (ioctl(fd, JSIOCGAXES, &axes) < 0 || ioctl(fd, JSIOCGBUTTONS, &buttons) < 0 ||
      ioctl(fd, JSIOCGAXMAP, &codes) < 0)
    return JoystickState();
  const std::span<const std::uint8_t> used(codes.data(), std::min<std::size_t>(axes, codes.size()));
  return JoystickState(sdl_axis_places(used), axes, buttons);
}

std::string name_of_joystick(const std::string& device) {
  const int fd = open_joystick(device);
  if (fd < 0) return "";
  std::array<char, 128> name{};
  const int got = ioctl(fd, JSIOCGNAME(name.size() - 1), name.data());
  close(fd);
  return got < 0 ? "" : name.data();
}

[[noreturn]] void throw_no_joystick(const std::string& what, const std::string& fix) {
  throw InputError("cli.joystick", {}, what, fix);
}

}  // namespace

std::string Joystick::find(const JoySettings& settings) {
  std::vector<std::string> present, names;
  for (int i = 0; i < kMaxDevices; ++i) {
    const std::string device = fmt::format("/dev/input/js{}", i);
    if (access(device.c_str(), F_OK) == 0) present.push_back(device);
  }
  if (present.empty()) {
    throw_no_joystick(
        "there is no joystick: no /dev/input/js0 to js31",
        "connect one (the kernel's module joydev provides it), or name its device with --device");
  }
  if (settings.device_name.empty()) {
    const auto at = static_cast<std::size_t>(settings.device_id);
    if (at < present.size()) return present[at];
    throw_no_joystick(
        fmt::format("device_id is {}, and there are {} joysticks", settings.device_id, present.size()),
        "set the parameter to a smaller number, or name the device with --device");
  }
  for (const std::string& device : present) {
    names.push_back(name_of_joystick(device));
    if (names.back() == settings.device_name) return device;
  }
  throw_no_joystick(fmt::format("device_name is '{}', and there is no such joystick{}", settings.device_name,
                                did_you_mean(settings.device_name, names)),
                    fmt::format("the names of those present: {}", fmt::join(names, ", ")));
}

Joystick::Joystick(const std::string& device) : fd_(open_joystick(device)) {
  if (fd_ < 0) {
    const std::string why = std::strerror(errno);
    throw_no_joystick(fmt::format("{} cannot be opened: {}", device, why),
                      errno == EACCES ? "add yourself to the group input: sudo usermod -aG input $USER"
                                      : "give the device of a joystick, as in --device /dev/input/js0");
  }
  state_ = described_state(fd_);
}

Joystick::~Joystick() {
  close(fd_);
}

void Joystick::use(const JoySettings& settings) {
  state_.set_deadzone(settings.deadzone);
  state_.set_sticky_buttons(settings.sticky_buttons);
}

JoystickChange Joystick::wait(std::chrono::steady_clock::time_point until) {
  using std::chrono::milliseconds;
  const auto left = std::chrono::ceil<milliseconds>(until - std::chrono::steady_clock::now());
  pollfd input{fd_, POLLIN, 0};
  if (poll(&input, 1, static_cast<int>(std::max(left, milliseconds(0)).count())) <= 0) return {};
  std::array<std::byte, 64 * sizeof(js_event)> bytes{};
  const ssize_t got = read(fd_, bytes.data(), bytes.size());
  if (got > 0) return state_.take(std::span(bytes).first(static_cast<std::size_t>(got)));
  ended_ = got == 0 || (errno != EAGAIN && errno != EINTR);
  return {};
}

}  // namespace doppel::app
