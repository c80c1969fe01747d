#include <pthread.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <thread>

#include "doppel/review/doctor/detail/probes.h"

namespace doppel::doctor {
namespace {

std::int64_t limit_of(int resource) {
  rlimit limit{};
  if (getrlimit(static_cast<__rlimit_resource_t>(resource), &limit) != 0) return 0;
  return limit.rlim_cur == RLIM_INFINITY ? -1 : static_cast<std::int64_t>(limit.rlim_cur);
}

// Tried in a thread that ends at once.
std::string scheduling_failure() {
  int error = 0;
  std::thread([&error] {
    sched_param parameters{};
    parameters.sched_priority = sched_get_priority_min(SCHED_FIFO);
    error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
  }).join();
  return error == 0 ? "" : std::strerror(error);
}

}  // namespace

ProcessorFacts probe_processor() {
  ProcessorFacts facts;
  facts.cores = static_cast<int>(sysconf(_SC_NPROCESSORS_ONLN));
  cpu_set_t usable;
  CPU_ZERO(&usable);
  facts.usable_cores = sched_getaffinity(0, sizeof usable, &usable) == 0 ? CPU_COUNT(&usable) : facts.cores;
  double load = -1;
  facts.load = getloadavg(&load, 1) == 1 ? load : -1;
  utsname system{};
  if (uname(&system) == 0) {
    facts.kernel = system.release;
    facts.has_preempt_rt = std::strstr(system.version, "PREEMPT_RT") != nullptr;
  }
  if (first_line("/sys/kernel/realtime") == "1") facts.has_preempt_rt = true;
  facts.governor = first_line("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor");
  facts.scheduling_failure = scheduling_failure();
  facts.rtprio_limit = limit_of(RLIMIT_RTPRIO);
  facts.memlock_limit = limit_of(RLIMIT_MEMLOCK);
  return facts;
}

}  // namespace doppel::doctor
