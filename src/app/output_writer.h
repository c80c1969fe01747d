#pragma once
// Writes to a terminal, pipe or file from a dedicated thread, so that printing never blocks on a stalled
// reader such as a terminal after Ctrl-S or a pager: a log line must not stop the control loop.

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>

namespace doppel::app {

// Any thread.
class OutputWriter {
 public:
  static constexpr std::size_t kMaxWaiting = std::size_t{256} * 1024;  // bytes
  static constexpr std::chrono::milliseconds kEndTimeout{1000};

  explicit OutputWriter(int fd);
  // Flushes the queue for at most kEndTimeout; the rest is dropped.
  ~OutputWriter();
  OutputWriter(const OutputWriter&) = delete;
  OutputWriter& operator=(const OutputWriter&) = delete;

  // A text that does not fit into the queue of kMaxWaiting is dropped; the number of dropped texts is written
  // before the next one that fits.
  void write(std::string_view text);
  [[nodiscard]] bool is_idle() const;  // nothing waits, and nothing is being written

 private:
  void run();
  void write_out(std::string_view text);
  void note_lost();

  const int fd_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::string waiting_;
  std::size_t lost_ = 0;
  bool is_writing_ = false, is_ending_ = false, has_ended_ = false;
  std::atomic<bool> is_given_up_{false};
  std::thread thread_;
};

}  // namespace doppel::app
