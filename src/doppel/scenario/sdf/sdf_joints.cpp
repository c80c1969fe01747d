#include "doppel/scenario/sdf/detail/sdf_joints.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace doppel::sdf {
namespace {

constexpr double kUnlimited = 1e5;     // rad or m: SDF's 1e16 and infinity mean no limit
constexpr double kNoOffset = 1e-9;     // m
constexpr double kDefaultStop = 1e8;   // N m/rad: SDF's stiffness of a stop, which is rigid
constexpr double kJointMass = 1e-3;    // of a composed joint's links, as a fraction of the lower link's
constexpr double kJointRadius = 0.02;  // m, of the balls that these links are

struct Dof {
  std::string suffix;
  JointType type = JointType::fixed;
  JointAxis axis;
  std::string mimics;  // suffix of the joint that it follows
  double multiplier = 1;
};

bool turns(JointType type) {
  return type == JointType::revolute || type == JointType::continuous;
}

Dof dof_of(const std::string& suffix, const JointAxis& axis, bool prismatic) {
  Dof out{suffix, JointType::prismatic, axis, "", 1};
  if (!prismatic) out.type = axis.bounded ? JointType::revolute : JointType::continuous;
  return out;
}

JointAxis free_axis(const Eigen::Vector3d& a_J, const SourceLocation& where) {
  JointAxis out;
  out.a_J = a_J;
  out.source = where;
  return out;
}

std::vector<Dof> dofs_of(const JointSpec& spec, Elements& elements) {
  const auto composed = [&](const char* of) {
    elements.diagnostics.note("sdf.composed_joint", spec.source,
                              fmt::format("the {} joint '{}' is simulated as {}", spec.type, spec.name, of));
  };
  if (spec.type == "fixed") return {};
  const bool one_axis = spec.type == "prismatic" || spec.type == "revolute" || spec.type == "hinge";
  if (one_axis && spec.axis.bounded && spec.axis.limits.lower == 0 && spec.axis.limits.upper == 0) {
    elements.without_effect(spec.source, "the axis of a joint whose limits are both 0", "it is fixed");
    return {};
  }
  if (spec.type == "prismatic") return {dof_of("", spec.axis, true)};
  if (spec.type == "revolute" || spec.type == "hinge") return {dof_of("", spec.axis, false)};
  if (spec.type == "continuous") {
    Dof out = dof_of("", spec.axis, false);
    out.type = JointType::continuous;
    return {out};
  }
  if (spec.type == "universal" || spec.type == "revolute2") {
    composed("two revolute joints at one point; the second is named with _2");
    return {dof_of("", spec.axis, false), dof_of("_2", spec.axis2, false)};
  }
  if (spec.type == "ball") {
    composed("three revolute joints at one point, which is singular at a quarter turn of the second");
    return {dof_of("_x", free_axis(Eigen::Vector3d::UnitX(), spec.source), false),
            dof_of("_y", free_axis(Eigen::Vector3d::UnitY(), spec.source), false),
            dof_of("_z", free_axis(Eigen::Vector3d::UnitZ(), spec.source), false)};
  }
  if (spec.type == "screw") {
    composed("a revolute joint and a prismatic one, named with _slide, that follows it");
    Dof slide = dof_of("_slide", free_axis(spec.axis.a_J, spec.source), true);
    slide.axis.bounded = true;
    slide.axis.limits = {-kUnlimited, kUnlimited, {}, {}, true, spec.source};
    slide.mimics = spec.name;
    slide.multiplier = spec.screw_pitch / (2 * std::numbers::pi);
    return {dof_of("", spec.axis, false), slide};
  }
  elements.diagnostics.warning(
      "sdf.unsupported_joint", spec.source,
      fmt::format("the joint '{}' has the type '{}', which is not simulated; it is fixed", spec.name,
                  spec.type.substr(0, 40)),
      "use revolute, continuous, prismatic, fixed, ball, universal, screw or revolute2");
  return {};
}

Joint joint_of(const JointSpec& spec, const Dof& dof) {
  Joint out;
  out.name = spec.name + dof.suffix;
  out.type = dof.type;
  out.source = spec.source;
  out.axis_source = dof.axis.source;
  if (dof.type != JointType::continuous || dof.axis.limits.effort || dof.axis.limits.velocity)
    out.limits = dof.axis.limits;
  if (dof.axis.damping > 0 || dof.axis.friction > 0)
    out.dynamics = JointDynamics{dof.axis.damping, dof.axis.friction, dof.axis.source};
  if (!dof.mimics.empty()) out.mimic = Mimic{dof.mimics, dof.multiplier, 0, spec.source};
  if (dof.axis.mimic && dof.mimics.empty()) out.mimic = dof.axis.mimic;
  return out;
}

void set_origin(Joint& joint, const Pose& X) {
  joint.origin = {X.translation(), rpy_from_rotation(X.linear()), joint.source};
}

// A small ball between two axes: engines reject a moving body without mass.
Link light_link(const std::string& name, const JointSpec& spec) {
  Link out;
  out.name = name;
  out.source = spec.source;
  Inertial body;
  body.mass = kJointMass * std::max(spec.lower_mass, kJointMass);
  body.ixx = body.iyy = body.izz = 0.4 * body.mass * kJointRadius * kJointRadius;
  body.source = spec.source;
  out.inertial = body;
  return out;
}

}  // namespace

