#include "doppel/base/core/abandoned_thread.h"

#include <condition_variable>
#include <mutex>
#include <utility>

#include "doppel/base/core/guarded_thread.h"

namespace doppel {
namespace {

std::atomic<bool> left_behind{false};

}  // namespace

void mark_thread_abandoned() {
  left_behind = true;
}

bool has_abandoned_thread() {
  return left_behind;
}

struct AbandonableWork::End {
  std::mutex mutex;
  std::condition_variable changed;
  bool reached = false;
};

void AbandonableWork::start(std::function<void()> work, std::function<void()> afterwards,
                            std::function<void(const std::string&)> report) {
  abandon();
  auto end = std::make_shared<End>();
  // Counts down when the work ends, also by an exception.
  struct Unfinished {
    std::shared_ptr<End> end;
    std::shared_ptr<std::atomic<int>> count;
    ~Unfinished() {
      --*count;
      const std::lock_guard lock(end->mutex);
      end->reached = true;
      end->changed.notify_all();
    }
  };
  ++*unfinished_;
  const auto run = [work = std::move(work), afterwards = std::move(afterwards), end, count = unfinished_] {
    {
      const Unfinished unfinished{end, count};
      work();
    }
    if (afterwards) afterwards();
  };
  try {
    thread_ = guarded_thread(run, [report = std::move(report)](const std::string& thrown) {
      if (report) report(thrown);
    });
  } catch (...) {
    --*unfinished_;
    throw;
  }
  end_ = std::move(end);
}

bool AbandonableWork::wait_for(std::chrono::milliseconds time) const {
  if (end_ == nullptr) return true;
  std::unique_lock lock(end_->mutex);
  return end_->changed.wait_for(lock, time, [this] { return end_->reached; });
}

void AbandonableWork::abandon() {
  if (end_ == nullptr) return;
  if (wait_for(std::chrono::milliseconds(0))) {
    thread_.join();
  } else {
    mark_thread_abandoned();
    thread_.detach();
  }
  end_ = nullptr;
}

}  // namespace doppel
