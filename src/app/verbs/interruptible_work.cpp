#include "app/verbs/interruptible_work.h"

#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <utility>

#include "app/print_stderr.h"

namespace doppel::app {
namespace {

std::atomic<bool> interrupt_seen{false};

}  // namespace

InterruptibleWork::InterruptibleWork(std::string unit) : unit_(std::move(unit)) {
  struct sigaction action {};
  action.sa_handler = [](int) { interrupt_seen.store(true); };
  sigaction(SIGINT, &action, &before_);
  sigaction(SIGTERM, &action, &before_end_);
}

InterruptibleWork::~InterruptibleWork() {
  sigaction(SIGINT, &before_, nullptr);
  sigaction(SIGTERM, &before_end_, nullptr);
}

bool InterruptibleWork::progress(double done) const {
  if (isatty(STDERR_FILENO) != 0) {
    print_stderr("\r  {:3.0f} % {}{}", 100 * done, unit_, done < 1 ? "" : "\n");
    std::fflush(stderr);
  }
  return !interrupt_seen.load();
}

int interrupted_without_output() {
  print_stderr("\ninterrupted; nothing was written\n");
  return kInterrupted;
}

}  // namespace doppel::app
