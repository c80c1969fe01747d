#include <Eigen/Geometry>
#include <array>

#include "doppel/review/comparison/detail/comparison.h"

namespace doppel::comparison {
namespace {

const char* type_name(JointType type) {
  constexpr std::array kNames{"fixed", "revolute", "continuous", "prismatic", "floating", "planar"};
  return kNames[static_cast<std::size_t>(type)];
}

bool has_axis(const Joint& joint) {
  return joint.type != JointType::fixed && joint.type != JointType::floating;
}

Eigen::Vector3d unit(const Eigen::Vector3d& axis) {
  return axis.norm() > 0 ? axis.normalized() : axis;
}

double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

std::string axis_text(const Joint& joint) {
  return Changes::shown(joint.axis, 1, "");
}

// A rotation of the frame about the joint's own axis changes the zero; any other one changes the mechanism.
void compare_frames(const Joint& a, const Joint& b, Changes& changes) {
  const Eigen::Matrix3d turn = rotation_from_rpy(a.origin.rpy).transpose() * rotation_from_rpy(b.origin.rpy);
  const Eigen::AngleAxisd whole(turn);
  if (std::abs(whole.angle()) > kSameAngle) {
    const std::string from = Changes::shown(a.origin.rpy, 1, "rad"),
                      to = Changes::shown(b.origin.rpy, 1, "rad");
    const Eigen::Vector3d axis = unit(b.axis);
    const double along = whole.axis().dot(axis);
    if (has_axis(b) && std::abs(std::abs(along) - 1.0) < 1e-9) {
      // R_new = R_old R_axis(-d): the joint's positions increase by d.
      changes.add("zero", from, to,
                  fmt::format("the zero moved by {:+.6g} deg about the joint axis",
                              -along * whole.angle() / kDegree));
    } else {
      changes.add("orientation", from, to,
                  fmt::format("the frame turned by {:.6g} deg", whole.angle() / kDegree));
    }
  }
  const Eigen::Vector3d moved = b.origin.xyz - a.origin.xyz;
  if (moved.norm() > kSameLength) {
    changes.add("position", Changes::shown(a.origin.xyz, 1e3, "mm"), Changes::shown(b.origin.xyz, 1e3, "mm"),
                fmt::format("moved by {:.6g} mm", moved.norm() * 1e3));
  }
}

void compare_axes(const Joint& a, const Joint& b, Changes& changes) {
  if (!has_axis(a) || !has_axis(b)) return;
  const double angle = angle_between(unit(a.axis), unit(b.axis));
  if (angle < kSameAngle) return;
  const bool flipped = std::numbers::pi - angle < kSameAngle;
  changes.add(
      "axis", axis_text(a), axis_text(b),
      flipped ? "reversed: it turns the other way" : fmt::format("tilted by {:.6g} deg", angle / kDegree));
}

void compare_limits(const Joint& a, const Joint& b, Changes& changes) {
  const bool slides = b.type == JointType::prismatic;
  const double scale = slides ? 1e3 : 1 / kDegree;
  const char* position = slides ? "mm" : "deg";
  const auto field = [](const Joint& joint, auto member) -> std::optional<double> {
    if (!joint.limits) return std::nullopt;
    return member(*joint.limits);
  };
  const auto end = [](double JointLimits::*which) {
    return [which](const JointLimits& l) { return l.has_position ? std::optional(l.*which) : std::nullopt; };
  };
  if (b.type != JointType::continuous) {
    changes.number("lower", field(a, end(&JointLimits::lower)), field(b, end(&JointLimits::lower)), scale,
                   position);
    changes.number("upper", field(a, end(&JointLimits::upper)), field(b, end(&JointLimits::upper)), scale,
                   position);
  }
  const auto effort = [](const JointLimits& l) { return l.effort; };
  const auto velocity = [](const JointLimits& l) { return l.velocity; };
  changes.number("effort", field(a, effort), field(b, effort), 1, slides ? "N" : "N m");
  changes.number("velocity", field(a, velocity), field(b, velocity), 1, slides ? "m/s" : "rad/s");
  for (const RateLimit& rate : kRateLimits) {
    const auto member = [&rate](const JointLimits& l) { return l.*rate.value; };
    changes.number(rate.name, field(a, member), field(b, member), 1, slides ? rate.linear : rate.angular);
  }
}

void compare_rest(const Joint& a, const Joint& b, Changes& changes) {
  const auto dynamics = [](const Joint& joint) { return joint.dynamics.value_or(JointDynamics{}); };
  changes.number("damping", dynamics(a).damping, dynamics(b).damping, 1, "");
  changes.number("friction", dynamics(a).friction, dynamics(b).friction, 1, "");
  const auto mimic = [](const Joint& joint) {
    return joint.mimic ? fmt::format("{:.6g} x '{}' {:+.6g}", joint.mimic->multiplier, joint.mimic->joint,
                                     joint.mimic->offset)
                       : std::string("none");
  };
  changes.text("mimic", mimic(a), mimic(b));
}

}  // namespace

void compare_joint(const Joint& a, const Joint& b, std::vector<Change>& out) {
  Changes changes(out, "joint", b.name);
  changes.text("type", type_name(a.type), type_name(b.type));
  changes.text("parent", a.parent, b.parent);
  changes.text("child", a.child, b.child);
  compare_axes(a, b, changes);
  compare_frames(a, b, changes);
  compare_limits(a, b, changes);
  compare_rest(a, b, changes);
}

}  // namespace doppel::comparison
