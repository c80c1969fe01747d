#pragma once
// The results of a validation, for reports (validation/reports) and later comparisons.

#include <cstdint>
#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/scenario/schema/scenario_file.h"
#include "doppel/validation/checks/check.h"
#include "doppel/validation/checks/context.h"

namespace doppel {

// A metric that is worse than in an earlier report, beyond the tolerance.
struct Regression {
  std::string check;
  Metric metric;      // as it is now
  double before = 0;  // in the metric's unit
};

struct DOPPEL_API ValidationReport {
  std::string robot, target;  // target: as the user named it
  std::string version;        // of doppel
  std::string engine;         // with its version
  std::uint64_t seed = 1;
  Effort effort = Effort::standard;
  std::string suite;                // its file; empty: there is none
  std::vector<ReadFile> files;      // that were read, with their hashes
  std::vector<CheckResult> checks;  // in the order of check_table()
  std::vector<std::string> notes;   // about the suite: waivers that expire, limits without a joint
  // Numbers that are worse, and those that are better, than in an earlier run by more than the tolerance.
  std::vector<Regression> regressions, improvements;
  bool strict = false;   // warnings and what is not judged count as failures
  bool complete = true;  // false: it was ended before all checks had run
  double seconds = 0;    // of wall-clock time

  [[nodiscard]] bool passed() const;
  [[nodiscard]] std::size_t count(Verdict verdict) const;
};

}  // namespace doppel
