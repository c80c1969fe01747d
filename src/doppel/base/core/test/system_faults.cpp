#include "doppel/base/core/test/system_faults.h"

#include <dlfcn.h>
#include <pthread.h>

#include <atomic>
#include <cerrno>
#include <limits>

namespace doppel {
namespace {

constexpr int kAllThreads = std::numeric_limits<int>::max();
std::atomic<int> threads_left{kAllThreads};
std::atomic<std::time_t> seconds_ahead{0};

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
