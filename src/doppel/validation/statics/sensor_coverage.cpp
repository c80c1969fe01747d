#include "doppel/validation/statics/sensor_coverage.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <stdexcept>

#include "doppel/base/core/parallel_work.h"
#include "doppel/base/math/units.h"
#include "doppel/validation/statics/detail/sensor_views.h"
#include "doppel/validation/statics/detail/workspace_grid.h"
#include "doppel/validation/statics/start_pose.h"

namespace doppel {
namespace {

constexpr std::size_t kMaxPlaces = 20'000;  // of the workspace
constexpr double kMillimetres = 1e3, kWhole = 100;

// Configurations in which the sensors look: first the start pose, then those with a tool's place.
struct ToolPose {
  Eigen::VectorXd q;
  Eigen::Vector3d tool = Eigen::Vector3d::Zero();  // m, root link
  int tip = -1;                                    // link; -1: there is no tool
};

struct Views {
  std::vector<ToolPose> poses;
  std::vector<Eigen::Vector3d> places;
  double radius = 0;                                      // m, of a place
  std::vector<std::vector<std::vector<SeenPlace>>> seen;  // [poses][fields][places, then the tool's]
  std::vector<std::string> names;                         // of the bodies that may hide places

  [[nodiscard]] const SeenPlace& tool(std::size_t pose, std::size_t field) const {
    return seen[pose][field].back();
  }
};

bool is_carried(const Model& model, int link) {
  for (int joint = model.links[static_cast<std::size_t>(link)].joint; joint >= 0;
       joint = model.links[static_cast<std::size_t>(link)].joint) {
    if (model.joints[static_cast<std::size_t>(joint)].type != JointType::fixed) return true;
    link = model.joints[static_cast<std::size_t>(joint)].parent_link;
  }
  return false;
}

// A tip is often inside of its own part: a part that moves with it, or that it carries, shows where it is.
bool shows_tool(const Model& model, int link, int tip) {
  if (link >= static_cast<int>(model.links.size())) return false;  // an object
  const auto joint_of = [&model](int child) { return model.links[static_cast<std::size_t>(child)].joint; };
  const auto parent_of = [&model](int joint) {
    return model.joints[static_cast<std::size_t>(joint)].parent_link;
  };
  int body = tip;
  for (int joint = joint_of(body); joint >= 0; joint = joint_of(body)) {
    if (model.joints[static_cast<std::size_t>(joint)].type != JointType::fixed) break;
    body = parent_of(joint);
  }
  for (int joint = joint_of(link); link != body && joint >= 0; joint = joint_of(link))
    link = parent_of(joint);
  return link == body;
}

// Every n-th place of a large workspace.
void thin(std::vector<Eigen::Vector3d>& places, CheckResult& out) {
  const std::size_t every = (places.size() + kMaxPlaces - 1) / kMaxPlaces;
  if (every <= 1) return;
  std::vector<Eigen::Vector3d> kept;
  for (std::size_t i = 0; i < places.size(); i += every) kept.push_back(places[i]);
  out.notes.push_back(
      fmt::format("{} of {} places of the workspace are looked at", kept.size(), places.size()));
  places = std::move(kept);
}

Views places_of(const CheckContext& context, CheckResult& out) {
  const Subject& subject = context.subject;
  Views views;
  views.poses.push_back({start_configuration(subject)});
  Diagnostics ignored;
  std::optional<JudgedArm> first;
  Data data(*subject.model);
  for (const ArmGroup& group : subject.arms) {
    const JudgedArm arm = judged_arm(subject, group, ignored);
    if (!first) first = arm;
    for (Eigen::VectorXd& q : free_configurations(arm, context.amount(10, 50, 200), context.seed)) {
      forward_kinematics(*subject.model, data, q);
      const Eigen::Vector3d tool = data.X_WL[static_cast<std::size_t>(group.chain.tip_link)].translation();
      views.poses.push_back({std::move(q), tool, group.chain.tip_link});
    }
  }
  const WorkspaceGrid grid = workspace_grid(context, first ? &*first : nullptr, context.amount(8, 12, 20));
  views.places = grid.points;
  views.radius = 0.5 * grid.step;
  thin(views.places, out);
  return views;
}

void look(const CheckContext& context, const SensorScene& scene, const std::vector<SensorField>& fields,
          Views& views) {
  views.names = scene.names;
  views.seen.resize(views.poses.size());
  parallel_work(views.poses.size(), context.threads, [&] {
    return
        [&, looking = std::make_shared<SensorViews>(*context.subject.model, scene, fields)](std::size_t i) {
          std::vector<Eigen::Vector3d> places = views.places;
          places.push_back(views.poses[i].tool);
          views.seen[i] = looking->look(views.poses[i].q, places, views.radius);
          context.report(static_cast<double>(i) / static_cast<double>(views.poses.size()));
        };
  });
}

struct Hider {
  std::size_t count = 0;
  float nearest = 0;  // m from the sensor
};

struct Coverage {
  std::array<std::size_t, 5> counts{};  // by PlaceSight
  std::map<std::int32_t, Hider> hiders;
  std::vector<double> densities;
  std::size_t tools_seen = 0;
  std::size_t worst = 0;  // the pose in which the robot hides most
  double at_start = 0;    // 0..1

