#include "doppel/twin/loop/rest_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace doppel {
namespace {

constexpr double kSameTarget = 1e-6;  // rad or m: tolerance of an unchanged target, up to whole turns
constexpr double kDragged = 1e-3;     // rad or m, of a drive's reference by a load beyond its effort limit
constexpr double kAtLimit = 0.98;     // of the effort limit: the drive is saturated

std::string contact_of(BodyId body, const CompiledWorld& world, const std::vector<Contact>& contacts) {
  for (const Contact& contact : contacts) {
    if (contact.a == body || contact.b == body)
      return world.name_of(contact.a == body ? contact.b : contact.a);
  }
  return "";
}

// A joint that <ros2_control> leaves out, while it drives others.
bool has_no_command(const RobotDescription& robot, const std::string& joint) {
  bool drives = false;
  for (const HardwareDescription& hardware : robot.hardware) {
    for (const HardwareJointDescription& entry : hardware.joints) {
      if (entry.command_interfaces.empty()) continue;
      if (entry.name == joint) return false;
      drives = true;
    }
  }
  return drives;
}

std::string cause_of(int index, const RobotDescription& description, const Instance& robot,
                     const std::vector<Contact>& contacts) {
  const Model& model = robot.model();
  const ModelJoint& joint = model.joints[static_cast<std::size_t>(index)];
  if (joint.mimics()) {
    const double q = robot.q()[static_cast<std::size_t>(joint.q)];
    return fmt::format("it mimics '{}'{}", model.joints[static_cast<std::size_t>(joint.mimic_leader)].name,
                       q >= joint.upper || q <= joint.lower ? " and is at its own limit" : "");
  }
  const DriveMode mode = robot.drive(index);
  if (mode == DriveMode::passive && has_no_command(description, joint.name))
    return "it has no command interface in <ros2_control>";
  if (mode == DriveMode::passive) return "no active controller commands it";
  if (mode == DriveMode::effort) {
    return robot.drive_target(index) == 0 ? "its controller commands no effort"
                                          : "the effort that its controller commands does not hold it; check "
                                            "the gains of the controller";
  }
  const double limit = robot.made_of().servos[static_cast<std::size_t>(index)].effort;
  const DriveState drive = robot.drive_state(index);
  const bool dragged = mode == DriveMode::position && std::abs(drive.reference - drive.target) > kDragged;
  if (at_effort_limit(robot, index) || dragged) {
    return fmt::format("its effort limit of {:.3g} {} is too low for its load", limit,
                       joint.type == JointType::prismatic ? "N" : "N m");
  }
  const std::string touched = contact_of({robot.index(), joint.child_link}, robot.engine().world(), contacts);
  if (!touched.empty()) return fmt::format("its link touches '{}'", touched);
  return "a connected link moves; run doppel check to find the reason in the description";
}

}  // namespace

std::string to_string(const UnsettledJoint& unsettled, bool slides) {
  const char* const unit = slides ? "m" : "rad";
  std::string out = unsettled.where.known() ? unsettled.where.place() + ": " : "";
  const bool moving = !(std::abs(unsettled.speed) <= kRestSpeed);
  out += fmt::format("joint '{}' (link '{}') ", unsettled.joint, unsettled.link);
  if (moving) out += fmt::format("moves at {:.3g} {}/s", unsettled.speed, unit);
  if (unsettled.beyond > kBeyondLimit)
    out += fmt::format("{}{:.3g} {} beyond its limit", moving ? ", " : "stands ", unsettled.beyond, unit);
  else if (unsettled.strayed > kBeyondLimit)
    out += fmt::format("{}{:.3g} {} from the position that its leader gives", moving ? ", " : "stands ",
                       unsettled.strayed, unit);
  return out + ": " + unsettled.cause;
}

bool at_effort_limit(const Instance& robot, int joint) {
  const auto at = static_cast<std::size_t>(joint);
  return std::abs(robot.drive_effort()[at]) >= kAtLimit * robot.made_of().servos[at].effort;
}

namespace {

// rad or m, from the position that the leader of a <mimic> gives; 0: it mimics nothing.
double strayed_from_leader(const Model& model, const ModelJoint& joint, std::span<const double> q) {
  if (!joint.mimics()) return 0.0;
  const ModelJoint& leader = model.joints[static_cast<std::size_t>(joint.mimic_leader)];
  return std::abs(q[static_cast<std::size_t>(joint.q)] - joint.mimic_offset -
                  joint.mimic_multiplier * q[static_cast<std::size_t>(leader.q)]);
}

// True if the joint is that of a caster: it has no drive and carries a wheel, so it may turn while the robot rests.
bool is_passive_caster(const Instance& robot, int joint) {
  if (robot.drive(joint) != DriveMode::passive) return false;
  const Model& model = robot.model();
  for (const RollingPart& part : robot.made_of().rolling) {
    for (int above = part.joint; above >= 0;) {
      if (above == joint) return true;
      const ModelJoint& carrying = model.joints[static_cast<std::size_t>(above)];
      above = model.links[static_cast<std::size_t>(carrying.parent_link)].joint;
    }
  }
  return false;
}

}  // namespace

