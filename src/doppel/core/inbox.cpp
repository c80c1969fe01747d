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