  void add(const SeenPlace& place) {
    ++counts[static_cast<std::size_t>(place.sight)];
    if (place.sight != PlaceSight::hidden) return;
    Hider& hider = hiders[place.hider];
    hider.nearest = hider.count == 0 ? place.distance : std::min(hider.nearest, place.distance);
    ++hider.count;
  }
  [[nodiscard]] double share(PlaceSight sight) const {
    const auto all = std::accumulate(counts.begin(), counts.end(), std::size_t{0});
    return all == 0 ? 0
                    : static_cast<double>(counts[static_cast<std::size_t>(sight)]) / static_cast<double>(all);
  }
};

std::size_t count_of(const std::vector<SeenPlace>& seen, PlaceSight sight) {
  return static_cast<std::size_t>(std::ranges::count(seen.begin(), seen.end() - 1, sight, &SeenPlace::sight));
}

// The sight that says most about a place: seen in some pose, else hidden in some pose, and so on.
const SeenPlace& best_of(const Views& views, std::size_t field, std::size_t place) {
  constexpr std::array<int, 5> kRank = {0, 4, 2, 3, 1};  // by PlaceSight
  const SeenPlace* best = &views.seen.front()[field][place];
  for (const auto& pose : views.seen) {
    const SeenPlace& one = pose[field][place];
    if (kRank[static_cast<std::size_t>(one.sight)] < kRank[static_cast<std::size_t>(best->sight)])
      best = &one;
  }
  return *best;
}

// A sensor that is carried sees what it sees from any pose; one that is not, the mean over all poses.
Coverage coverage_of(const CheckContext& context, const Views& views, const SensorField& field,
                     std::size_t index) {
  Coverage out;
  const bool carried = is_carried(*context.subject.model, field.link);
  std::size_t most_hidden = 0;
  Data data(*context.subject.model);
  for (std::size_t i = 0; i < views.poses.size(); ++i) {
    const std::vector<SeenPlace>& seen = views.seen[i][index];
    if (const std::size_t hidden = count_of(seen, PlaceSight::hidden); hidden > most_hidden) {
      most_hidden = hidden;
      out.worst = i;
    }
    const SeenPlace& tool = views.tool(i, index);
    if (i > 0 && (tool.sight == PlaceSight::seen ||
                  (tool.sight == PlaceSight::hidden &&
                   shows_tool(*context.subject.model, tool.hider, views.poses[i].tip))))
      ++out.tools_seen;
    forward_kinematics(*context.subject.model, data, views.poses[i].q);
    const Pose X_SW = (data.X_WL[static_cast<std::size_t>(field.link)] * field.X_LS).inverse();
    for (std::size_t k = 0; k < views.places.size(); ++k) {
      if (!carried) out.add(seen[k]);
      if (seen[k].sight == PlaceSight::seen) out.densities.push_back(field.density(X_SW * views.places[k]));
    }
  }
  for (std::size_t k = 0; carried && k < views.places.size(); ++k) out.add(best_of(views, index, k));
  out.at_start = static_cast<double>(count_of(views.seen.front()[index], PlaceSight::seen)) /
                 static_cast<double>(std::max<std::size_t>(1, views.places.size()));
  return out;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

const std::string& link_name(const CheckContext& context, int link) {
  return context.subject.model->links[static_cast<std::size_t>(link)].name;
}

bool is_link(const CheckContext& context, std::int32_t body) {
  return body >= 0 && body < static_cast<std::int32_t>(context.subject.model->links.size());
}

// The body that hides the most places; -1: none.
std::int32_t main_hider(const Coverage& coverage) {
  const auto most =
      std::ranges::max_element(coverage.hiders, {}, [](const auto& entry) { return entry.second.count; });
  return most == coverage.hiders.end() ? -1 : most->first;
}

std::string parts_text(const Views& views, const Coverage& coverage) {
  std::string out;
  const auto part = [&](PlaceSight sight, const std::string& text) {
    constexpr double kShown = 0.005;  // less would be printed as 0 %
    if (const double share = coverage.share(sight); share >= kShown)
      out += fmt::format("{}{:.0f} % {}", out.empty() ? "" : ", ", kWhole * share, text);
  };
  part(PlaceSight::outside, "is outside of its field");
  if (const std::int32_t hider = main_hider(coverage); hider >= 0)
    part(PlaceSight::hidden,
         fmt::format("is hidden, mostly by {} from {:.0f} mm", views.names[static_cast<std::size_t>(hider)],
                     kMillimetres * coverage.hiders.at(hider).nearest));
  part(PlaceSight::too_near, "is too near");
  part(PlaceSight::too_far, "is too far");
  return out;
}

// The centre of the workspace from the sensor at the start pose: m, S.
Eigen::Vector3d centre_in(const CheckContext& context, const Views& views, const SensorField& field) {
  Data data(*context.subject.model);
  forward_kinematics(*context.subject.model, data, views.poses.front().q);
  const Pose X_WS = data.X_WL[static_cast<std::size_t>(field.link)] * field.X_LS;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& place : views.places) sum += place;
  return X_WS.inverse() * Eigen::Vector3d(sum / static_cast<double>(views.places.size()));
}

double degrees_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) / kDegree;
}

