#pragma once
// The machine that is validated, read once: its description with its corrections, the audit, the compiled
// robot as a twin has it, and its arms. Immutable afterwards; any number of threads share it.

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/overlay/overlay.h"
#include "doppel/description/urdf/load.h"
#include "doppel/export.h"
#include "doppel/review/audit/audit.h"
#include "doppel/review/audit/drive_precision.h"
#include "doppel/robot/reach/arm_group.h"
#include "doppel/scenario/compile/compiled_scenario.h"
#include "doppel/scenario/schema/scenario.h"
#include "doppel/scenario/schema/scenario_file.h"

namespace doppel {

struct DOPPEL_API Subject {
  Scenario scenario;  // one robot
  std::string name;   // of the robot
  Target target;
  std::vector<ReadFile> files;  // all that were read, with their hashes
  AuditReport audit;
  std::vector<AppliedOverlay> overlays;
  std::map<std::string, DrivePrecision> precision;  // of the datasheet, by joint
  // Why there is no machine: what the description, its world or its controllers' file lack. Empty: there is.
  std::vector<Diagnostic> refusal;
  std::shared_ptr<const CompiledScenario> compiled;  // nullptr with a refusal
  std::shared_ptr<const Model> model;  // of the robot alone, its root fixed; nullptr with a refusal
  std::vector<ArmGroup> arms;          // of `model`, those with the most joints first
  Diagnostics notes;                   // choices and warnings on the way

  // Precondition: no refusal.
  [[nodiscard]] const CompiledRobot& robot() const { return *compiled->robots.front(); }
  [[nodiscard]] const RobotDescription& description() const { return robot().description(); }
  // The folder of the suite and of answers that are committed: validation/ of the package, else beside the
  // description.
  [[nodiscard]] std::filesystem::path validation_folder() const;
};

struct SubjectOptions {
  std::filesystem::path datasheets;                // the library of servos
  std::optional<std::filesystem::path> datasheet;  // of the suite
};

// `scenario`: with one robot and no world. Throws InputError where there is nothing to judge: no such
// target, a file that cannot be read or is not well-formed. A description with errors is a refusal.
DOPPEL_API Subject read_subject(const Scenario& scenario, const SubjectOptions& options);

}  // namespace doppel
