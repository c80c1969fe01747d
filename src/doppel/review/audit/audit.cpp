#include "doppel/review/audit/audit.h"

#include <algorithm>
#include <cassert>
#include <tuple>

#include "doppel/control/hardware/hardware_registry.h"
#include "doppel/description/gazebo/sensor_reader.h"
#include "doppel/description/overlay/overlay.h"
#include "doppel/description/urdf/urdf_parser.h"
#include "doppel/devices/drivers/servo_hardware.h"
#include "doppel/review/audit/detail/description_facts.h"
#include "doppel/review/audit/detail/rules.h"
#include "doppel/sensors/models/sensor_binding.h"

namespace doppel {
namespace audit_rules {

Finding& Findings::add(std::string_view rule, Severity severity, std::string subject, SourceLocation where,
                       std::string message, std::string fix) {
  assert(find_rule(rule) != nullptr && "every rule is in the table");
  Finding finding;
  finding.rule = rule;
  finding.severity = severity;
  finding.subject = std::move(subject);
  finding.message = std::move(message);
  finding.where = std::move(where);
  finding.fix = std::move(fix);
  return all_.emplace_back(std::move(finding));
}

Finding& Findings::add(std::string_view rule, std::string subject, SourceLocation where, std::string message,
                       std::string fix) {
  const RuleInfo* info = find_rule(rule);
  return add(rule, info == nullptr ? Severity::error : info->severity, std::move(subject), std::move(where),
             std::move(message), std::move(fix));
}

const Finding* Findings::find(std::string_view rule, std::string_view subject) const {
  const auto found = std::find_if(all_.begin(), all_.end(),
                                  [&](const Finding& f) { return f.rule == rule && f.subject == subject; });
  return found == all_.end() ? nullptr : &*found;
}

namespace {

void add_skipped(const Diagnostic& d, Findings& out) {
  const std::string name =
      d.where.known() ? std::filesystem::path(*d.where.file).filename().string() : "the package";
  out.add(d.rule, d.severity == Severity::error ? Severity::note : d.severity, name, d.where, d.message,
          d.fix);
}

}  // namespace

void report_skipped(const InputError& error, Findings& out) {
  for (const Diagnostic& d : error.diagnostics()) add_skipped(d, out);
}

void report_skipped(const Diagnostics& skipped, Findings& out) {
  for (const Diagnostic& d : skipped.all()) add_skipped(d, out);
}

}  // namespace audit_rules

namespace {

using audit_rules::Findings;
using audit_rules::holds;

// "joint 'Revolute 1'": the element below <robot> that contains the place.
std::string subject_at(const XmlNode& root, const SourceLocation& where) {
  if (!where.known()) return "";
  for (const XmlNode& child : root.children) {
    if (child.kind != XmlNode::Kind::element || !holds(child, where)) continue;
    const XmlAttribute* name = child.find("name");
    if (name == nullptr) name = child.find("reference");
    return name == nullptr ? fmt::format("<{}>", child.name)
                           : fmt::format("{} '{}'", child.name, name->value);
  }
  return "the robot";
}

// The parser warns about parts that it can leave out, and continues; the severity is that of the rule.
void take_over(const Diagnostics& diagnostics, const XmlNode& root, Findings& out) {
  for (const Diagnostic& d : diagnostics.all()) {
    const RuleInfo* const rule = d.rule.starts_with("urdf.") ? find_rule(d.rule) : nullptr;
    const Severity severity = rule != nullptr ? std::max(d.severity, rule->severity) : d.severity;
    out.add(d.rule, severity, subject_at(root, d.where), d.where, d.message, d.fix);
  }
}

std::optional<Model> compile(const RobotDescription& robot, const XmlNode& root, Findings& out) {
  // Assumptions and repairs of the compilation are reported by the rules on joints and inertia
  // in more detail.
  Diagnostics assumptions;
  try {
    return compile_model(robot, BaseKind::fixed, assumptions);
  } catch (const InputError& error) {
    Diagnostics refused;
    for (const Diagnostic& d : error.diagnostics()) refused.add(d);
    take_over(refused, root, out);
    return std::nullopt;
  }
}

// Uses the functions of a running twin, so that both report the same.
void check_sensors(const RobotDescription& robot, const Model& model, Diagnostics& out) {
  const RobotSensors sensors = find_sensors(robot, model, out);
  HardwareRegistry hardware_types = HardwareRegistry::with_builtin();
  register_servo_hardware(hardware_types);
  for (const HardwareDescription& hardware : robot.hardware) {
    const HardwareRegistry::Type* const type = hardware_types.find(hardware.plugin);
    if (type != nullptr && type->kind == HardwareKind::real) continue;  // it reads its own sensors
    const SensorBindings bindings = bind_sensors(hardware, model, sensors);
    for (const Diagnostic& one :
         bindings.unbound.all())  // other hardware may have what simulated sensors do not
      out.warning(one.rule, one.where, one.message, one.fix);
  }
}

void apply_rules(const AuditInput& in, Findings& out) {
  using namespace audit_rules;
  // Meshes and shapes come before the inertias that are compared with them, so that a fault is reported once.
  for (const auto check :
       {check_schema, check_joints, check_origins, check_mimics, check_meshes, check_shapes, check_inertia,
        check_names, check_collisions, check_ros2_control, check_calibration, check_controllers,
        check_package, check_srdf, check_world, check_datasheet}) {
    try {
      check(in, out);
    } catch (const InputError&) {
      throw;  // a file that the caller chose
    } catch (const std::exception& error) {
      out.add("audit.skipped", "the robot", {},
              fmt::format("some rules could not be applied: {}", error.what()));
    }
  }
}

void sort_by_weight(std::vector<Finding>& findings, const std::vector<std::filesystem::path>& files) {
  const auto file_rank = [&](const Finding& f) {
    if (!f.where.known()) return files.size() + 1;
    return static_cast<std::size_t>(std::find(files.begin(), files.end(), *f.where.file) - files.begin());
  };
  const auto key = [&](const Finding& f) {
    return std::tuple(-static_cast<int>(f.severity), file_rank(f), f.where.line, f.where.column);
  };
  std::stable_sort(findings.begin(), findings.end(),
                   [&](const Finding& a, const Finding& b) { return key(a) < key(b); });
}

void keep_profiles(std::vector<Finding>& findings, unsigned profiles) {
  std::erase_if(findings, [&](const Finding& f) {
    const RuleInfo* rule = find_rule(f.rule);
    return rule != nullptr && (rule->profiles & profiles) == 0;
  });
}

}  // namespace

std::size_t AuditReport::count(Severity severity) const {
  return static_cast<std::size_t>(std::count_if(findings.begin(), findings.end(),
                                                [&](const Finding& f) { return f.severity == severity; }));
}

std::vector<Finding> misspellings(const ExpandedDescription& expanded) {
  const RobotDescription unread{};
  const PackageResolver resolver{};
  const AuditOptions options{};
  Findings found;
  audit_rules::check_schema({expanded, unread, nullptr, resolver, options, nullptr}, found);
  std::vector<Finding> out = std::move(found.all());
  std::erase_if(out, [](const Finding& finding) {
    const bool name = finding.rule == "schema.attribute" || finding.rule == "schema.element";
    return !name || finding.severity == Severity::note;
  });
  return out;
}

AuditReport audit(const std::filesystem::path& file, const XacroArguments& arguments,
                  PackageResolver& resolver, const AuditOptions& options) {
  Diagnostics diagnostics;
  ExpandedDescription expanded = expand_description(file, arguments, resolver, diagnostics);
  const std::vector<AppliedOverlay> overlays = apply_overlays(expanded, resolver, diagnostics);
  if (expanded.root.name != "robot") {
    throw InputError("urdf.no_robot", expanded.root.where,
                     fmt::format("the root element is <{}>, not <robot>", expanded.root.name),
                     fix_of_root(expanded.root));
  }
  const RobotDescription robot = read_description(expanded, resolver, diagnostics);
  Findings found;
  take_over(diagnostics, expanded.root, found);
  std::optional<Model> model;
  if (!diagnostics.has_errors()) model = compile(robot, expanded.root, found);
  Diagnostics of_sensors;
  if (model)
    check_sensors(robot, *model, of_sensors);
  else if (!diagnostics.has_errors())
    read_sensors(robot, of_sensors);
  take_over(of_sensors, expanded.root, found);
  apply_rules({expanded, robot, model ? &*model : nullptr, resolver, options, &overlays}, found);

  AuditReport report;
  report.robot = robot.name;
  report.file = file;
  report.findings = std::move(found.all());
  keep_profiles(report.findings, options.profiles);
  sort_by_weight(report.findings, expanded.files);
  report.links = robot.links.size();
  report.joints = robot.joints.size();
  for (const Link& link : robot.links) report.mass += link.inertial ? link.inertial->mass : 0.0;
  return report;
}

}  // namespace doppel
