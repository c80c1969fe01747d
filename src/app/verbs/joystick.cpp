#include "app/verbs/joystick.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/joystick.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>

#include "doppel/core/diagnostic.h"

namespace doppel::app {
namespace {

constexpr double kFullScale = 32767.0;
constexpr int kMaxDevices = 32;

}  // namespace

std::string Joystick::find() {
  for (int i = 0; i < kMaxDevices; ++i) {
    const std::string device = fmt::format("/dev/input/js{}", i);
    std::error_code none;
    if (std::filesystem::exists(device, none)) return device;
  }
  throw InputError("cli.joystick", {}, "there is no joystick: no /dev/input/js0 to js31",
                   "connect one (the kernel's module joydev provides it), or name its device with --device");
}

Joystick::Joystick(const std::string& device, double deadzone) : deadzone_(deadzone) {
  fd_ = open(device.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  if (fd_ >= 0) return;
  const std::string why = std::strerror(errno);
  throw InputError("cli.joystick", {}, fmt::format("{} cannot be opened: {}", device, why),
                   errno == EACCES ? "add yourself to the group input: sudo usermod -aG input $USER"
                                   : "give the device of a joystick, as in --device /dev/input/js0");
}

Joystick::~Joystick() {
  close(fd_);
}

// As joy_node scales: the range outside of the dead zone to [-1, 1], inverted, because Linux counts forward and left
// as negative.
double Joystick::scaled(int raw) const {
  const double part = std::clamp(raw / kFullScale, -1.0, 1.0);
  if (std::abs(part) <= deadzone_) return 0.0;
  return -(part - std::copysign(deadzone_, part)) / (1 - deadzone_);
}

bool Joystick::read_events() {
  std::array<char, 64 * sizeof(js_event)> bytes{};
  const ssize_t got = read(fd_, bytes.data(), bytes.size());
  if (got <= 0) {
    ended_ = got == 0 || (errno != EAGAIN && errno != EINTR);
    return false;
  }
  rest_.insert(rest_.end(), bytes.begin(), bytes.begin() + got);
  bool changed = false;
  std::size_t at = 0;
  for (; at + sizeof(js_event) <= rest_.size(); at += sizeof(js_event)) {
    js_event event{};
    std::memcpy(&event, rest_.data() + at, sizeof(event));
    const int type = event.type & ~JS_EVENT_INIT;
    if (type == JS_EVENT_AXIS) {
      if (event.number >= axes_.size()) axes_.resize(event.number + std::size_t{1}, 0.0);
      changed = changed || axes_[event.number] != scaled(event.value);
      axes_[event.number] = scaled(event.value);
    } else if (type == JS_EVENT_BUTTON) {
      if (event.number >= buttons_.size()) buttons_.resize(event.number + std::size_t{1}, false);
      changed = changed || buttons_[event.number] != (event.value != 0);
      buttons_[event.number] = event.value != 0;
    }
  }
  rest_.erase(rest_.begin(), rest_.begin() + static_cast<std::ptrdiff_t>(at));
  return changed;
}

bool Joystick::wait(std::chrono::steady_clock::time_point until) {
  using std::chrono::milliseconds;
  const auto left = std::chrono::ceil<milliseconds>(until - std::chrono::steady_clock::now());
  pollfd input{fd_, POLLIN, 0};
  if (poll(&input, 1, static_cast<int>(std::max(left, milliseconds(0)).count())) <= 0) return false;
  return read_events();
}

}  // namespace doppel::app
