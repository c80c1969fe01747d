#include "app/output_writer.h"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <utility>

#include "doppel/base/core/guarded_thread.h"

namespace doppel::app {
namespace {

constexpr int kRetry = 10;  // ms

// A signal whose default action is none, so that one that comes too late changes nothing. The handler ends
// write().
constexpr int kEndsWrite = SIGURG;

}  // namespace

OutputWriter::OutputWriter(int fd) : fd_(fd) {
  struct sigaction action {};
  action.sa_handler = [](int) {};
  sigaction(kEndsWrite, &action, nullptr);
  const auto end = [this] {
    const std::lock_guard lock(mutex_);
    has_ended_ = true;
    changed_.notify_all();
  };
  thread_ = guarded_thread(
      [this, end] {
        run();
        end();
      },
      [end](const std::string&) { end(); });
}

OutputWriter::~OutputWriter() {
  {
    std::unique_lock lock(mutex_);
    note_lost();
    is_ending_ = true;
    changed_.notify_all();
    const auto has_ended = [this] { return has_ended_; };
    if (!changed_.wait_for(lock, kEndTimeout, has_ended)) {
      is_given_up_ = true;
      // Again and again: a signal that comes just before write() does not end it.
      while (!changed_.wait_for(lock, std::chrono::milliseconds(kRetry), has_ended))
        pthread_kill(thread_.native_handle(), kEndsWrite);
    }
  }
  thread_.join();
}

void OutputWriter::write(std::string_view text) {
  const std::lock_guard lock(mutex_);
  if (waiting_.size() + text.size() > kMaxWaiting) {
    ++lost_;
    return;
  }
  note_lost();
  waiting_ += text;
  changed_.notify_all();
}

bool OutputWriter::is_idle() const {
  const std::lock_guard lock(mutex_);
  return waiting_.empty() && !is_writing_;
}

void OutputWriter::note_lost() {
  if (lost_ == 0) return;
  waiting_ += fmt::format("  {} messages were dropped: this output was not read in time\n", lost_);
  lost_ = 0;
}

void OutputWriter::run() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return is_ending_ || !waiting_.empty(); });
    if (waiting_.empty() || is_given_up_) return;
    const std::string text = std::exchange(waiting_, {});
    is_writing_ = true;
    lock.unlock();
    write_out(text);
    lock.lock();
    is_writing_ = false;
  }
}

// A full disk or a closed terminal loses the text: the program continues in any case. write_all() of
// base/core goes on after a signal, which has to end this one.
void OutputWriter::write_out(std::string_view text) {
  while (!text.empty() && !is_given_up_) {
    const ssize_t written = ::write(fd_, text.data(), text.size());
    if (written > 0) text.remove_prefix(static_cast<std::size_t>(written));
    if (written >= 0 || errno == EINTR) continue;
    if (errno != EAGAIN) return;
    // Another process that has this terminal, too, has made it non-blocking.
    pollfd room{fd_, POLLOUT, 0};
    poll(&room, 1, kRetry);
  }
}

}  // namespace doppel::app
