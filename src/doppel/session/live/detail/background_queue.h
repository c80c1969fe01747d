#pragma once
// Pieces of work, one after the other, on a thread of the lowest priority.

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>

#include "doppel/base/core/abandoned_thread.h"

namespace doppel {

class BackgroundQueue {
 public:
  BackgroundQueue() = default;
  // Drops what waits. Work that has not ended a moment later is abandoned (abandoned_thread.h).
  ~BackgroundQueue();
  BackgroundQueue(const BackgroundQueue&) = delete;
  BackgroundQueue& operator=(const BackgroundQueue&) = delete;

  // `work` owns all that it uses, and reports its own errors: an exception ends this piece alone. Starts the
  // thread with the first work. False: too much waits.
  bool post(std::function<void()> work);

 private:
  struct Shared {
    std::mutex mutex;
    std::condition_variable change;
    std::deque<std::function<void()>> waiting;
    bool ending = false;
  };
  static void run(Shared& shared);

  std::shared_ptr<Shared> shared_ = std::make_shared<Shared>();
  bool started_ = false;
  AbandonableWork thread_;
};

}  // namespace doppel
