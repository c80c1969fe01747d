#pragma once
// The keys of a terminal, one by one and without echo; a file or a pipe as it is.

#include <termios.h>

#include <chrono>
#include <optional>

namespace doppel::app {

class RawTerminal {
 public:
  enum class Arrows { left_out, given };
  explicit RawTerminal(int fd, Arrows arrows = Arrows::left_out);
  ~RawTerminal();  // restores the terminal
  RawTerminal(const RawTerminal&) = delete;
  RawTerminal& operator=(const RawTerminal&) = delete;

  // Given arrows are the control keys that move a cursor in a shell (^P, ^N, ^F, ^B).
  static constexpr char kUp = 0x10, kDown = 0x0e, kRight = 0x06, kLeft = 0x02;

  // The next key; nullopt: none until the time, or a signal came. Other keys that send several bytes are left
  // out.
  std::optional<char> next(std::chrono::steady_clock::time_point until);
  // The input has ended.
  [[nodiscard]] bool has_ended() const { return ended_; }

 private:
  std::optional<char> read_byte(std::chrono::steady_clock::time_point until);

  const int fd_;
  const Arrows arrows_;
  std::optional<termios> before_;  // nullopt: not a terminal
  bool ended_ = false;
};

}  // namespace doppel::app
