#pragma once
// Private to the bridge: tasks of other threads for the bridge's thread, and its wake-up.

#include <atomic>
#include <functional>
#include <mutex>
#include <utility>
#include <vector>

#include "doppel/ros/bus/bus.h"

namespace doppel::ros2 {

class BridgeMailbox {
 public:
  using Task = std::function<void()>;

  // `edge` has to live until close().
  explicit BridgeMailbox(Edge& edge) : edge_(&edge) {}

  // Any thread; does nothing after close().
  void post(Task task) {
    const std::lock_guard lock(mutex_);
    if (edge_ == nullptr) return;
    tasks_.push_back(std::move(task));
    edge_->wake();
  }
  // The middleware's threads, before close(): never blocks.
  void activity() {
    if (!activity_.exchange(true, std::memory_order_acq_rel)) edge_->wake();
  }

  // The bridge's thread.
  [[nodiscard]] bool had_activity() { return activity_.exchange(false, std::memory_order_acq_rel); }
  // True: there were tasks.
  bool run() {
    std::vector<Task> tasks;
    {
      const std::lock_guard lock(mutex_);
      tasks.swap(tasks_);
    }
    for (Task& task : tasks) task();
    return !tasks.empty();
  }

  void close() {
    const std::lock_guard lock(mutex_);
    edge_ = nullptr;
    tasks_.clear();
  }

 private:
  std::mutex mutex_;
  std::vector<Task> tasks_;
  std::atomic<bool> activity_{false};
  Edge* edge_;
};

}  // namespace doppel::ros2
