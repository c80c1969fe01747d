// Joints by themselves: axes, limits, dynamics. Mimics: rules_mimics.cpp.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "doppel/base/core/names.h"
#include "doppel/base/core/text.h"
#include "doppel/description/urdf/urdf_version.h"
#include "doppel/review/audit/detail/description_facts.h"
#include "doppel/review/audit/detail/rules.h"
#include "doppel/review/audit/detail/vocabulary.h"

namespace doppel::audit_rules {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kExporter = 100;        // velocity and effort of fusion360-urdf-ros2 and similar exporters
constexpr double kAbsurdSpeed = 80;      // rad/s: the drives of legs with the least gearing reach 60
constexpr double kAbsurdSlide = 10;      // m/s
constexpr double kAbsurdEffort = 1e5;    // N m or N
constexpr double kCasual = 2e-3;         // rad: a multiple of pi/2 with three digits: 1.57, 3.14
constexpr double kManyTurns = 20 * kPi;  // rad: more than a cable permits
constexpr double kSomeTurns = 4 * kPi;   // rad: the range of industrial wrists

bool limited(const Joint& joint) {
  return joint.type == JointType::revolute || joint.type == JointType::prismatic;
}
bool turns(const Joint& joint) {
  return joint.type == JointType::revolute || joint.type == JointType::continuous;
}
const char* unit(const Joint& joint) {
  return turns(joint) ? "rad" : "m";
}
const char* effort_unit(const Joint& joint) {
  return turns(joint) ? "N m" : "N";
}

Operation set_limit(SetLimit action, std::string why) {
  Operation out;
  out.action = std::move(action);
  out.why = std::move(why);
  return out;
}

// It has an element with a similar name to the missing one, which the rules of the schema have reported.
bool misspelt(const AuditInput& in, const Joint& joint, std::string_view element) {
  const XmlNode* node = element_at(in.expanded.root, joint.source);
  return node != nullptr &&
         std::any_of(node->children.begin(), node->children.end(), [&](const XmlNode& child) {
           return child.kind == XmlNode::Kind::element && is_near_certain_match(child.name, element);
         });
}

// The attribute that is probably a typo of `name`; null: none.
const XmlAttribute* misspelt_attribute(const XmlNode& node, std::string_view name) {
  const ElementKind* kind = find_kind({"joint", node.name});
  const std::vector<std::string> valid = words(kind == nullptr ? "" : kind->attributes);
  for (const XmlAttribute& attribute : node.attributes) {
    const bool known = std::find(valid.begin(), valid.end(), attribute.name) != valid.end();
    if (!known && nearest_name(attribute.name, valid) == name) return &attribute;
  }
  return nullptr;
}

void check_complete(const AuditInput& in, const Joint& joint, const char* name, Findings& out) {
  const XmlNode* node = element_at(in.expanded.root, joint.limits->source);
  if (node != nullptr && node->find(name) != nullptr) return;  // not a number, as reported by the parser
  const XmlAttribute* meant = node == nullptr ? nullptr : misspelt_attribute(*node, name);
  if (meant == nullptr) {
    out.add("joint.limit_incomplete", subject(joint), joint.limits->source,
            fmt::format("its <limit> has no {}", name), fmt::format("write {}=\"...\"", name));
    return;
  }
  const SourceLocation where = meant->where;
  std::erase_if(out.all(),
                [&](const Finding& f) { return f.rule == "schema.attribute" && same_place(f.where, where); });
  out.add("joint.limit_incomplete", subject(joint), where,
          fmt::format("its <limit> has no {} but a '{}'; did you mean '{}'?", name, meant->name, name),
          fmt::format("write {}=\"{}\"", name, meant->value));
}

// `needs_both`: the file is of a version in which a <limit> has effort and velocity.
void check_presence(const AuditInput& in, const Joint& joint, bool needs_both, Findings& out) {
  if (limited(joint) && !joint.limits) {
    if (misspelt(in, joint, "limit")) return;
    out.add("joint.no_limits", subject(joint), joint.source,
            fmt::format("a {} joint needs a <limit>, and '{}' has none",
                        joint.type == JointType::revolute ? "revolute" : "prismatic", joint.name));
    return;
  }
  if (!joint.limits) return;
  if (!needs_both) return;
  if (!joint.limits->effort) check_complete(in, joint, "effort", out);
  if (!joint.limits->velocity) check_complete(in, joint, "velocity", out);
}

// Both bounds are numbers; the parser reports any other value and replaces it by 0.
bool bounds_readable(const AuditInput& in, const Joint& joint) {
  const JointLimits& l = *joint.limits;
  if (l.lower != 0 && l.upper != 0) return true;
  const XmlNode* node = element_at(in.expanded.root, l.source);
  if (node == nullptr) return true;
  for (const char* name : {"lower", "upper"}) {
    const XmlAttribute* bound = node->find(name);
    if (bound != nullptr && !parse_number(bound->value)) return false;
  }
  return true;
}

// The exporter's constants: both on the same joint. One alone may be intended.
bool exported(const Joint& joint) {
  return joint.limits && joint.limits->effort == kExporter && joint.limits->velocity == kExporter;
}

// "Revolute 3", "Rev5", "Slider 12": Fusion 360's default names of joints.
bool named_by_exporter(const std::string& name) {
  for (const std::string_view kind : {"Revolute", "Rev", "Slider", "Cylindrical", "Planar", "Ball"}) {
    if (!name.starts_with(kind)) continue;
    const std::size_t digits = name.find_first_not_of(" _", kind.size());
    return digits != std::string::npos && name.find_first_not_of("0123456789", digits) == std::string::npos;
  }
  return false;
}

void check_exporter(const Joint& joint, Findings& out) {
  const bool sure = named_by_exporter(joint.name);
  const Severity severity = sure ? Severity::error : Severity::warning;
  const char* origin = sure ? "an exporter's default" : "an exporter's default or a placeholder";
  out.add("joint.exporter_velocity", severity, subject(joint), joint.limits->source,
          turns(joint) ? fmt::format("velocity 100 rad/s = {:.0f} deg/s: {}, not a motor's speed",
                                     kExporter * 180 / kPi, origin)
                       : fmt::format("velocity 100 m/s: {}, not a motor's speed", origin));
  out.add("joint.exporter_effort", severity, subject(joint), joint.limits->source,
          fmt::format("effort 100 {}: {}, not a motor's {}", effort_unit(joint), origin,
                      turns(joint) ? "torque" : "force"));
}

void check_negative(const Joint& joint, const char* name, double value, Findings& out) {
  if (value == -1) {
    out.add(
        "joint.limit_negative", Severity::warning, subject(joint), joint.limits->source,
        fmt::format("its {} limit is -1, which means 'no limit' in SDF and is an error in other tools", name),
        "write the effort that the drive delivers");
    return;
  }
  SetLimit fix{joint.name, {}, {}, {}, {}};
  (name[0] == 'e' ? fix.effort : fix.velocity) = -value;
  out.add("joint.limit_negative", subject(joint), joint.limits->source,
          fmt::format("its {} limit is {}", name, value), fmt::format("write {}", -value))
      .repair = {set_limit(fix, fmt::format("a limit is a magnitude, but {} is written", value))};
}

void check_rates(const Joint& joint, Findings& out) {
  const JointLimits& limits = *joint.limits;
  for (const auto& [name, value] :
       {std::pair{"effort", limits.effort}, std::pair{"velocity", limits.velocity}}) {
    if (!value) continue;
    if (*value < 0) check_negative(joint, name, *value, out);
    if (*value == 0) {
      out.add(name[0] == 'e' ? "joint.effort_zero" : "joint.velocity_zero", subject(joint), limits.source,
              fmt::format("its {} limit is 0", name));
    }
  }
  if (exported(joint)) {
    check_exporter(joint, out);
    return;
  }
  const double fastest = turns(joint) ? kAbsurdSpeed : kAbsurdSlide;
  if (limits.velocity && *limits.velocity >= fastest) {
    out.add("joint.velocity_absurd", subject(joint), limits.source,
            fmt::format(
                "its velocity limit is {:g} {}/s{}", *limits.velocity, unit(joint),
                turns(joint) ? fmt::format(", {:.0f} turns a second", *limits.velocity / (2 * kPi)) : ""));
  }
  if (limits.effort && *limits.effort >= kAbsurdEffort) {
    out.add("joint.effort_absurd", subject(joint), limits.source,
            fmt::format("its effort limit is {:g} {}", *limits.effort, effort_unit(joint)));
  }
}

bool whole_degrees(double value) {
  return value == 0 || (std::abs(value) >= 20 && std::abs(value) <= 400 && value == std::round(value));
}

bool looks_like_degrees(const Joint& joint) {
  if (joint.type != JointType::revolute || !joint.limits) return false;
  const JointLimits& l = *joint.limits;
  return whole_degrees(l.lower) && whole_degrees(l.upper) && l.lower < l.upper;
}

// Half a turn in both directions for every joint usually represents the unlimited range of wheels and spools.
// Ranges that differ from joint to joint are those of a mechanism.
bool written_in_degrees(const RobotDescription& robot) {
  std::set<std::pair<double, double>> ranges;
  for (const Joint& joint : robot.joints) {
    if (looks_like_degrees(joint)) ranges.emplace(joint.limits->lower, joint.limits->upper);
  }
  return ranges.size() >= 2;
}

// True where the range is in degrees, so that no other rule can judge it.
bool check_degrees(const Joint& joint, bool certain, Findings& out) {
  if (!looks_like_degrees(joint)) return false;
  const JointLimits& l = *joint.limits;
  const double lower = l.lower * kPi / 180, upper = l.upper * kPi / 180;
  Finding& f =
      out.add("joint.limits_degrees", certain ? Severity::error : Severity::warning, subject(joint), l.source,
              fmt::format("its limits {:g} and {:g} are radians, {:.0f} turns; they look like degrees",
                          l.lower, l.upper, (l.upper - l.lower) / (2 * kPi)),
              certain ? fmt::format("write lower=\"{:.9f}\" upper=\"{:.9f}\"", lower, upper)
                      : "write radians, or make it continuous if it is unlimited");
  if (certain)
    f.repair = {set_limit({joint.name, lower, upper, {}, {}}, "the limits are written in degrees")};
  return true;
}

// Rounded away from zero, so that the multiple itself is inside.
double rounded_outward(double multiple) {
  return std::copysign(std::ceil(std::abs(multiple) * 1e6) * 1e-6, multiple);
}

void check_precision(const Joint& joint, const char* name, double value, Findings& out) {
  const double quarter = kPi / 2;
  const double count = std::round(std::abs(value) / quarter);
  const double whole = count * quarter;
  const double missing = whole - std::abs(value);
  if (count < 1 || count > 8 || missing <= 1e-12 || missing > kCasual) return;
  const double outward = rounded_outward(std::copysign(whole, value));
  const std::string multiple = count == 1 ? "pi/2" : count == 2 ? "pi" : fmt::format("{:g} pi", count / 2);
  // No repair, because it cannot be determined whether the angle should be inside.
  out.add("joint.limit_precision", subject(joint), joint.limits->source,
          fmt::format("its {} limit {:.9g} is short of {}{} by {:.2g} rad", name, value, value < 0 ? "-" : "",
                      multiple, missing),
          fmt::format("write {:.6f}, or leave a margin on purpose", outward));
}

// Limits of a full turn and more restrict nothing, and 0 .. 0 is what exporters write for none.
void check_continuous(const Joint& joint, Findings& out) {
  const JointLimits& l = *joint.limits;
  if (joint.type != JointType::continuous || !l.has_position || l.upper - l.lower <= 0) return;
  if (l.upper - l.lower > 2 * kPi - 0.01) return;
  out.add("joint.continuous_limits", subject(joint), l.source,
          fmt::format("it is continuous, so its limits {:g} .. {:g} rad have no effect", l.lower, l.upper));
}

void check_range(const Joint& joint, bool degrees, Findings& out) {
  const JointLimits& l = *joint.limits;
  if (!limited(joint) || l.lower > l.upper || check_degrees(joint, degrees, out)) return;
  if (!l.has_position || l.lower == l.upper) {
    out.add("joint.range_zero", subject(joint), l.source,
            l.has_position ? fmt::format("its limits allow only one position, {:g} {}", l.lower, unit(joint))
                           : "its <limit> has neither lower nor upper, which means 0 and 0");
    return;
  }
  const double range = l.upper - l.lower;
  if (joint.type == JointType::prismatic) {
    if (range > 20) {
      out.add("joint.range_absurd", subject(joint), l.source, fmt::format("its range is {:g} m", range),
              "limits of prismatic joints are in metres; are these millimetres?");
    }
    return;
  }
  if (range > kSomeTurns + 1e-3) {
    out.add("joint.not_continuous", range >= kManyTurns ? Severity::warning : Severity::note, subject(joint),
            l.source, fmt::format("it is revolute with a range of {:.3g} turns", range / (2 * kPi)));
    return;
  }
  check_precision(joint, "lower", l.lower, out);
  check_precision(joint, "upper", l.upper, out);
}

void check_dynamics(const Joint& joint, Findings& out) {
  if (!joint.dynamics) return;
  for (const auto& [name, value] :
       {std::pair{"damping", joint.dynamics->damping}, std::pair{"friction", joint.dynamics->friction}}) {
    if (value >= 0) continue;
    SetDynamics fix{joint.name, {}, {}};
    (name[0] == 'd' ? fix.damping : fix.friction) = -value;
    Operation repair;
    repair.action = fix;
    repair.why = fmt::format("{} dissipates energy; {} would add it", name, value);
    out.add("joint.dynamics_negative", subject(joint), joint.dynamics->source,
            fmt::format("its {} is {}", name, value), fmt::format("write {}", -value))
        .repair = {repair};
  }
}

void check_safety(const Joint& joint, Findings& out) {
  if (!joint.safety || !joint.limits || !limited(joint)) return;
  const SafetyController& s = *joint.safety;
  if (s.soft_lower_limit == 0 && s.soft_upper_limit == 0) return;
  if (s.soft_lower_limit >= s.soft_upper_limit || s.soft_lower_limit < joint.limits->lower - 1e-9 ||
      s.soft_upper_limit > joint.limits->upper + 1e-9) {
    out.add("joint.soft_limits", subject(joint), s.source,
            fmt::format("its soft limits {:g} .. {:g} are not inside its limits {:g} .. {:g}",
                        s.soft_lower_limit, s.soft_upper_limit, joint.limits->lower, joint.limits->upper));
  }
}

void check_axis(const Joint& joint, Findings& out) {
  const bool needs = joint.type != JointType::fixed && joint.type != JointType::floating;
  if (needs && !joint.axis_source.known()) {
    out.add("joint.axis_default", subject(joint), joint.source, "it has no <axis>; 1 0 0 is used");
  }
}

// Angles of 90, -180 ... radians.
void check_origin(const Joint& joint, Findings& out) {
  const Eigen::Vector3d& rpy = joint.origin.rpy;
  if (rpy.cwiseAbs().maxCoeff() <= 2 * kPi + 1e-3) return;
  const bool degrees = (rpy.array() == (rpy.array() / 15).round() * 15).all();
  Finding& f = out.add("joint.origin_degrees", degrees ? Severity::error : Severity::note, subject(joint),
                       joint.origin.source,
                       fmt::format("its origin has rpy {:g} {:g} {:g} rad, more than a full turn{}", rpy.x(),
                                   rpy.y(), rpy.z(), degrees ? "; these look like degrees" : ""));
  if (!degrees) return;
  Operation repair;
  repair.action = SetOrigin{joint.name, {}, Eigen::Vector3d(rpy * kPi / 180)};
  repair.why = "the angles are written in degrees";
  f.repair = {repair};
}

// Adds the only possible repair to findings of the parser.
void offer_repairs(const AuditInput& in, Findings& out) {
  for (Finding& f : out.all()) {
    for (const Joint& joint : in.robot.joints) {
      if (f.subject != subject(joint)) continue;
      if (f.rule == "urdf.axis_not_unit" && same_place(f.where, joint.axis_source)) {
        Operation repair;
        repair.action = SetAxis{joint.name, joint.axis.normalized()};
        repair.why = "an axis is a direction of length 1";
        f.repair = {repair};
      }
      if (f.rule == "urdf.limits_crossed" && joint.limits && bounds_readable(in, joint) &&
          joint.limits->lower == -joint.limits->upper) {
        f.repair = {set_limit({joint.name, joint.limits->upper, joint.limits->lower, {}, {}},
                              "lower and upper are exchanged")};
      }
    }
  }
}

}  // namespace

void check_joints(const AuditInput& in, Findings& out) {
  offer_repairs(in, out);
  const bool degrees = written_in_degrees(in.robot);
  // urdfdom 6 reads a missing effort or velocity of a file of version 1.2 as unlimited.
  Diagnostics unused;
  const bool needs_both = read_urdf_version(in.expanded.root, unused) < kUrdf12;
  for (const Joint& joint : in.robot.joints) {
    check_origin(joint, out);
    check_axis(joint, out);
    check_presence(in, joint, needs_both, out);
    check_dynamics(joint, out);
    if (!joint.limits || joint.type == JointType::fixed) continue;
    check_rates(joint, out);
    if (bounds_readable(in, joint)) {
      check_continuous(joint, out);
      check_range(joint, degrees, out);
    }
    check_safety(joint, out);
  }
}

}  // namespace doppel::audit_rules
