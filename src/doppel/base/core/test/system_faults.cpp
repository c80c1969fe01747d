#include "doppel/base/core/test/system_faults.h"

#include <dlfcn.h>
#include <pthread.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <limits>

namespace doppel {
namespace {

constexpr int kAllThreads = std::numeric_limits<int>::max();
std::atomic<int> threads_left{kAllThreads};
std::atomic<std::time_t> seconds_ahead{0};
std::atomic<bool> is_disk_slow{false};
std::atomic<int> syncs_on_slow_disk{0}, failed_syncs_on_slow_disk{0};
std::atomic<int> sync_error{0};  // errno

template <class Function>
Function system_function(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

}  // namespace

ThreadShortage::ThreadShortage(int allowed) {
  threads_left = allowed;
}
ThreadShortage::~ThreadShortage() {
  threads_left = kAllThreads;
}

WallClockAhead::WallClockAhead(std::time_t seconds) {
  seconds_ahead = seconds;
}
WallClockAhead::~WallClockAhead() {
  seconds_ahead = 0;
}

SlowDisk::SlowDisk() {
  syncs_on_slow_disk = failed_syncs_on_slow_disk = 0;
  is_disk_slow = true;
}
SlowDisk::~SlowDisk() {
  release();
}
void SlowDisk::wait_for_sync() {
  syncs_on_slow_disk.wait(0);
}
void SlowDisk::release() {
  is_disk_slow = false;
  is_disk_slow.notify_all();
}
int SlowDisk::failed_syncs() {
  return failed_syncs_on_slow_disk;
}

FailingDisk::FailingDisk(int error) {
  sync_error = error;
}
FailingDisk::~FailingDisk() {
  sync_error = 0;
}

}  // namespace doppel

// The system's functions, replaced in the whole program, also for the shared libraries that it uses.
extern "C" __attribute__((visibility("default"))) int pthread_create(pthread_t* thread,
                                                                     const pthread_attr_t* attributes,
                                                                     void* (*start)(void*), void* argument) {
  static const auto create = doppel::system_function<decltype(&pthread_create)>("pthread_create");
  if (doppel::threads_left != doppel::kAllThreads && doppel::threads_left-- <= 0) return EAGAIN;
  return create(thread, attributes, start, argument);
}

extern "C" __attribute__((visibility("default"))) int clock_gettime(clockid_t clock,
                                                                    timespec* time) noexcept {
  static const auto get = doppel::system_function<decltype(&clock_gettime)>("clock_gettime");
  const int result = get(clock, time);
  if (clock == CLOCK_REALTIME && result == 0) time->tv_sec += doppel::seconds_ahead;
  return result;
}

extern "C" __attribute__((visibility("default"))) int fsync(int file) {
  static const auto system_sync = doppel::system_function<decltype(&fsync)>("fsync");
  if (const int error = doppel::sync_error; error != 0) {
    errno = error;
    return -1;
  }
  const bool is_slow = doppel::is_disk_slow;
  if (is_slow) {
    ++doppel::syncs_on_slow_disk;
    doppel::syncs_on_slow_disk.notify_all();
    doppel::is_disk_slow.wait(true);
  }
  const int result = system_sync(file);
  if (is_slow && result != 0) ++doppel::failed_syncs_on_slow_disk;
  return result;
}
