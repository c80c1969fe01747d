#include "doppel/twin/attachments/detail/grasp_monitor.h"

#include <fmt/format.h>

#include <algorithm>

namespace doppel {
namespace {

constexpr Duration kIdlePeriod{50'000'000}, kHoldingPeriod{20'000'000};
constexpr double kNearlyAll = 0.9;      // of the friction
constexpr double kSlipping = 0.98;      // of the friction: a contact that slides
constexpr double kReportedSlip = 2e-3;  // m; less can be a finger that finds its place
constexpr double kSmallSlip = 2e-4;     // m between two looks
constexpr const char* kGraspOrigin = "grasp";

}  // namespace

GraspMonitor::GraspMonitor(Bus& bus, const Scene& scene, const Log& log)
    : scene_(scene), log_(log), node_(bus, "/doppel") {
  topic_ = node_.advertise<diagnostic_msgs::msg::DiagnosticArray>("~/grasps");
  instances_changed();
}

void GraspMonitor::instances_changed() {
  const auto& instances = scene_.engine().world().instances();
  can_hold_ = std::ranges::any_of(instances, has_fingers) && std::ranges::any_of(instances, can_be_held);
  if (!can_hold_) held_.clear();
}

void GraspMonitor::reset(Time now) {
  held_.clear();
  next_look_ = now;
}

bool GraspMonitor::Held::is(const Scene& scene, const Grasp& grasp) const {
  return body_link == grasp.body.link && robot == scene.instance(grasp.robot).name() &&
         object == scene.instance(grasp.body.instance).name();
}

void GraspMonitor::look(Time now) {
  scene_.engine().contacts(contacts_);
  find_grasps(scene_.engine().world(), contacts_, grasps_);
  std::vector<Held> fresh;
  for (const Grasp& grasp : grasps_) {
    fresh.push_back(follow(grasp, now));
    report(grasp, fresh.back());
  }
  held_ = std::move(fresh);
  last_look_ = now;
  next_look_ = now + (held_.empty() ? kIdlePeriod : kHoldingPeriod);
  if (topic_.has_listeners()) publish_grasps(now);
}

// The state of a grasp, continued from the last look.
GraspMonitor::Held GraspMonitor::follow(const Grasp& grasp, Time now) const {
  const auto before = std::ranges::find_if(held_, [&](const Held& h) { return h.is(scene_, grasp); });
  Held out;
  if (before != held_.end()) {
    out = *before;
  } else {
    out.robot = scene_.instance(grasp.robot).name();
    out.object = scene_.instance(grasp.body.instance).name();
    out.body_link = grasp.body.link;
    out.since = now;
  }
  measure_slip(grasp, out);
  return out;
}

void GraspMonitor::measure_slip(const Grasp& grasp, Held& held) const {
  const Instance robot = scene_.instance(grasp.robot);
  const Pose X_WB = scene_.instance(grasp.body.instance).link_pose(grasp.body.link);
  std::vector<Mark> marks;
  for (const GraspLink& of : grasp.links) {
    const Pose X_WL = robot.link_pose(of.link);
    const auto known = std::ranges::find(held.marks, of.link, &Mark::link);
    marks.push_back(known != held.marks.end()
                        ? *known
                        : Mark{of.link, X_WL.inverse() * of.p_W, X_WB.inverse() * of.p_W, 0});
    Mark& mark = marks.back();
    const Eigen::Vector3d moved = X_WB * mark.p_B - X_WL * mark.p_L;
    mark.slip = (moved - of.normal_W * of.normal_W.dot(moved)).norm();
  }
  const double before = held.slip;
  held.marks = std::move(marks);
  held.slip = 0;
  for (const Mark& mark : held.marks) held.slip = std::max(held.slip, mark.slip);
  held.slips = grasp.friction_used() > kSlipping && held.slip - before > kSmallSlip;
}

std::string GraspMonitor::names_of_links(const Grasp& grasp) const {
  std::string out;
  for (const GraspLink& of : grasp.links) {
    if (!out.empty()) out += ", ";
    out += scene_.instance(grasp.robot).model().links[static_cast<std::size_t>(of.link)].name;
  }
  return out;
}

double GraspMonitor::weight_of(const Grasp& grasp) const {
  return scene_.instance(grasp.body.instance).model().total_mass *
         scene_.engine().world().settings().gravity.norm();
}

std::string GraspMonitor::cause_of(const Grasp& grasp) const {
  const double capacity = grasp.capacity(), weight = weight_of(grasp);
  const std::string friction = fmt::format("friction {:.2g} x {:.3g} N = {:.3g} N",
                                           capacity / grasp.pressure(), grasp.pressure(), capacity);
  if (capacity < weight) return fmt::format("{} < weight {:.3g} N", friction, weight);
  if (!grasp.supported)
    return fmt::format("{} carries the weight of {:.3g} N, but not the acceleration of this motion", friction,
                       weight);
  const auto other = std::ranges::find_if(contacts_, [&](const Contact& contact) {
    return (contact.a == grasp.body && contact.b.instance != grasp.robot) ||
           (contact.b == grasp.body && contact.a.instance != grasp.robot);
  });
  return fmt::format("{} is exceeded, because '{}' holds it back", friction,
                     scene_.engine().world().name_of(other->a == grasp.body ? other->b : other->a));
}

void GraspMonitor::report(const Grasp& grasp, Held& held) const {
  if (!held.slips) return report_creep(grasp, held);
  if (held.reported || held.slip < kReportedSlip) return;
  held.reported = true;
  log_.warning(kGraspOrigin, fmt::format("'{}' slips between {} of '{}': {}", held.object,
                                         names_of_links(grasp), held.robot, cause_of(grasp)));
}

// Reports a grasp that slips more slowly than kSmallSlip a look, and nevertheless far.
void GraspMonitor::report_creep(const Grasp& grasp, Held& held) const {
  if (held.reported || held.creep_reported || held.slip < kReportedSlip) return;
  const double used = grasp.friction_used();
  if (used <= kNearlyAll) return;
  held.creep_reported = true;
  log_.warning(kGraspOrigin,
               fmt::format("'{}' creeps between {} of '{}': {:.1f} mm since it is held, slower "
                           "than 1 cm/s, with {:.0f} % of the friction used",
                           held.object, names_of_links(grasp), held.robot, 1e3 * held.slip, 100 * used));
}

diagnostic_msgs::msg::DiagnosticStatus GraspMonitor::status_of(const Grasp& grasp, const Held& held,
                                                               Time now) const {
  using diagnostic_msgs::msg::DiagnosticStatus;
  DiagnosticStatus out;
  const double used = grasp.friction_used();
  out.level = held.slips          ? DiagnosticStatus::ERROR
              : used > kNearlyAll ? DiagnosticStatus::WARN
                                  : DiagnosticStatus::OK;
  out.name = fmt::format("grasp: {} holds {}", held.robot, held.object);
  out.hardware_id = held.robot;
  out.message =
      held.slips ? "slips: " + cause_of(grasp) : fmt::format("{:.0f} % of the friction is used", 100 * used);
  const auto add = [&out](const char* key, std::string value) {
    out.values.push_back({key, std::move(value)});
  };
  add("robot", held.robot);
  add("object", held.object);
  add("links", names_of_links(grasp));
  add("force (N)", fmt::format("{:.3f}", grasp.pressure()));
  add("friction used (%)", fmt::format("{:.1f}", 100 * used));
  add("slip (mm)", fmt::format("{:.4f}", 1e3 * held.slip));
  add("held for (s)", fmt::format("{:.3f}", to_seconds(now - held.since)));
  add("weight (N)", fmt::format("{:.3f}", weight_of(grasp)));
  return out;
}

void GraspMonitor::publish_grasps(Time now) const {
  diagnostic_msgs::msg::DiagnosticArray message;
  message.header.stamp = to_time_msg(node_.bus().stamp(now));
  for (std::size_t i = 0; i < grasps_.size(); ++i)
    message.status.push_back(status_of(grasps_[i], held_[i], now));
  for (const Attachment& of : scene_.engine().attachments()) {
    const auto name = [this](BodyId body) {
      const Instance instance = scene_.instance(body.instance);
      return fmt::format("{}::{}", instance.name(),
                         instance.model().links[static_cast<std::size_t>(body.link)].name);
    };
    diagnostic_msgs::msg::DiagnosticStatus status;
    status.name = fmt::format("attachment: {} and {}", name(of.a), name(of.b));
    status.hardware_id = scene_.instance(of.a.instance).name();
    status.message = "attached on request";
    message.status.push_back(std::move(status));
  }
  topic_.publish(message, now);
}

}  // namespace doppel
