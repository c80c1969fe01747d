#include "doppel/session/live/detail/background_queue.h"

#include <sys/resource.h>

#include <chrono>

namespace doppel {
namespace {

constexpr std::size_t kMaxWaiting = 16;
constexpr int kLowestPriority = 19;  // niceness
constexpr std::chrono::milliseconds kTimeToEnd{1000};

}  // namespace

BackgroundQueue::~BackgroundQueue() {
  {
    const std::lock_guard lock(shared_->mutex);
    shared_->ending = true;
    shared_->waiting.clear();
  }
  shared_->change.notify_all();
  static_cast<void>(thread_.wait_for(kTimeToEnd));
}

bool BackgroundQueue::post(std::function<void()> work) {
  {
    const std::lock_guard lock(shared_->mutex);
    if (shared_->waiting.size() >= kMaxWaiting) return false;
    shared_->waiting.push_back(std::move(work));
  }
  if (!started_) thread_.start([shared = shared_] { run(*shared); }, {}, {});
  started_ = true;
  shared_->change.notify_all();
  return true;
}

void BackgroundQueue::run(Shared& shared) {
  setpriority(PRIO_PROCESS, 0, kLowestPriority);  // on Linux: of this thread
  std::unique_lock lock(shared.mutex);
  while (true) {
    shared.change.wait(lock, [&] { return shared.ending || !shared.waiting.empty(); });
    if (shared.ending) return;
    std::function<void()> work = std::move(shared.waiting.front());
    shared.waiting.pop_front();
    lock.unlock();
    // The other pieces follow. A request whose answer was being made is refused by the bus, because its
    // responder is destroyed.
    try {
      work();
    } catch (...) {
    }
    work = {};
    lock.lock();
  }
}

}  // namespace doppel
