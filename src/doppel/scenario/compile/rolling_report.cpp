#include "doppel/scenario/compile/rolling_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/physics/contract/exclusions.h"
#include "doppel/physics/contract/step_loop.h"
#include "doppel/robot/collision/link_pairs.h"

namespace doppel {
namespace {

constexpr std::uint64_t kSettlingSteps = 300;
constexpr double kSameAxis = 0.01;     // m, between the axles of two wheels of one axis
constexpr double kAlikeLoad = 0.05;    // relative; wheels of about the same load and size share a sentence
constexpr double kAlikeRadius = 0.01;  // relative

void hold_joints(Instance robot) {
  const Model& model = robot.model();
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    if (model.joints[i].scalar() && !model.joints[i].mimics())
      robot.set_drive(static_cast<int>(i), DriveMode::position);
  }
}

void find_track(RollingReport& report, const Instance& robot) {
  const Model& model = robot.model();
  const std::vector<int> groups = rigid_groups(model);
  const auto group_of = [&](int link) { return groups[static_cast<std::size_t>(link)]; };
  std::vector<const RollingPart*> wheels;
  for (const RollingLoad& of : report.parts) {
    if (of.part.kind != RollingPart::Kind::wheel) continue;
    const ModelJoint& axle = model.joints[static_cast<std::size_t>(of.part.joint)];
    const bool steered = group_of(axle.parent_link) != group_of(robot.made_of().base_link());
    if (!steered) wheels.push_back(&of.part);
  }
  if (wheels.size() != 2) return;
  const auto centre = [&](const RollingPart& wheel) {
    return Eigen::Vector3d(robot.link_pose(wheel.link) * wheel.centre_L);
  };
  const Eigen::Vector3d between = centre(*wheels[1]) - centre(*wheels[0]);
  const Eigen::Vector3d axle = robot.link_pose(wheels[0]->link).linear() * wheels[0]->axis_L;
  const double track = std::abs(between.dot(axle));
  if ((between - axle * between.dot(axle)).norm() > kSameAxis) return;
  report.track = track;
  const Friction& friction = wheels[0]->friction;
  const double lever = friction.along > 0 ? 2.0 * friction.torsion / (friction.along * track) : 0.0;
  report.effective_track = track * (1.0 + lever * lever);
}

bool alike(const RollingLoad& a, const RollingLoad& b) {
  return a.part.kind == b.part.kind &&
         std::abs(a.part.radius - b.part.radius) <= kAlikeRadius * a.part.radius &&
         a.part.friction.along == b.part.friction.along && std::abs(a.load - b.load) <= kAlikeLoad * a.load;
}

std::string text_of(const std::vector<const RollingLoad*>& group) {
  std::string names;
  for (std::size_t i = 0; i < group.size(); ++i) {
    if (i > 0) names += i + 1 == group.size() ? " and " : ", ";
    names += fmt::format("'{}'", group[i]->link);
  }
  const RollingLoad& first = *group.front();
  const std::string load = fmt::format("{:.3g} N{}", first.load, group.size() > 1 ? " each" : "");
  if (first.part.kind == RollingPart::Kind::wheel)
    return fmt::format("{} (radius {:.4g} m, {})", names, first.part.radius, load);
  return fmt::format("{} (friction {:.3g}, {})", names, first.part.friction.along, load);
}

}  // namespace

RollingReport report_rolling(const Instance& robot) {
  RollingReport report;
  for (const RollingPart& part : robot.made_of().rolling)
    report.parts.push_back({part, robot.model().links[static_cast<std::size_t>(part.link)].name});
  if (report.parts.empty()) return report;
  find_track(report, robot);
  const std::unique_ptr<Engine> copy = robot.engine().clone();
  hold_joints(copy->instance(robot.index()));
  report.diverged = run_steps(*copy, {.steps = kSettlingSteps}) == RunEnd::diverged;
  if (report.diverged) return report;
  std::vector<Contact> contacts;
  copy->contacts(contacts);
  for (RollingLoad& of : report.parts) {
    const BodyId body{robot.index(), of.part.link};
    for (const Contact& contact : contacts) {
      if (contact.a == body || contact.b == body) of.load += std::abs(contact.force_W.dot(contact.normal_W));
    }
  }
  return report;
}

std::string to_string(const RollingReport& report) {
  std::string wheels, casters;
  std::vector<bool> said(report.parts.size(), false);
  for (std::size_t i = 0; i < report.parts.size(); ++i) {
    if (said[i]) continue;
    std::vector<const RollingLoad*> group;
    for (std::size_t k = i; k < report.parts.size(); ++k) {
      if (said[k] || !alike(report.parts[i], report.parts[k])) continue;
      said[k] = true;
      group.push_back(&report.parts[k]);
    }
    std::string& to = report.parts[i].part.kind == RollingPart::Kind::wheel ? wheels : casters;
    to += (to.empty() ? "" : ", ") + text_of(group);
  }
  std::string out = "rolls on " + wheels;
  if (report.track) out += fmt::format(", track {:.4g} m", *report.track);
  if (report.effective_track && *report.effective_track > 1.001 * *report.track)
    out += fmt::format(" (effective {:.4g} m)", *report.effective_track);
  if (!casters.empty()) out += "; slides on " + casters;
  if (report.diverged) out += "; its loads are not known, because the physics diverges before it stands";
  return out;
}

}  // namespace doppel