std::string direction_text(const Eigen::Vector3d& p_S, const SensorField& field) {
  const double left = std::atan2(p_S.y(), p_S.x()) / kDegree;
  const double up = std::atan2(p_S.z(), p_S.head<2>().norm()) / kDegree;
  return fmt::format(
      "the workspace's centre is {:.0f} deg from its axis ({:.0f} deg to the {}, {:.0f} deg {}; half its "
      "field "
      "is {:.0f} deg)",
      degrees_between(Eigen::Vector3d::UnitX(), p_S), std::abs(left), left >= 0 ? "left" : "right",
      std::abs(up), up >= 0 ? "up" : "down", field.half_angle / kDegree);
}

// The sight that most of the places have that are not seen.
PlaceSight main_loss(const Coverage& coverage) {
  PlaceSight out = PlaceSight::outside;
  for (const PlaceSight one : {PlaceSight::too_near, PlaceSight::too_far, PlaceSight::hidden})
    if (coverage.share(one) >= coverage.share(out)) out = one;
  return out;
}

// The cause and the fix of a failure.
void explain(const CheckContext& context, const Views& views, const SensorField& field,
             const Coverage& coverage, CheckItem& item) {
  const std::int32_t hider = main_hider(coverage);
  switch (main_loss(coverage)) {
    case PlaceSight::hidden:
      item.message +=
          fmt::format("; {} is in front of the lens", views.names[static_cast<std::size_t>(hider)]);
      item.fix = is_link(context, hider)
                     ? "move the sensor or that link; is the sensor's frame inside of a part?"
                     : "move the sensor, or the box of the suite's workspace";
      return;
    case PlaceSight::too_near:
    case PlaceSight::too_far:
      item.message += fmt::format("; it sees from {:.3g} to {:.3g} m", field.near, field.far);
      item.fix = "the <clip> or <range> of the sensor, or another place for it";
      return;
    default:
      break;
  }
  const Eigen::Vector3d p_S = centre_in(context, views, field);
  item.message += "; it is turned away: " + direction_text(p_S, field);
  constexpr double kNear = 45;  // deg
  const Eigen::Vector3d z_S = field.X_LS.linear().transpose() * Eigen::Vector3d::UnitZ();
  item.fix =
      degrees_between(p_S, z_S) < kNear && z_S.x() < 0.5
          ? "its link's z axis points there, as that of an optical frame does, but a sensor looks along "
            "x: give it a <pose> of 0 0 0 0 -1.5708 1.5708, or use the link before the optical frame"
          : "the rpy of the joint that holds it, or the sensor's <pose>; a sensor looks along its x axis";
}

void add_metrics(const CheckContext& context, const SensorField& field, const Coverage& coverage,
                 std::size_t tools, CheckResult& out) {
  out.metrics.push_back(
      {"workspace seen", field.name, kWhole * coverage.share(PlaceSight::seen), "%",
       context.suite.min_seen ? std::optional(kWhole * *context.suite.min_seen) : std::nullopt,
       Metric::Better::higher});
  std::size_t hidden = 0, by_robot = 0;
  for (const auto& [body, hider] : coverage.hiders) {
    hidden += hider.count;
    by_robot += is_link(context, body) ? hider.count : 0;
  }
  const double share =
      hidden == 0 ? 0 : kWhole * coverage.share(PlaceSight::hidden) / static_cast<double>(hidden);
  out.metrics.push_back({"hidden by the robot", field.name, share * static_cast<double>(by_robot), "%"});
  out.metrics.push_back(
      {"hidden by its world", field.name, share * static_cast<double>(hidden - by_robot), "%"});
  if (tools > 0)
    out.metrics.push_back({"tool seen", field.name,
                           kWhole * static_cast<double>(coverage.tools_seen) / static_cast<double>(tools),
                           "%", std::nullopt, Metric::Better::higher});
  if (const double density = median(coverage.densities); density > 0)
    out.metrics.push_back({"resolution", field.name, density, "1/cm", std::nullopt, Metric::Better::higher});
}

