#pragma once
// The audit that `doppel check` prints and /doppel/health publishes.

#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "doppel/export.h"
#include "doppel/review/audit/audit.h"
#include "doppel/scenario/compile/compiled_robot.h"
#include "doppel/scenario/resolve/open_target.h"
#include "doppel/scenario/schema/scenario.h"

namespace doppel {

// The folders of bundled data.
struct BundledFolders {
  std::filesystem::path robots, datasheets;
};

// The audit of a target with its package. Throws InputError as the expansion does.
DOPPEL_API AuditReport audit_target(OpenedTarget& target, AuditOptions options);

// Misspelt elements and attributes of a description that was read, as warnings; a robot from a text has none.
DOPPEL_API void report_misspellings(const ExpandedDescription& description, Diagnostics& diagnostics);
DOPPEL_API void report_misspellings(const CompiledRobot& robot, Diagnostics& diagnostics);

// Runs the scenario for one second of simulated time with its controllers and without commands: findings for
// what moves, oscillates or diverges. Throws InputError if the robot cannot be started.
DOPPEL_API std::vector<Finding> audit_run(const Scenario& scenario);

struct AuditResult {
  AuditReport report;
  std::optional<InputError> refused;  // the target cannot be audited; the report has the reason
};
// The result of `look`, or the InputError that it throws; paths are relative to the working directory.
// `target`: as the user named it.
DOPPEL_API AuditResult audit_result(const std::string& target, const std::function<AuditReport()>& look);

// The errors of an audit in one line, from the audit's thread to the terminal's. Any thread.
class DOPPEL_API ErrorSummary {
 public:
  void set(std::string line);
  // The line, if it differs from the last one that was taken; "": the errors are gone.
  std::optional<std::string> take();

 private:
  std::mutex mutex_;
  std::string line_, taken_;
};
// "2 errors, for example link 'b': its mesh is ... [mesh.unit]; 'doppel check b.urdf' lists all"; "": none.
DOPPEL_API std::string error_summary(const AuditReport& report, const std::string& target);

// The output of `doppel check TARGET --json` for a robot's description with its arguments, including those
// that select simulation; `errors` receives their summary. Does not throw: an error is a finding.
DOPPEL_API std::string health_json(const WorldRobot& robot, const BundledFolders& bundled,
                                   ErrorSummary* errors = nullptr);

}  // namespace doppel
