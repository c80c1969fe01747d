// Limits and the ratings of the actuators. Where another rule has already found a limit to be an exporter's
// default, the sheet adds its value and the repair to that finding; a fault is reported once.
#include <algorithm>
#include <cmath>
#include <functional>

#include "doppel/base/core/names.h"
#include "doppel/review/audit/detail/datasheet.h"
#include "doppel/review/audit/detail/ros_rules.h"
#include "doppel/review/audit/drive_precision.h"

namespace doppel::audit_rules {
namespace {

namespace fs = std::filesystem;

constexpr double kTolerance = 0.025;  // sheets and descriptions round: 1.8 kg cm is written 0.18 N m
constexpr double kFarBelow = 0.3;     // of the rating in the sheet

double two_digits(double value) {
  const double scale = std::pow(10.0, std::floor(std::log10(value)) - 1);
  const double rounded = std::round(value / scale) * scale;
  // The power of ten causes an error in the last bit; the text has none.
  return std::round(rounded * 1e9) / 1e9;
}

struct Quantity {
  const char* name;  // "effort", as in the finding's message and the operation
  const char* unit;
  double claimed = 0;
  double able = 0;
  std::string sheet;  // "DS3240: 36 kg cm at 5 V"
};

class DatasheetCheck {
 public:
  DatasheetCheck(const AuditInput& in, Findings& out) : in_(in), out_(out) {}

  void check(const JointDrive& drive, const fs::path& file) {
    const Joint* joint = in_.robot.find_joint(drive.joint);
    if (joint == nullptr) {
      const Names names = joint_names(in_.robot);
      out_.add("datasheet.unknown_joint", fmt::format("joint '{}'", drive.joint), drive.source,
               fmt::format("{} assigns an actuator to '{}', which the robot does not have{}",
                           file.filename().string(), drive.joint, did_you_mean(drive.joint, names)),
               "use the joint name of the URDF");
      return;
    }
    const bool linear = joint->type == JointType::prismatic;
    if (!driven_kind(*joint) || linear != drive.actuator.linear) return;
    const ActuatorSheet& a = drive.actuator;
    // For a voltage outside of the sheet the message contains the row that was used.
    if (const auto torque = rated(a.stall_torque, drive.voltage)) {
      limit(*joint, {"effort", linear ? "N" : "N m", claimed(*joint, true),
                     torque->value * drive.reduction * drive.count, describe(drive, *torque)});
    }
    if (const auto speed = rated(a.no_load_speed, drive.voltage)) {
      limit(*joint, {"velocity", linear ? "m/s" : "rad/s", claimed(*joint, false),
                     speed->value / drive.reduction, describe(drive, *speed)});
    }
    if (a.travel) range(*joint, *a.travel / drive.reduction, a);
  }

 private:
  static double claimed(const Joint& joint, bool effort) {
    if (!joint.limits) return 0;
    return (effort ? joint.limits->effort : joint.limits->velocity).value_or(0);
  }
  static std::string describe(const JointDrive& drive, const RatedValue& value) {
    std::string out = fmt::format("{}: {}", drive.actuator.name, value.written);
    if (drive.reduction != 1) out += fmt::format(", gear ratio {:g}", drive.reduction);
    if (drive.count != 1) out += fmt::format(", {} of them", drive.count);
    return out;
  }

  // A finding of another rule about the same limit of the same joint.
  Finding* reported_already(const std::string& subject, std::string_view quantity) {
    for (Finding& finding : out_.all()) {
      const bool same = finding.subject == subject && finding.severity != Severity::note &&
                        !finding.rule.starts_with("datasheet.");
      if (same && finding.message.find(quantity) != std::string::npos) return &finding;
    }
    return nullptr;
  }

  void limit(const Joint& joint, const Quantity& q) {
    const std::string subject = fmt::format("joint '{}'", joint.name);
    const double honest = two_digits(q.able);
    const bool above = q.claimed > q.able * (1 + kTolerance);
    const SourceLocation where = joint.limits ? joint.limits->source : joint.source;
    if (!above && q.claimed > 0) {
      if (q.claimed >= kFarBelow * q.able) return;
      out_.add("datasheet.far_below", subject, where,
               fmt::format("{} {:g} {} is {:.0f} % of the datasheet value ({}, {:.3g} {})", q.name, q.claimed,
                           q.unit, 100 * q.claimed / q.able, q.sheet, q.able, q.unit),
               "nothing, if it is a deliberate margin");
      return;
    }
    if (joint.mimic && !above) return;
    Operation operation;
    SetLimit set;
    set.joint = joint.name;
    (std::string_view(q.name) == "effort" ? set.effort : set.velocity) = honest;
    operation.action = set;
    operation.why = "the limit is the actuator's rating";
    operation.evidence = {q.sheet};
    const std::string fix = fmt::format("write {}=\"{:g}\" ({})", q.name, honest, q.sheet);
    if (Finding* other = reported_already(subject, q.name)) {
      other->fix = fix;
      if (above) other->severity = Severity::error;  // suspected before, and proven by the sheet
      if (other->repair.empty()) other->repair.push_back(std::move(operation));
      return;
    }
    if (!above) return;  // not written or 0: reported by the rules on limits
    Finding& finding = out_.add("datasheet.above", subject, where,
                                fmt::format("{} {:g} {} is above the actuator's rating ({}, {:.3g} {})",
                                            q.name, q.claimed, q.unit, q.sheet, q.able, q.unit),
                                fix);
    finding.repair.push_back(std::move(operation));
  }

