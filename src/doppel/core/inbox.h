#pragma once
// Work handed to the loop from other threads, and back again: a lock-free stack that many push to and one
// empties. The loop takes everything in the order it was pushed; what it has run is freed by the threads that
// push, so that neither the fast path (one atomic load) nor the disposal allocates, frees or locks in the
// loop.

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <utility>

#include "doppel/export.h"

namespace doppel {

class DOPPEL_API Inbox {
 public:
  using Task = std::function<void()>;

  Inbox() = default;
  Inbox(const Inbox&) = delete;
  Inbox& operator=(const Inbox&) = delete;
  ~Inbox();

  // Any thread. Also frees the tasks that the loop has finished with, and ends a wait().
  void post(Task task);

  // The loop's thread only. Runs all tasks posted so far, oldest first; returns how many. A task must not
  // throw.
  std::size_t run();

  // The loop's thread only: waits until there is something to run, or the time is over (false).
  bool wait(std::chrono::nanoseconds at_most);

  [[nodiscard]] bool empty() const { return head_.load(std::memory_order_relaxed) == nullptr; }

 private:
  struct Node {
    Task task;
    Node* next = nullptr;
  };
  static void push(std::atomic<Node*>& head, Node* node);
  static void free_all(Node* node);

  std::atomic<Node*> head_{nullptr};
  std::atomic<Node*> done_{nullptr};
  std::atomic<bool> asleep_{false};
  std::mutex mutex_;  // for waiting alone
  std::condition_variable posted_;
};

}  // namespace doppel
