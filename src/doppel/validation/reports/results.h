#pragma once
// The results of a validation as JSON (docs/validate.schema.json), and the comparison with earlier ones.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/validation/checks/validation_report.h"

namespace doppel {

inline constexpr int kResultsVersion = 1;  // of the schema

struct ResultsOptions {
  // The member "timing": seconds of each check, and metrics that differ from run to run. False: it is left
  // out, as are the sentences of checks that have such metrics, so that the text depends on the inputs and
  // the seed alone.
  bool wall_clock = true;
  // For a page: items have "curves" (docs/validate.schema.json) with at most kMaxCurvePoints points each, and
  // poses the "command" that moves a twin there.
  bool evidence = false;
};
inline constexpr std::size_t kMaxCurvePoints = 400;
// A number that is not finite is null.
DOPPEL_API std::string to_json(const ValidationReport& report, const ResultsOptions& options = {});

// "not_applicable": the name of a verdict in files.
DOPPEL_API std::string verdict_key(Verdict verdict);

struct BaselineMetric {
  std::string check, subject, name, unit;
  double value = 0;  // NaN: it was not finite
};
struct Baseline {
  std::filesystem::path file;
  std::string robot;
  std::uint64_t seed = 1;
  std::string effort;                   // "standard"
  std::vector<BaselineMetric> metrics;  // without those of wall-clock time
};
// Throws InputError: unreadable, not JSON, not such results ("baseline.not_results"), or of another version
// of the schema ("baseline.version").
DOPPEL_API Baseline read_results(const std::filesystem::path& file);

// Metrics with a better direction that are worse, or better, than before by more than `tolerance`, a share of
// the value before. Metrics of wall-clock time, and those that one side does not have in the same unit, are
// left out. In the order of the report.
DOPPEL_API std::vector<Regression> regressions(const ValidationReport& report, const Baseline& baseline,
                                               double tolerance);
DOPPEL_API std::vector<Regression> improvements(const ValidationReport& report, const Baseline& baseline,
                                                double tolerance);

// Makes paths below the folder relative to it, in places, messages and the list of files.
DOPPEL_API void shorten_places(ValidationReport& report, const std::filesystem::path& folder);

}  // namespace doppel
