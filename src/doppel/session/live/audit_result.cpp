#include "doppel/session/live/audit_result.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "doppel/review/audit/report_places.h"
#include "doppel/scenario/resolve/open_target.h"
#include "doppel/twin/assembly/twin.h"

namespace doppel {

AuditReport audit_target(OpenedTarget& target, AuditOptions options) {
  options.package_folder = target.target.package_folder;
  return audit(target.target.description, target.arguments, target.resolver, options);
}

namespace {

constexpr double kFarOff = 0.05, kSlideFarOff = 0.005;  // rad, m: from the target, at the effort limit

// Joints whose drives cannot hold them, although they may be at rest now.
void find_weak(const Instance& robot,
               const std::function<void(const char*, const std::string&, const std::string&)>& add) {
  for (std::size_t j = 0; j < robot.model().joints.size(); ++j) {
    const ModelJoint& joint = robot.model().joints[j];
    const int index = static_cast<int>(j);
    if (!joint.scalar() || robot.drive(index) != DriveMode::position) continue;
    const bool slides = joint.type == JointType::prismatic;
    const double off = robot.drive_target(index) - robot.q()[static_cast<std::size_t>(joint.q)];
    const double limit = robot.made_of().servos[j].effort;
    if (std::abs(off) < (slides ? kSlideFarOff : kFarOff)) continue;
    if (!at_effort_limit(robot, index)) continue;
    add("run.unrest", joint.name,
        fmt::format("joint '{}' is {:.3g} {} from its held position: its effort limit of {:.3g} {} is too "
                    "low for the load",
                    joint.name, std::abs(off), slides ? "m" : "rad", limit, slides ? "N" : "N m"));
  }
}

}  // namespace

std::vector<Finding> audit_run(const Scenario& scenario) {
  constexpr Duration kRun{1'000'000'000};
  const Log null_log;
  Diagnostics ignored;
  Twin twin(scenario, null_log, ignored);
  while (!twin.diverged() && twin.now() < Time(kRun)) {
    twin.between_steps();
    twin.step();
  }
  twin.between_steps();
  const RobotDescription& robot = twin.robot().description();
  std::vector<Finding> out;
  const auto add = [&](const char* rule, const std::string& joint, const std::string& message) {
    const Joint* const source = robot.find_joint(joint);
    Finding finding;
    finding.rule = rule;
    finding.subject =
        source != nullptr ? fmt::format("joint '{}'", joint) : fmt::format("robot '{}'", robot.name);
    finding.message = message;
    finding.where = source != nullptr ? source->source : robot.source;
    out.push_back(std::move(finding));
  };
  if (twin.diverged()) {
    add("run.diverged", "",
        fmt::format("the simulation diverges {:.3f} s after the start", to_seconds(twin.now())));
    return out;
  }
  for (UnsettledJoint& unsettled : find_unsettled_joints(robot, twin.robot().instance())) {
    unsettled.where = {};  // the finding's own
    const ModelJoint& joint = twin.robot().model().joints[static_cast<std::size_t>(
        twin.robot().model().find_joint(unsettled.joint))];
    add("run.unrest", unsettled.joint, to_string(unsettled, joint.type == JointType::prismatic));
  }
  if (out.empty()) find_weak(twin.robot().instance(), add);
  for (const OscillationReport& found : twin.robot().oscillations())
    add("run.oscillation", found.joint, found.message);
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
    options.controllers = robot.controllers;
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