std::vector<UnsettledJoint> find_unsettled_joints(const RobotDescription& robot, const Instance& instance) {
  const Model& model = instance.model();
  std::vector<UnsettledJoint> out;
  std::vector<Contact> contacts;
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    const ModelJoint& joint = model.joints[j];
    if (!joint.scalar()) continue;
    const double q = instance.q()[static_cast<std::size_t>(joint.q)];
    const double v = instance.v()[static_cast<std::size_t>(joint.v)];
    const double beyond = std::max({joint.lower - q, q - joint.upper, 0.0});
    const double strayed = strayed_from_leader(model, joint, instance.q());
    const bool still = std::abs(v) <= kRestSpeed || is_passive_caster(instance, static_cast<int>(j));
    if (still && beyond <= kBeyondLimit && strayed <= kBeyondLimit) continue;
    if (out.empty()) instance.engine().contacts(contacts);  // costs a solution of all constraints
    const Joint* source = robot.find_joint(joint.name);
    out.push_back({joint.name, model.links[static_cast<std::size_t>(joint.child_link)].name, q, v, beyond,
                   strayed, cause_of(static_cast<int>(j), robot, instance, contacts),
                   source != nullptr ? source->source : SourceLocation{}});
  }
  return out;
}

bool RestCheck::commanded(const Instance& instance, const FollowedPosition& followed) const {
  const Model& model = instance.model();
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    const ModelJoint& joint = model.joints[j];
    if (!joint.scalar()) continue;
    const DriveMode mode = instance.drive(static_cast<int>(j));
    if (mode == DriveMode::passive) continue;
    const double start = q0_[static_cast<std::size_t>(joint.q)];
    const double position = followed && mode != DriveMode::position
                                ? followed(static_cast<int>(j))
                                : std::numeric_limits<double>::quiet_NaN();
    const bool follows = std::isfinite(position);
    const double target = follows ? position : instance.drive_target(static_cast<int>(j));
    const double held = follows || mode == DriveMode::position ? start : 0.0;
    if (!(std::abs(target - held) <= kSameTarget)) return true;
  }
  return false;
}

bool RestCheck::look(const RobotDescription& robot, const Instance& instance,
                     const FollowedPosition& followed) {
  if (looked_ || instance.engine().time() < begin_ + kRestTime) return false;
  conclude(robot, instance, followed);
  return true;
}

void RestCheck::conclude(const RobotDescription& robot, const Instance& instance,
                         const FollowedPosition& followed) {
  if (looked_) return;
  looked_ = true;
  if (instance.q().size() == q0_.size() && !commanded(instance, followed)) make_report(robot, instance);
}

void RestCheck::make_report(const RobotDescription& robot, const Instance& instance) {
  const Engine& engine = instance.engine();
  const Model& model = instance.model();
  RestReport& report = report_.emplace();
  report.time = engine.time();
  for (const UnsettledJoint& unsettled : find_unsettled_joints(robot, instance)) {
    const ModelJoint& joint = model.joints[static_cast<std::size_t>(model.find_joint(unsettled.joint))];
    report.unsettled.push_back(to_string(unsettled, joint.type == JointType::prismatic));
  }
  if (!model.joints.empty() && model.joints.front().type == JointType::floating) {
    const FrameVelocity base = instance.link_velocity(model.joints.front().child_link);
    report.base_linear = base.linear_W.norm();
    report.base_angular = base.angular_W.norm();
    std::vector<Contact> contacts;
    engine.contacts(contacts);
    report.base_touches =
        std::any_of(contacts.begin(), contacts.end(), [here = instance.index()](const Contact& c) {
          return (c.a.instance == here) != (c.b.instance == here);
        });
    if (std::max(report.base_linear, report.base_angular) > kRestSpeed) {
      report.base = fmt::format("the floating base moves at {:.2g} m/s and {:.2g} rad/s: {}",
                                report.base_linear, report.base_angular,
                                report.base_touches ? "it tips over or slides; no controller balances it"
                                                    : "it falls because it touches nothing");
    }
  }
}

}  // namespace doppel
