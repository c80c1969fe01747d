#include <fmt/format.h>

#include "doppel/review/doctor/findings.h"

namespace doppel::doctor {
namespace {

constexpr int kFewCores = 2;
constexpr std::int64_t kMemlockForHardware = std::int64_t{512}
                                             << 20;  // what a twin with its engine holds, and more

Finding judge_cores(const ProcessorFacts& facts) {
  const std::string what =
      facts.usable_cores < facts.cores
          ? fmt::format("{} of {} cores are given to this process", facts.usable_cores, facts.cores)
          : fmt::format("{} core{}", facts.cores, facts.cores == 1 ? "" : "s");
  Finding finding{Level::ok, "processor", "cores", what, "", ""};
  if (facts.usable_cores < kFewCores) {
    finding.level = Level::note;
    finding.why = "physics, server and ROS 2's network share one core: the twin may fall behind real time";
    finding.remedy = "give it a second core, or watch the factor that `doppel up` shows";
  } else if (facts.load > 1.5 * facts.usable_cores) {
    finding.level = Level::note;
    finding.what += fmt::format("; {:.1f} processes want them (load of the last minute)", facts.load);
    finding.why = "the twin falls behind real time while others use the processor";
    finding.remedy = "end what is not needed, or use --speed 0.5";
  }
  return finding;
}

Finding judge_governor(const ProcessorFacts& facts) {
  if (facts.governor != "powersave")
    return {
        Level::ok,
        "processor",
        "governor",
        facts.governor.empty() ? "the frequency governor is not visible here" : "governor " + facts.governor,
        "",
        ""};
  return {Level::note,
          "processor",
          "governor",
          "governor powersave",
          "each cycle may start on a slow core: latencies of hardware loops vary more",
          "cpupower frequency-set -g performance, while hardware runs"};
}

Finding judge_scheduling(const ProcessorFacts& facts) {
  if (facts.scheduling_failure.empty())
    return {Level::ok, "real time", "realtime.priority", "threads may have real-time priority (SCHED_FIFO)",
            "",        ""};
  return {Level::note,
          "real time",
          "realtime.priority",
          fmt::format("no real-time priority: {} (RLIMIT_RTPRIO is {})", facts.scheduling_failure,
                      facts.rtprio_limit < 0 ? "unlimited" : std::to_string(facts.rtprio_limit)),
          "simulations do not need it; the loop of real hardware runs at normal priority, and late cycles "
          "are counted",
          "add '@realtime - rtprio 98' to /etc/security/limits.conf, join the group realtime, log in again"};
}

Finding judge_memlock(const ProcessorFacts& facts) {
  const bool enough = facts.memlock_limit < 0 || facts.memlock_limit >= kMemlockForHardware;
  const std::string amount =
      facts.memlock_limit < 0 ? "without limit" : fmt::format("{} MiB", facts.memlock_limit >> 20);
  if (enough) return {Level::ok, "real time", "realtime.memory", "memory can be locked, " + amount, "", ""};
  return {Level::note,
          "real time",
          "realtime.memory",
          fmt::format("only {} of memory can be locked", amount),
          "simulations do not need it; the loop of real hardware may wait for a page that was swapped out",
          "add '@realtime - memlock unlimited' to /etc/security/limits.conf, join the group realtime, log in "
          "again"};
}

Finding judge_kernel(const ProcessorFacts& facts) {
  if (facts.has_preempt_rt)
    return {Level::ok, "real time", "realtime.kernel", fmt::format("kernel {} (PREEMPT_RT)", facts.kernel),
            "",        ""};
  return {Level::note,
          "real time",
          "realtime.kernel",
          fmt::format("kernel {} without PREEMPT_RT", facts.kernel),
          "simulations do not need it; cycles of real hardware may be late by a millisecond now and then",
          "for hardware at 500 Hz and above: apt install linux-image-rt-amd64"};
}

}  // namespace

std::vector<Finding> judge_processor(const ProcessorFacts& facts) {
  return {judge_cores(facts), judge_governor(facts), judge_scheduling(facts), judge_memlock(facts),
          judge_kernel(facts)};
}

}  // namespace doppel::doctor
