#pragma once
// A run of a twin as fast as possible, without a network or a page: until a time, a condition, a divergence,
// an error or a cancellation. The same scenario gives the same hash, alone or beside others.

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/time.h"
#include "doppel/export.h"
#include "doppel/physics/contract/step_loop.h"
#include "doppel/scenario/schema/scenario.h"
#include "doppel/twin/assembly/twin.h"

namespace doppel {

// The functions are called on the thread of the run. What they throw ends it (RunEnd::failed).
struct HeadlessOptions {
  std::optional<Duration> duration = {};  // simulated, from the present time; none: no limit
  std::function<bool(Twin&)> until = {};  // asked before each step and after the last one; true: the run ends
  const std::atomic<bool>* cancel = nullptr;               // set by another thread: the run ends
  std::vector<std::function<void(Twin&)>> observers = {};  // called after each step
  bool at_rest = false;  // nothing commands the robots: what moves at the end is a finding
};

struct RunFinding {
  std::string rule;          // run.diverged, run.unrest, run.oscillation
  std::string robot, joint;  // names; joint: empty: the robot as a whole
  std::string message;
  SourceLocation where;
};

struct DOPPEL_API RunResult {
  RunEnd end = RunEnd::failed;
  std::vector<Diagnostic> errors;  // why it failed
  Diagnostics diagnostics;         // warnings and notes of the start; of a twin that was given: none
  Duration simulated{};            // in this run
  std::uint64_t steps = 0;
  std::uint64_t state_hash = 0;  // Twin::state_hash() at the end
  std::vector<RunFinding> findings;

  // Throws InputError with the errors.
  void throw_if_failed() const;
};

// Continues a twin; requests and messages are handled before each step and after the last one.
DOPPEL_API RunResult run_headless(Twin& twin, const HeadlessOptions& options);

// Builds a twin for the run. Does not throw InputError: a scenario that cannot be started has failed.
struct HeadlessRun {
  Scenario scenario;
  HeadlessOptions options;
};
DOPPEL_API RunResult run_headless(const HeadlessRun& run);

// Each of the runs in a twin of its own, `threads` at a time. The results are in the order of the runs.
DOPPEL_API std::vector<RunResult> run_headless(const std::vector<HeadlessRun>& runs, std::size_t threads);

}  // namespace doppel