Verdict verdict_of(const CheckContext& context, const SensorField& field, double share) {
  if (context.suite.min_seen) return share < *context.suite.min_seen ? Verdict::failed : Verdict::passed;
  // Lidars and range sensors of a mobile base may look at other places than the arm's.
  const bool is_meant = context.suite.workspace || std::holds_alternative<CameraIntrinsics>(field.what);
  return share == 0 && is_meant ? Verdict::failed : Verdict::not_judged;
}

void judge_field(const CheckContext& context, const Views& views, const SensorField& field, std::size_t index,
                 CheckResult& out) {
  const Coverage coverage = coverage_of(context, views, field, index);
  const double share = coverage.share(PlaceSight::seen);
  const std::size_t tools = views.poses.size() - 1;
  add_metrics(context, field, coverage, tools, out);
  CheckItem item;
  item.subject = field.name;
  item.where = field.where;
  item.verdict = verdict_of(context, field, share);
  item.message = fmt::format("the {} sees {:.0f} % of the workspace", field.kind, kWhole * share);
  if (context.suite.min_seen)
    item.message += fmt::format(" (at least {:.3g} %)", kWhole * *context.suite.min_seen);
  if (is_carried(*context.subject.model, field.link))
    item.message += fmt::format(" from {} poses, {:.0f} % from the start pose", views.poses.size(),
                                kWhole * coverage.at_start);
  if (tools > 0) item.message += fmt::format(", the tool in {} of {} places", coverage.tools_seen, tools);
  if (const double density = median(coverage.densities); density > 0)
    item.message += fmt::format(", {:.3g} {} on a centimetre", density,
                                std::holds_alternative<CameraIntrinsics>(field.what) ? "pixels" : "rays");
  if (const std::string parts = parts_text(views, coverage); !parts.empty()) item.message += "; " + parts;
  if (item.verdict == Verdict::failed) explain(context, views, field, coverage, item);
  PosedEvidence evidence{coverage.worst == 0 ? "the start pose" : "most of the workspace is hidden",
                         posed_joints(*context.subject.model, views.poses[coverage.worst].q),
                         {link_name(context, field.link)}};
  if (const std::int32_t hider = main_hider(coverage); is_link(context, hider))
    evidence.links.push_back(link_name(context, hider));
  item.poses.push_back(std::move(evidence));
  out.add(std::move(item));
}

}  // namespace

CheckResult check_sensor_coverage(const CheckContext& context) {
  const Subject& subject = context.subject;
  const std::vector<SensorField> fields = sensor_fields(subject.robot().sensors(), *subject.model);
  if (fields.empty())
    return not_applicable("T5", "the description has no camera, lidar or range sensor (<gazebo><sensor>)");
  if (subject.arms.empty() && !context.suite.workspace)
    return not_applicable("T5", "there is no arm, and the suite has no workspace for its sensors");
  CheckResult out = begin_result("T5");
  Diagnostics warnings;
  Views views = places_of(context, out);
  const SensorScene scene = sensor_scene(subject, warnings);
  for (const Diagnostic& warning : warnings.all()) out.notes.push_back(warning.message);
  try {
    look(context, scene, fields, views);
  } catch (const std::runtime_error& error) {
    out.verdict = Verdict::not_run;
    out.summary = error.what();
    return out;
  }
  for (std::size_t i = 0; i < fields.size(); ++i) judge_field(context, views, fields[i], i, out);
  double least = 1;
  for (const Metric& metric : out.metrics)
    if (metric.name == "workspace seen") least = std::min(least, metric.value / kWhole);
  out.summary = fmt::format("{} sensor{}, at least {:.0f} % of {} places seen", fields.size(),
                            fields.size() == 1 ? "" : "s", kWhole * least, views.places.size());
  if (context.suite.min_seen)
    out.summary += fmt::format(" (limit {:.3g} %)", kWhole * *context.suite.min_seen);
  return out;
}

}  // namespace doppel
