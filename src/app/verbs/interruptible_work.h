#pragma once
// Work that Ctrl-C ends before anything is written, with its progress on a terminal.

#include <csignal>
#include <string>

namespace doppel::app {

inline constexpr int kInterrupted = 130;  // exit code

// Catches SIGINT and SIGTERM during its life. One at a time.
class InterruptibleWork {
 public:
  // `unit`: what the percentage counts, "of the cells".
  explicit InterruptibleWork(std::string unit);
  ~InterruptibleWork();
  InterruptibleWork(const InterruptibleWork&) = delete;
  InterruptibleWork& operator=(const InterruptibleWork&) = delete;

  // Shows the completed fraction, 0..1, on stderr if it is a terminal. False: interrupted.
  bool progress(double done) const;

 private:
  std::string unit_;
  struct sigaction before_ {
  }, before_end_{};
};

// Reports the interruption, and returns the exit code.
int interrupted_without_output();

}  // namespace doppel::app
