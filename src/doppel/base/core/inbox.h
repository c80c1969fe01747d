#pragma once
// Tasks for the loop from other threads: a lock-free stack with many producers and one consumer. The loop
// takes all tasks in the order in which they were posted; finished tasks are freed by the posting threads, so
// that neither the fast path (one atomic load) nor the disposal allocates, frees or locks in the loop.

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "doppel/export.h"

namespace doppel {

class DOPPEL_API Inbox {
  struct Node;

 public:
  using Task = std::function<void()>;

  // The tasks of one source, which run in the order in which they were posted. Lanes get equal shares of the
  // time that run() has for them, so that a source with many or slow tasks does not delay the others.
  class DOPPEL_API Lane {
   public:
    // after_task: called on the loop's thread after each task of the lane; may be empty.
    explicit Lane(std::function<void()> after_task = {}) : after_task_(std::move(after_task)) {}
    Lane(const Lane&) = delete;
    Lane& operator=(const Lane&) = delete;
    ~Lane();

    // Posted, but not run yet. Any thread.
    [[nodiscard]] std::size_t pending() const { return pending_.load(); }
    [[nodiscard]] std::size_t pending_bytes() const { return pending_bytes_.load(); }

   private:
    friend class Inbox;
    void append(Node* node);
    Node* take_first();

    const std::function<void()> after_task_;
    std::atomic<std::size_t> pending_{0}, pending_bytes_{0};
    // The loop's thread only.
    Node *first_ = nullptr, *last_ = nullptr;
    std::chrono::nanoseconds served_{};  // the time that its tasks took, compared with that of other lanes
  };

  Inbox() = default;
  Inbox(const Inbox&) = delete;
  Inbox& operator=(const Inbox&) = delete;
  ~Inbox();

  // Any thread. Also frees the tasks that the loop has finished, and ends a wait(). Tasks without a lane
  // run in the next run(). bytes: the size of the task's data, for pending_bytes().
  void post(Task task) { post(nullptr, std::move(task)); }
  void post(std::shared_ptr<Lane> lane, Task task, std::size_t bytes = 0);

  // The loop's thread only. Runs all tasks posted so far, and returns how many. With an allowance, tasks of
  // lanes only run while it is positive; the time that they take is subtracted from it. The task of an
  // exception counts as run, and the rest is kept.
  std::size_t run(std::chrono::nanoseconds* allowance = nullptr);

  // The loop's thread only: waits until there is something to run, or the time is over (false).
  bool wait(std::chrono::nanoseconds at_most);

  // The loop's thread only.
  [[nodiscard]] bool empty() const {
    return head_.load(std::memory_order_relaxed) == nullptr && own_.first_ == nullptr && waiting_.empty();
  }

 private:
  struct Node {
    Task task;
    std::shared_ptr<Lane> lane;
    std::size_t bytes = 0;
    Node* next = nullptr;
  };
  class Finished;
  static void push(std::atomic<Node*>& head, Node* node);
  static void free_all(Node* node);
  void sort_into_lanes();
  void run_one(Lane& lane);
  std::chrono::nanoseconds run_next_lane();

  std::atomic<Node*> head_{nullptr};
  std::atomic<Node*> done_{nullptr};
  std::atomic<bool> asleep_{false};
  std::mutex mutex_;  // only for wait()
  std::condition_variable posted_;
  // The loop's thread only.
  Lane own_;                    // tasks without a lane
  std::vector<Lane*> waiting_;  // lanes with tasks, each kept by its tasks
  std::chrono::nanoseconds served_{};
};

}  // namespace doppel