JointAxis read_axis(const XmlNode& axis, const Eigen::Matrix3d& R_JE, Elements& elements) {
  elements.check(axis, "axis");
  JointAxis out;
  out.source = axis.where;
  const Eigen::Vector3d written = elements.vector<3>(axis, "xyz").value_or(Eigen::Vector3d::UnitZ());
  if (written.norm() > 1e-9) {
    out.a_J = R_JE * written.normalized();
  } else {
    elements.error("sdf.value", axis.where, "the <xyz> of this axis is zero",
                   "write a direction, such as 0 0 1");
  }
  out.limits.source = axis.where;
  out.limits.lower = -kUnlimited;
  out.limits.upper = kUnlimited;
  if (const XmlNode* const limit = axis.first("limit")) {
    elements.check(*limit, "limit");
    const double lower = elements.number_or(*limit, "lower", -kUnlimited);
    const double upper = elements.number_or(*limit, "upper", kUnlimited);
    out.bounded = lower > -kUnlimited || upper < kUnlimited;
    out.limits.lower = std::clamp(lower, -kUnlimited, kUnlimited);
    out.limits.upper = std::clamp(upper, -kUnlimited, kUnlimited);
    const double effort = elements.number_or(*limit, "effort", -1),
                 velocity = elements.number_or(*limit, "velocity", -1);
    if (effort > 0 && effort < 1e15) out.limits.effort = effort;
    if (velocity > 0 && velocity < 1e15) out.limits.velocity = velocity;
    const double stiffness = elements.number_or(*limit, "stiffness", kDefaultStop);
    if (stiffness > 0 && stiffness < kDefaultStop && out.bounded) out.stop_stiffness = stiffness;
  }
  out.limits.has_position = true;
  if (const XmlNode* const dynamics = axis.first("dynamics")) {
    elements.check(*dynamics, "dynamics");
    out.damping = std::max(0.0, elements.number_or(*dynamics, "damping", 0));
    out.friction = std::max(0.0, elements.number_or(*dynamics, "friction", 0));
    if (elements.number_or(*dynamics, "spring_stiffness", 0) != 0)
      elements.without_effect(dynamics->first("spring_stiffness")->where, "<spring_stiffness> of a joint");
  }
  if (const XmlNode* const mimic = axis.first("mimic")) {
    const double multiplier = elements.number_or(*mimic, "multiplier", 1);
    out.mimic = Mimic{
        Elements::attribute(*mimic, "joint"), multiplier,
        elements.number_or(*mimic, "offset", 0) - multiplier * elements.number_or(*mimic, "reference", 0),
        mimic->where};
  }
  return out;
}

ComposedJoint compose_joint(const JointSpec& spec, Elements& elements) {
  ComposedJoint out;
  std::vector<Dof> dofs = dofs_of(spec, elements);
  if (spec.reversed) {  // the lower link is SDF's parent: the same motions backwards
    std::reverse(dofs.begin(), dofs.end());
    for (Dof& dof : dofs) dof.axis.a_J = -dof.axis.a_J;
  }
  std::string at = spec.up;
  Pose X = spec.X_UJ;  // the joint frame in the link `at`
  for (std::size_t i = 0; i < dofs.size(); ++i) {
    Joint joint = joint_of(spec, dofs[i]);
    joint.parent = at;
    const Eigen::Vector3d& a_J = dofs[i].axis.a_J;
    const bool last = i + 1 == dofs.size();
    // The description's joint frame is the lower link's; a point on the axis can be chosen freely.
    const bool on_axis = spec.X_JD.translation().cross(a_J).norm() < kNoOffset;
    const bool direct = last && (!turns(dofs[i].type) || on_axis);
    if (direct) {
      set_origin(joint, X * spec.X_JD);
      joint.axis = spec.X_JD.linear().transpose() * a_J;
      joint.child = at = spec.down;
    } else {
      set_origin(joint, X);
      joint.axis = a_J;
      at = joint.child = fmt::format("{}_{}", joint.name, last ? "frame" : "axis");
      out.links.push_back(last ? Link{at, {}, {}, {}, spec.source} : light_link(at, spec));
    }
    X = Pose::Identity();
    out.joints.push_back(std::move(joint));
  }
  if (at == spec.down) return out;
  Joint fixed;
  fixed.name = dofs.empty() ? spec.name : spec.name + "_offset";
  fixed.source = spec.source;
  fixed.parent = at;
  fixed.child = spec.down;
  set_origin(fixed, X * spec.X_JD);
  out.joints.push_back(std::move(fixed));
  return out;
}

}  // namespace doppel::sdf
