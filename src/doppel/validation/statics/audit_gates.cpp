#include "doppel/validation/statics/audit_gates.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "doppel/scenario/resolve/controllers_file.h"
#include "doppel/validation/statics/detail/audit_split.h"

namespace doppel {
namespace {

// Findings of the audit that are errors for a machine that is to be trusted: no simulation forgives them,
// and a person who means them waives them. The audit grades them lower, because public robots have them as
// placeholders.
constexpr std::array<std::string_view, 9> kFatal = {
    "inertia.identity",     "inertia.zero",         "inertia.mass_zero",     "inertia.com_outside",
    "mesh.missing",         "joint.limits_degrees", "joint.exporter_effort", "joint.exporter_velocity",
    "srdf.hidden_collision"};

// Notes of the audit that are errors here, too: each is certain, and its fix is another one than for a
// description that is only looked at.
struct FatalNote {
  std::string_view rule, fix;
};
constexpr std::array<FatalNote, 2> kFatalNotes = {
    {{"inertia.units", "convert it to kg, m and kg m^2; waive it if it is a placeholder"},
     {"controllers.uncontrolled_joint", "add it to a controller's joints, or remove its command interface"}}};

bool starts_with_any(std::string_view rule, std::initializer_list<std::string_view> prefixes) {
  return std::ranges::any_of(prefixes, [rule](std::string_view prefix) { return rule.starts_with(prefix); });
}

std::size_t failures(const CheckResult& result) {
  return static_cast<std::size_t>(std::ranges::count(result.items, Verdict::failed, &CheckItem::verdict));
}

std::string count_text(const CheckResult& result, std::string_view otherwise) {
  const std::size_t errors = failures(result), warnings = result.items.size() - errors;
  if (errors > 0) return fmt::format("{} error{} (limit 0)", errors, errors == 1 ? "" : "s");
  if (warnings > 0) return fmt::format("0 errors, {} warning{}", warnings, warnings == 1 ? "" : "s");
  return std::string(otherwise);
}

}  // namespace

AuditPart part_of_rule(std::string_view rule) {
  if (starts_with_any(rule, {"inertia.", "urdf.inertial"})) return AuditPart::inertias;
  if (starts_with_any(rule, {"joint.", "datasheet.", "mimic.", "urdf.limits_crossed"}))
    return AuditPart::limits;
  if (starts_with_any(rule, {"mesh.", "shape.", "collision."})) return AuditPart::meshes;
  if (rule == "srdf.hidden_collision") return AuditPart::collisions;
  if (starts_with_any(rule, {"controllers.", "ros2_control.", "transmission.", "gazebo."}))
    return AuditPart::control;
  return AuditPart::parsing;
}

void add_findings(const AuditReport& report, AuditPart part, CheckResult& out) {
  for (const Finding& finding : report.findings) {
    if (part_of_rule(finding.rule) != part) continue;
    const auto note = std::ranges::find(kFatalNotes, finding.rule, &FatalNote::rule);
    const bool is_fatal_note = note != kFatalNotes.end();
    if (finding.severity == Severity::note && !is_fatal_note) continue;
    const bool fails = finding.severity == Severity::error || is_fatal_note ||
                       std::ranges::find(kFatal, finding.rule) != kFatal.end();
    const RuleInfo* const rule = find_rule(finding.rule);
    std::string fix = finding.fix;
    if (fix.empty() && rule != nullptr) fix = rule->fix;
    if (finding.severity == Severity::note) fix = note->fix;
    out.add({finding.subject, fails ? Verdict::failed : Verdict::warned,
             fmt::format("{} [{}]", finding.message, finding.rule), std::move(fix), finding.where});
  }
}

CheckResult check_inertias(const CheckContext& context) {
  CheckResult out = begin_result("G04");
  add_findings(context.subject.audit, AuditPart::inertias, out);
  out.metrics.push_back({"errors", "", static_cast<double>(failures(out)), "", 0.0});
  out.metrics.push_back(
      {"mass", "", context.subject.audit.mass, "kg", std::nullopt, Metric::Better::neither});
  out.summary = count_text(
      out, fmt::format("{:.4g} kg in {} links", context.subject.audit.mass, context.subject.audit.links));
  return out;
}

CheckResult check_limits(const CheckContext& context) {
  CheckResult out = begin_result("G06");
  add_findings(context.subject.audit, AuditPart::limits, out);
  out.metrics.push_back({"errors", "", static_cast<double>(failures(out)), "", 0.0});
  std::size_t limited = 0;
  for (const ModelJoint& joint : context.subject.model->joints)
    limited += joint.scalar() && !joint.mimics() && joint.lower > -kInfinity ? 1 : 0;
  out.summary = count_text(out, fmt::format("{} joints with limits", limited));
  return out;
}

void add_control_findings(const CheckContext& context, CheckResult& out) {
  add_findings(context.subject.audit, AuditPart::control, out);
  // A twin makes what the files lack, so that it moves; the machine itself has nothing in its place.
  const RobotSetup& setup = context.subject.robot().setup();
  const ControllersFile declared = controllers_in(setup.controllers);
  const bool broadcasts = std::ranges::any_of(declared.controllers, [](const DeclaredController& one) {
    return one.type == "joint_state_broadcaster/JointStateBroadcaster";
  });
  if (setup.controllers_files.empty() || declared.controllers.empty() || broadcasts) return;
  out.fail(setup.controllers_files.front().filename().string(),
           "no joint_state_broadcaster is declared: a twin publishes joint states by itself, and with ROS 2 "
           "nobody does, so that robot_state_publisher has no transforms of moving links",
           "declare joint_state_broadcaster with the type joint_state_broadcaster/JointStateBroadcaster",
           declared.controllers.front().where);
}

}  // namespace doppel
