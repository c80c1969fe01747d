#include "doppel/twin/arms/detail/arm_worker.h"

#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "doppel/base/core/guarded_thread.h"
#include "doppel/base/core/thrown.h"

namespace doppel {
namespace {

constexpr int kNiceness = 5;  // so that the loop comes first on a machine with few processors

}  // namespace

ArmWorker::~ArmWorker() {
  {
    // Without it the notification may come between the worker's look and its sleep.
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  ready_.notify_all();
  if (thread_.joinable()) thread_.join();
}

bool ArmWorker::post(std::function<void()> work) {
  {
    const std::lock_guard lock(mutex_);
    if (waiting_.size() >= kMaxWaiting) return false;
    waiting_.push_back(std::move(work));
  }
  if (!thread_.joinable()) {
    thread_ = guarded_thread(
        [this] { run(); },
        [this](const std::string& why) { log_.error("move_group", "kinematics ended: " + why); });
  }
  ready_.notify_one();
  return true;
}

void ArmWorker::run() {
  setpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid)), kNiceness);
  while (true) {
    std::function<void()> work;
    {
      std::unique_lock lock(mutex_);
      ready_.wait(lock, [this] { return stopping_ || !waiting_.empty(); });
      if (stopping_) return;
      work = std::move(waiting_.front());
      waiting_.pop_front();
    }
    try {
      work();
    } catch (...) {
      log_.error("move_group", "a request has no answer: " + thrown_text());
    }
  }
}

}  // namespace doppel
