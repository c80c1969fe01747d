#include "doppel/base/core/inbox.h"

#include <algorithm>

namespace doppel {

// Returns a task to the posting threads, also if it throws.
class Inbox::Finished {
 public:
  Finished(Inbox& inbox, Node* node) : inbox_(inbox), node_(node) {}
  ~Finished() {
    // The node keeps its lane until a posting thread frees it.
    if (Lane* const lane = node_->lane.get(); lane != nullptr) {
      lane->pending_bytes_.fetch_sub(node_->bytes);
      lane->pending_.fetch_sub(1);
      if (lane->after_task_) lane->after_task_();
    }
    push(inbox_.done_, node_);
  }
  Finished(const Finished&) = delete;
  Finished& operator=(const Finished&) = delete;

 private:
  Inbox& inbox_;
  Node* const node_;
};

Inbox::Lane::~Lane() {
  free_all(first_);
}

void Inbox::Lane::append(Node* node) {
  (first_ == nullptr ? first_ : last_->next) = node;
  last_ = node;
  node->next = nullptr;
}

Inbox::Node* Inbox::Lane::take_first() {
  return std::exchange(first_, first_->next);
}

Inbox::~Inbox() {
  free_all(head_.exchange(nullptr));
  // A task keeps its lane, so the lane's tasks are taken from it first.
  for (Lane* lane : waiting_) free_all(std::exchange(lane->first_, nullptr));
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

void Inbox::post(std::shared_ptr<Lane> lane, Task task, std::size_t bytes) {
  free_all(done_.exchange(nullptr, std::memory_order_acquire));
  if (lane != nullptr) {
    lane->pending_.fetch_add(1);
    lane->pending_bytes_.fetch_add(bytes);
  }
  push(head_, new Node{std::move(task), std::move(lane), bytes});
  // Sequential consistency ensures that either this thread reads `asleep_`, or the waiting one finds the task.
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

void Inbox::sort_into_lanes() {
  Node* newest_first = head_.exchange(nullptr, std::memory_order_acquire);
  Node* oldest_first = nullptr;
  while (newest_first != nullptr) {
    Node* node = std::exchange(newest_first, newest_first->next);
    node->next = std::exchange(oldest_first, node);
  }
  while (oldest_first != nullptr) {
    Node* node = std::exchange(oldest_first, oldest_first->next);
    Lane& lane = node->lane != nullptr ? *node->lane : own_;
    if (&lane != &own_ && lane.first_ == nullptr) {
      // A lane that had nothing to run gets no time in arrear.
      lane.served_ = std::max(lane.served_, served_);
      waiting_.push_back(&lane);
    }
    lane.append(node);
  }
}

void Inbox::run_one(Lane& lane) {
  Node* const node = lane.take_first();
  const Finished finished(*this, node);
  node->task();
}

// Runs a task of the lane that was served least, and returns the time that it took.
std::chrono::nanoseconds Inbox::run_next_lane() {
  const auto next = std::ranges::min_element(waiting_, {}, [](const Lane* lane) { return lane->served_; });
  // The lane outlives its last task, for the time that it took.
  const std::shared_ptr<Lane> lane = (*next)->first_->lane;
  served_ = lane->served_;
  if (lane->first_->next == nullptr) waiting_.erase(next);
  const auto begin = std::chrono::steady_clock::now();
  run_one(*lane);
  const auto took = std::chrono::steady_clock::now() - begin;
  lane->served_ += std::max<std::chrono::nanoseconds>(took, std::chrono::nanoseconds(1));
  return took;
}

std::size_t Inbox::run(std::chrono::nanoseconds* allowance) {
  if (empty()) return 0;
  sort_into_lanes();
  std::size_t count = 0;
  for (; own_.first_ != nullptr; ++count) run_one(own_);
  for (; !waiting_.empty() && (allowance == nullptr || *allowance > std::chrono::nanoseconds(0)); ++count) {
    const auto took = run_next_lane();
    if (allowance != nullptr) *allowance -= took;
  }
  return count;
}

}  // namespace doppel