  void range(const Joint& joint, double travel, const ActuatorSheet& sheet) {
    if (!joint.limits || !joint.limits->has_position || joint.type == JointType::continuous || joint.mimic)
      return;
    const double asked = joint.limits->upper - joint.limits->lower;
    if (asked <= travel * (1 + kTolerance)) return;
    const bool linear = joint.type == JointType::prismatic;
    const double show = linear ? 1000 : 180 / M_PI;
    out_.add("datasheet.travel", fmt::format("joint '{}'", joint.name), joint.limits->source,
             fmt::format("its limits span {:.1f} {}, and {} has {:.1f} of travel", asked * show,
                         linear ? "mm" : "degrees", sheet.name, travel * show),
             "narrow lower and upper to the actuator's travel, or select the version with more travel");
  }

  const AuditInput& in_;
  Findings& out_;
};

// The joints that have a motor: those that <ros2_control> commands, else all that can move and mimic nothing.
std::vector<JointDrive> all_driven(const RobotDescription& robot, const ActuatorSheet& actuator) {
  Names commanded;
  for (const HardwareDescription& hardware : robot.hardware) {
    for (const HardwareJointDescription& joint : hardware.joints) {
      if (offers_commands(joint)) commanded.push_back(joint.name);
    }
  }
  std::vector<JointDrive> out;
  for (const Joint& joint : robot.joints) {
    if (!driven_kind(joint) || joint.mimic) continue;
    if (!commanded.empty() && !contains(commanded, joint.name)) continue;
    out.push_back({joint.name, actuator, std::nullopt, 1, 1, joint.source});
  }
  return out;
}

// The package's config/actuators.yaml; of an export that is kept inside a package, that package's.
fs::path sheet_of_package(const fs::path& package) {
  std::error_code none;
  if (package.empty()) return {};
  const fs::path around = fs::absolute(package, none).lexically_normal();
  for (const fs::path& folder : {around, around.parent_path()}) {
    const fs::path own = folder / "config" / "actuators.yaml";
    if (fs::exists(folder / "package.xml", none) && fs::is_regular_file(own, none)) return own;
  }
  return {};
}

// The sheet of the options, or the package's own, whose errors are left to `refused`.
std::optional<Datasheet> chosen_sheet(
    const AuditOptions& options, const std::function<void(const fs::path&, const InputError&)>& refused) {
  if (options.datasheet) return load_datasheet(*options.datasheet, options.datasheet_folder);
  const fs::path own = sheet_of_package(options.package_folder);
  if (own.empty()) return std::nullopt;
  try {
    return load_datasheet(own, options.datasheet_folder);
  } catch (const InputError& error) {
    refused(own, error);
  }
  return std::nullopt;
}

std::vector<JointDrive> drives_of(const Datasheet& sheet, const RobotDescription& robot) {
  return sheet.actuator ? all_driven(robot, *sheet.actuator) : sheet.drives;
}

}  // namespace

void check_datasheet(const AuditInput& in, Findings& out) {
  const auto sheet = chosen_sheet(in.options, [&](const fs::path& file, const InputError& error) {
    for (const Diagnostic& d : error.diagnostics())
      out.add("datasheet.invalid", file.filename().string(), d.where, d.message, d.fix);
  });
  if (!sheet) return;
  DatasheetCheck check(in, out);
  for (const JointDrive& drive : drives_of(*sheet, in.robot)) check.check(drive, sheet->file);
}

}  // namespace doppel::audit_rules

namespace doppel {

std::map<std::string, DrivePrecision> drive_precision(const RobotDescription& robot,
                                                      const AuditOptions& options) {
  std::map<std::string, DrivePrecision> out;
  const auto sheet = audit_rules::chosen_sheet(options, [](const auto&, const InputError&) {});
  if (!sheet) return out;
  for (const JointDrive& drive : audit_rules::drives_of(*sheet, robot)) {
    const Joint* const joint = robot.find_joint(drive.joint);
    const ActuatorSheet& actuator = drive.actuator;
    if (joint == nullptr || (joint->type == JointType::prismatic) != actuator.linear) continue;
    out[drive.joint] = {actuator.name, actuator.resolution.value_or(0) / drive.reduction,
                        actuator.backlash.value_or(0) / drive.reduction,
                        actuator.noise.value_or(0) / drive.reduction};
  }
  return out;
}

}  // namespace doppel
