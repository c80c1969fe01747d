#pragma once
// The result of a check: a gate (G01 to G15), a test (T1 to T6) or an extra (X1 to X11) of docs/validate.md,
// with its verdict, its numbers beside their limits, and the evidence.

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "doppel/base/core/source_location.h"
#include "doppel/export.h"
#include "doppel/lab/curve_plot/curve_plot.h"

namespace doppel {

// From the best to the worst: a check is as bad as its worst item.
enum class Verdict {
  not_applicable,  // the machine has nothing that the check judges, with the reason
  passed,
  waived,      // failed, and the suite says why that is accepted
  warned,      // passed, with something that a person should know
  not_judged,  // a person has to decide, or a limit is missing
  not_run,     // another check that it needs has failed, or the run has ended before
  failed,
};
DOPPEL_API std::string_view to_string(Verdict verdict);  // "passed", "not applicable"
// True: `failed` and `not_run`, with `strict` also `warned` and `not_judged`.
DOPPEL_API bool is_failure(Verdict verdict, bool strict);

// A number that a later run is compared with.
struct Metric {
  std::string name;     // "settling"
  std::string subject;  // "Revolute 2", or empty: of the machine
  double value = 0;
  std::string unit;  // "s", "rad", "%"
  std::optional<double> limit = {};
  enum class Better { neither, lower, higher } better = Better::lower;
  bool wall_clock = false;  // it differs from run to run
};

// A configuration that shows what a sentence says.
struct PosedEvidence {
  std::string caption;
  std::vector<std::pair<std::string, double>> joints;  // scalar joints that are no mimics, rad or m
  std::vector<std::string> links = {};                 // that the sentence names
};

// One statement about one part of the machine.
struct CheckItem {
  std::string subject;  // "Revolute 2", "link wrist", or empty
  Verdict verdict = Verdict::passed;
  std::string message;  // number, limit and cause, without a full stop
  std::string fix = {};
  SourceLocation where = {};
  std::vector<PosedEvidence> poses = {};
  std::vector<PlotPanel> curves = {};
  std::string recording = {};  // the file of CheckResult::recordings that shows it; empty: there is none
};

// The motion of a failure as an MCAP file, which is written beside a report.
struct FailureRecording {
  std::string file;  // "T4_Revolute_2.mcap"
  std::shared_ptr<const std::vector<std::byte>> bytes;
};

struct DOPPEL_API CheckResult {
  std::string id, title;
  Verdict verdict = Verdict::passed;
  std::string summary;           // the decisive number with its limit, in a line
  std::vector<CheckItem> items;  // the worst first, once it is finished
  std::vector<Metric> metrics;
  std::vector<std::string> notes;  // without an effect on the verdict
  std::vector<FailureRecording> recordings;
  double seconds = 0;  // of wall-clock time

  // Adds an item; the verdict becomes the worse of the two.
  CheckItem& add(CheckItem item);
  void fail(std::string subject, std::string message, std::string fix = "", SourceLocation where = {});
};

// The checks that `doppel validate` can run.
enum class CheckKind { gate, test, extra };
struct CheckInfo {
  std::string_view id, title;
  CheckKind kind = CheckKind::gate;
  std::string_view decided_by;  // a sentence without a full stop
  std::string_view limit;       // the default: "overshoot 10 %, settling 0.5 s, error 0.01 rad"
};
// In the order of reports. Any thread.
DOPPEL_API const std::vector<CheckInfo>& check_table();
DOPPEL_API const CheckInfo* find_check(std::string_view id);  // nullptr: there is none
// A result with the id and title of the table. Precondition: the table has it.
DOPPEL_API CheckResult begin_result(std::string_view id);
DOPPEL_API CheckResult not_applicable(std::string_view id, std::string reason);

}  // namespace doppel
