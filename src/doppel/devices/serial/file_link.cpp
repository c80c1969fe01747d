#include "doppel/devices/serial/file_link.h"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <ctime>
#include <utility>

#include "doppel/base/core/diagnostic.h"
#include "doppel/devices/serial/detail/terminal_rate.h"

namespace doppel {
namespace {

constexpr Duration kWritePatience{100'000'000};  // until a full buffer counts as a lost link

timespec timespec_of(Duration duration) {
  const auto count = std::max<Duration::rep>(duration.count(), 0);
  return {static_cast<time_t>(count / 1'000'000'000), static_cast<long>(count % 1'000'000'000)};
}

}  // namespace

FileLink::~FileLink() {
  close_file();
}

void FileLink::close_file() {
  if (file_ >= 0) ::close(file_);
  file_ = -1;
}

Time FileLink::now() const {
  return Time(std::chrono::duration_cast<Duration>(std::chrono::steady_clock::now().time_since_epoch()));
}

// True: the file is ready, or has an error that the next call reports.
bool FileLink::wait_for(short events, Time deadline) {
  for (;;) {
    const Duration left = deadline - now();
    pollfd one{file_, events, 0};
    const timespec patience = timespec_of(left);
    const int ready = ::ppoll(&one, 1, &patience, nullptr);
    if (ready > 0) return true;
    if (ready == 0) return false;
    if (errno != EINTR) return true;
  }
}

bool FileLink::write(std::span<const std::uint8_t> bytes) {
  const Time deadline = now() + kWritePatience;
  while (!bytes.empty()) {
    if (is_lost()) return false;
    const ssize_t sent = ::write(file_, bytes.data(), bytes.size());
    if (sent > 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(sent));
      continue;
    }
    if (sent < 0 && errno == EINTR) continue;
    if (sent < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) {
      if (!wait_for(POLLOUT, deadline)) return false;
      continue;
    }
    if (!stays_open()) close_file();
    return false;
  }
  return true;
}

std::size_t FileLink::read(std::span<std::uint8_t> out, Time deadline) {
  while (!is_lost()) {
    const ssize_t count = ::read(file_, out.data(), out.size());
    if (count > 0) {
      other_end_open_ = true;
      return static_cast<std::size_t>(count);
    }
    if (count < 0 && errno == EINTR) continue;
    if (count < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) {
      other_end_open_ = true;
      if (!wait_for(POLLIN, deadline)) return 0;
      continue;
    }
    if (!stays_open()) {
      close_file();
      return 0;
    }
    if (std::exchange(other_end_open_, false)) on_other_end_closed();
    // Nobody has the other end open: poll() returns at once, so that the wait is by time.
    const Time now_ = now();
    if (now_ >= deadline) return 0;
    constexpr Duration kPause{5'000'000};
    wait_until(std::min(deadline, now_ + kPause));
  }
  return 0;
}

// A socket is no terminal, and refuses to be flushed. Of a partner that never ends only so much is read.
void FileLink::discard() {
  if (file_ < 0 || flush_terminal(file_, false)) return;
  constexpr int kMaxReads = 256;
  std::array<std::uint8_t, 4096> bytes{};
  for (int i = 0; i < kMaxReads; ++i) {
    const ssize_t count = ::read(file_, bytes.data(), bytes.size());
    if (count == 0 || (count < 0 && errno != EINTR)) return;  // the next call reports a lost link
  }
}

void FileLink::wait_until(Time when) {
  const timespec due = timespec_of(when.time_since_epoch());
  while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, nullptr) == EINTR) {
  }
}

bool FileLink::reopen(std::string& why) {
  close_file();
  try {
    file_ = open_file();
    return true;
  } catch (const InputError& problem) {
    why = problem.diagnostics().front().message;
    return false;
  }
}

}  // namespace doppel
