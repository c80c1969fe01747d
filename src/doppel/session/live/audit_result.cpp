#include "doppel/session/live/audit_result.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "doppel/lab/headless_run/headless_run.h"
#include "doppel/review/audit/report_places.h"
#include "doppel/scenario/resolve/open_target.h"

namespace doppel {

AuditReport audit_target(OpenedTarget& target, AuditOptions options) {
  options.package_folder = target.target.package_folder;
  return audit(target.target.description, target.arguments, target.resolver, options);
}

void report_misspellings(const ExpandedDescription& description, Diagnostics& diagnostics) {
  for (Finding& finding : misspellings(description))
    diagnostics.warning(finding.rule, finding.where, finding.message, finding.fix);
}

void report_misspellings(const CompiledRobot& robot, Diagnostics& diagnostics) {
  if (robot.setup().expanded != nullptr) report_misspellings(*robot.setup().expanded, diagnostics);
}

std::vector<Finding> audit_run(const Scenario& scenario) {
  constexpr Duration kRun{1'000'000'000};
  const RunResult result = run_headless({scenario, {.duration = kRun, .at_rest = true}});
  result.throw_if_failed();
  std::vector<Finding> out;
  for (const RunFinding& found : result.findings) {
    Finding& finding = out.emplace_back();
    finding.rule = found.rule;
    finding.subject =
        found.joint.empty() ? fmt::format("robot '{}'", found.robot) : fmt::format("joint '{}'", found.joint);
    finding.message = found.message;
    finding.where = found.where;
  }
  return out;
}

AuditResult audit_result(const std::string& target, const std::function<AuditReport()>& look) {
  const std::filesystem::path here = std::filesystem::current_path();
  try {
    AuditReport report = look();
    shorten_places(report, here);
    return {std::move(report), std::nullopt};
  } catch (const InputError& error) {
    InputError refused = with_short_places(error, here);
    AuditReport report = refusal_report(refused, target);
    return {std::move(report), std::move(refused)};
  }
}

void ErrorSummary::set(std::string line) {
  const std::lock_guard lock(mutex_);
  line_ = std::move(line);
}

std::optional<std::string> ErrorSummary::take() {
  const std::lock_guard lock(mutex_);
  if (line_ == taken_) return std::nullopt;
  taken_ = line_;
  return line_;
}

std::string error_summary(const AuditReport& report, const std::string& target) {
  const std::size_t errors = report.count(Severity::error);
  if (errors == 0) return "";
  const auto first = std::ranges::find(report.findings, Severity::error, &Finding::severity);
  return fmt::format("{}{}{}: {} [{}]; 'doppel check {}' {}",
                     errors == 1 ? "1 error: " : fmt::format("{} errors, for example ", errors),
                     first->subject, first->subject.empty() ? "the description" : "", first->message,
                     first->rule, target, errors == 1 ? "prints its consequence and fix" : "lists all");
}

std::string health_json(const WorldRobot& robot, const BundledFolders& bundled, ErrorSummary* errors) {
  const auto look = [&] {
    OpenedTarget target = open_target(robot.target, robot.arguments, bundled.robots);
    Diagnostics reported_at_start;
    target.arguments = simulation_arguments(target.target.description, std::move(target.arguments),
                                            target.resolver, reported_at_start);
    AuditOptions options;
    if (!robot.controllers.empty()) options.controllers = robot.controllers.front();
    options.datasheet_folder = bundled.datasheets;
    return audit_target(target, options);
  };
  try {
    const AuditReport report = audit_result(robot.target, look).report;
    if (errors != nullptr) errors->set(error_summary(report, robot.target));
    return to_json(report);
  } catch (const std::exception& error) {
    return to_json(refusal_report(
        InputError("health.failed", {}, std::string("the description could not be checked: ") + error.what()),
        robot.target));
  }
}

}  // namespace doppel
