#pragma once
// Work that may never end, on threads that are not joined when the process ends.

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "doppel/export.h"

namespace doppel {

// Marks that a thread is still running and not joined, so that the process has to end without running static
// destructors. Any thread.
DOPPEL_API void mark_thread_abandoned();
DOPPEL_API bool has_abandoned_thread();

// One piece of work at a time, on a thread of its own. Work that has not ended when it is abandoned
// continues, if it ever does, with what it owns. One thread uses this object.
class DOPPEL_API AbandonableWork {
 public:
  AbandonableWork() = default;
  ~AbandonableWork() { abandon(); }
  AbandonableWork(const AbandonableWork&) = delete;
  AbandonableWork& operator=(const AbandonableWork&) = delete;

  // Abandons the work before it, then starts `work`, which owns all that it uses. `afterwards` follows on
  // the same thread, when the work counts as ended. `report` gets the text of an exception of either; it may
  // be empty. Throws std::system_error if the thread cannot be started.
  void start(std::function<void()> work, std::function<void()> afterwards,
             std::function<void(const std::string&)> report);
  // True if the work has ended, or there is none; waits for it at most for a time.
  [[nodiscard]] bool wait_for(std::chrono::milliseconds time) const;
  // Joins the thread if the work has ended, else leaves it.
  void abandon();
  // Works that have not ended, with those that were abandoned.
  [[nodiscard]] int unfinished() const { return *unfinished_; }

 private:
  struct End;
  std::shared_ptr<End> end_;  // shared with the thread; nullptr: there is no work
  std::shared_ptr<std::atomic<int>> unfinished_ = std::make_shared<std::atomic<int>>(0);
  std::thread thread_;
};

}  // namespace doppel
