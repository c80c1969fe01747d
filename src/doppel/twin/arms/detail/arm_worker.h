#pragma once
// A thread for work that must not delay the loop, at a lower priority.

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

#include "doppel/base/core/log.h"

namespace doppel {

class ArmWorker {
 public:
  static constexpr std::size_t kMaxWaiting = 64;

  explicit ArmWorker(const Log& log) : log_(log) {}
  ~ArmWorker();
  ArmWorker(const ArmWorker&) = delete;
  ArmWorker& operator=(const ArmWorker&) = delete;

  // The loop's thread. Starts the thread with the first work. False: too much is waiting.
  bool post(std::function<void()> work);
  // True once the worker is being destroyed: long work ends early.
  [[nodiscard]] bool stopping() const { return stopping_; }

 private:
  void run();

  const Log& log_;
  std::mutex mutex_;
  std::condition_variable ready_;
  std::deque<std::function<void()>> waiting_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace doppel
