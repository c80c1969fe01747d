#pragma once
// Tasks for the loop from other threads: a lock-free stack with many producers and one consumer. The loop
// takes all tasks in the order in which they were posted; finished tasks are freed by the posting threads, so
// that neither the fast path (one atomic load) nor the disposal allocates, frees or locks in the loop.

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

  // Any thread. Also frees the tasks that the loop has finished, and ends a wait().
  void post(Task task);

  // The loop's thread only. Runs all tasks posted so far, oldest first; returns how many. A task
  // must not throw.
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
  std::mutex mutex_;  // only for wait()
  std::condition_variable posted_;
};

}  // namespace doppel
