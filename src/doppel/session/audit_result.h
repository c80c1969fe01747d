#pragma once
// What `doppel check` prints of a description, and what /doppel/health tells of the one that is up.

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "doppel/audit/audit.h"
#include "doppel/export.h"
#include "doppel/target/target.h"
#include "doppel/twin/scenario.h"

namespace doppel {

// What ships with doppel beside the program.
struct BundledFolders {
  std::filesystem::path robots, datasheets;
};

// The audit of a target, with the package that it belongs to.
DOPPEL_API AuditReport audit_target(OpenedTarget& target, AuditOptions options);

// Runs the scenario for a second with its controllers and without a command: what moves, oscillates or runs
// away, as findings. Throws InputError: the robot does not come up.
DOPPEL_API std::vector<Finding> audit_run(const Scenario& scenario);

struct AuditResult {
  AuditReport report;
  std::optional<InputError> refused;  // there is nothing to judge; the report says why
};
// What `look` finds, or the InputError that it throws; places are short, by the working folder. `target`: as
// the user named it.
DOPPEL_API AuditResult audit_result(const std::string& target, const std::function<AuditReport()>& look);

// `doppel check TARGET --json` for a robot's description: with its arguments, those that choose simulation
// included. Never throws: what goes wrong is a finding.
DOPPEL_API std::string health_json(const WorldRobot& robot, const BundledFolders& bundled);

}  // namespace doppel
