#include "doppel/core/inbox.h"

namespace doppel {

Inbox::~Inbox() {
  free_all(head_.exchange(nullptr));
  free_all(done_.exchange(nullptr));
}

void Inbox::push(std::atomic<Node*>& head, Node* node) {
  node->next = head.load(std::memory_order_relaxed);
  while (
      !head.compare_exchange_weak(node->next, node, std::memory_order_release, std::memory_order_relaxed)) {
  }
}

void Inbox::free_all(Node* node) {
  while (node != nullptr) delete std::exchange(node, node->next);
}

void Inbox::post(Task task) {
  free_all(done_.exchange(nullptr, std::memory_order_acquire));
  push(head_, new Node{std::move(task)});
  // By sequential consistency either this thread reads `asleep_`, or the waiting one finds the task.
  std::atomic_thread_fence(std::memory_order_seq_cst);
  if (!asleep_.load(std::memory_order_relaxed)) return;
  { const std::lock_guard lock(mutex_); }
  posted_.notify_one();
}

bool Inbox::wait(std::chrono::nanoseconds at_most) {
  if (!empty()) return true;
  std::unique_lock lock(mutex_);
  asleep_.store(true, std::memory_order_relaxed);
  std::atomic_thread_fence(std::memory_order_seq_cst);
  const bool some = posted_.wait_for(lock, at_most, [this] { return !empty(); });
  asleep_.store(false, std::memory_order_relaxed);
  return some;
}

std::size_t Inbox::run() {
  if (empty()) return 0;
  Node* newest_first = head_.exchange(nullptr, std::memory_order_acquire);
  Node* oldest_first = nullptr;
  while (newest_first != nullptr) {
    Node* node = std::exchange(newest_first, newest_first->next);
    node->next = std::exchange(oldest_first, node);
  }
  std::size_t count = 0;
  while (oldest_first != nullptr) {
    Node* node = std::exchange(oldest_first, oldest_first->next);
    node->task();
    push(done_, node);
    ++count;
  }
  return count;
}

}  // namespace doppel
