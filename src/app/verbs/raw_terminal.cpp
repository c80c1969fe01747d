#include "app/verbs/raw_terminal.h"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <string>

namespace doppel::app {
namespace {

constexpr char kEscape = 27;

}  // namespace

RawTerminal::RawTerminal(int fd, Arrows arrows) : fd_(fd), arrows_(arrows) {
  termios now{};
  if (isatty(fd_) == 0 || tcgetattr(fd_, &now) != 0) return;
  before_ = now;
  now.c_lflag &= static_cast<tcflag_t>(~(ICANON | ECHO));  // Ctrl-C remains a signal
  now.c_cc[VMIN] = 0;
  now.c_cc[VTIME] = 0;
  tcsetattr(fd_, TCSANOW, &now);
}

RawTerminal::~RawTerminal() {
  if (before_) tcsetattr(fd_, TCSADRAIN, &*before_);
}

std::optional<char> RawTerminal::read_byte(std::chrono::steady_clock::time_point until) {
  using std::chrono::milliseconds;
  const auto left = std::chrono::ceil<milliseconds>(until - std::chrono::steady_clock::now());
  pollfd input{fd_, POLLIN, 0};
  if (poll(&input, 1, static_cast<int>(std::max(left, milliseconds(0)).count())) <= 0) return std::nullopt;
  char byte = 0;
  const ssize_t got = read(fd_, &byte, 1);
  if (got == 1) return byte;
  ended_ = got == 0 || (input.revents & (POLLHUP | POLLERR)) != 0;
  return std::nullopt;
}

std::optional<char> RawTerminal::next(std::chrono::steady_clock::time_point until) {
  const auto byte = read_byte(until);
  if (byte != kEscape) return byte;
  // The bytes of an arrow or function key follow at once; a lone escape is a key that stops.
  const auto soon = std::chrono::steady_clock::now() + std::chrono::milliseconds(5);
  std::string sequence;
  while (const auto more = read_byte(soon)) {
    sequence += *more;
    if ((*more >= 'A' && *more <= 'Z' && *more != 'O') || *more == '~') break;
  }
  if (sequence.empty()) return byte;
  if (arrows_ == Arrows::left_out) return std::nullopt;
  if (sequence == "[A" || sequence == "OA") return kUp;
  if (sequence == "[B" || sequence == "OB") return kDown;
  if (sequence == "[C" || sequence == "OC") return kRight;
  if (sequence == "[D" || sequence == "OD") return kLeft;
  return std::nullopt;
}

}  // namespace doppel::app
