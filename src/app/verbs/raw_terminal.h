#pragma once
// The keys of a terminal, one by one and without echo; a file or a pipe as it is.

#include <termios.h>

#include <chrono>
#include <optional>

namespace doppel::app {

class RawTerminal {
 public:
  explicit RawTerminal(int fd);
  ~RawTerminal();  // restores the terminal
  RawTerminal(const RawTerminal&) = delete;
  RawTerminal& operator=(const RawTerminal&) = delete;

  // The next key; nullopt: none until the time, or a signal came. Keys that send several bytes (arrows) are left
  // out.
  std::optional<char> next(std::chrono::steady_clock::time_point until);
  // The input has ended.
  [[nodiscard]] bool has_ended() const { return ended_; }

 private:
  std::optional<char> read_byte(std::chrono::steady_clock::time_point until);

  const int fd_;
  std::optional<termios> before_;  // nullopt: not a terminal
  bool ended_ = false;
};

}  // namespace doppel::app
