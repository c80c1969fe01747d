#include "doppel/validation/checks/subject.h"

#include <algorithm>

#include "doppel/scenario/resolve/described_arms.h"
#include "doppel/scenario/resolve/joint_groups.h"
#include "doppel/scenario/resolve/open_target.h"

namespace doppel {
namespace {

struct Audited {
  AuditReport report;
  AuditOptions options;
};

Audited audit_of(const Scenario& scenario, const SubjectOptions& options, Subject& out) {
  const WorldRobot& robot = scenario.robots.front();
  OpenedTarget opened = open_target(robot.target, robot.arguments, scenario.bundled_robots);
  out.target = opened.target;
  opened.arguments = simulation_arguments(opened.target.description, std::move(opened.arguments),
                                          opened.resolver, out.notes);
  AuditOptions auditing;
  if (!robot.controllers.empty()) auditing.controllers = robot.controllers.front();
  auditing.datasheet = options.datasheet;
  auditing.datasheet_folder = options.datasheets;
  auditing.package_folder = opened.target.package_folder;
  AuditReport report = audit(opened.target.description, opened.arguments, opened.resolver, auditing);
  Diagnostics reported_by_audit;
  ExpandedDescription expanded =
      expand_description(opened.target.description, opened.arguments, opened.resolver, reported_by_audit);
  out.overlays = apply_overlays(expanded, opened.resolver, reported_by_audit);
  return {std::move(report), std::move(auditing)};
}

void find_arms_of(Subject& out) {
  PackageResolver resolver = out.compiled->resolver;
  const RobotSetup& setup = out.robot().setup();
  Diagnostics none;
  out.arms = described_arms(*out.model, out.description(), &setup.target, resolver,
                            joint_groups(controllers_in(setup.controllers)), none);
  std::ranges::stable_sort(out.arms, std::greater(), [](const ArmGroup& arm) { return arm.chain.size(); });
}

}  // namespace

std::filesystem::path Subject::validation_folder() const {
  const std::filesystem::path package = target.package_folder;
  return (package.empty() ? std::filesystem::absolute(target.description).parent_path() : package) /
         "validation";
}

Subject read_subject(const Scenario& scenario, const SubjectOptions& options) {
  Subject out;
  out.scenario = scenario;
  // The physics is judged. Devices, real or emulated, belong to the running robot, and cannot be saved.
  out.scenario.hardware = HardwareUse::simulated;
  Audited audited = audit_of(scenario, options, out);
  out.audit = std::move(audited.report);
  out.name = out.audit.robot;
  try {
    out.compiled = std::make_shared<const CompiledScenario>(out.scenario, out.notes);
    Diagnostics none;
    out.model = std::make_shared<const Model>(compile_model(out.description(), BaseKind::fixed, none));
    out.files = files_with_hashes(out.compiled->files());
    out.precision = drive_precision(out.description(), audited.options);
    find_arms_of(out);
  } catch (const InputError& error) {
    // An engine that is not there is no fault of the machine.
    if (error.diagnostics().front().rule.starts_with("physics.engine")) throw;
    out.refusal = error.diagnostics();
    out.compiled = nullptr;
    out.files = files_with_hashes({out.target.description});
  }
  return out;
}

}  // namespace doppel
