#include "doppel/validation/statics/audit_gates.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "doppel/validation/statics/detail/audit_split.h"

namespace doppel {
namespace {

// Findings of the audit that are errors for a machine that is to be trusted: no simulation forgives them,
// and a person who means them waives them. The audit grades them lower, because public robots have them as
// placeholders.
constexpr std::array<std::string_view, 9> kFatal = {
    "inertia.identity",     "inertia.zero",          "inertia.mass_zero",
    "inertia.com_outside",  "inertia.units",         "mesh.missing",
    "joint.limits_degrees", "joint.exporter_effort", "joint.exporter_velocity"};
// Also as notes.
constexpr std::array<std::string_view, 1> kFatalNotes = {"inertia.units"};

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
  if (starts_with_any(rule, {"controllers.", "ros2_control.", "transmission.", "gazebo."}))
    return AuditPart::control;
  return AuditPart::parsing;
}

void add_findings(const AuditReport& report, AuditPart part, CheckResult& out) {
  for (const Finding& finding : report.findings) {
    const bool is_fatal_note = std::ranges::find(kFatalNotes, finding.rule) != kFatalNotes.end();
    if ((finding.severity == Severity::note && !is_fatal_note) || part_of_rule(finding.rule) != part)
      continue;
    const bool fails =
        finding.severity == Severity::error || std::ranges::find(kFatal, finding.rule) != kFatal.end();
    out.add({finding.subject, fails ? Verdict::failed : Verdict::warned,
             fmt::format("{} [{}]", finding.message, finding.rule), finding.fix, finding.where});
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
}

}  // namespace doppel
