#include "doppel/validation/extras/pose_extras.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <span>

#include "doppel/base/math/units.h"
#include "doppel/validation/extras/detail/pose_cycles.h"
#include "doppel/validation/statics/start_pose.h"

namespace doppel {
namespace {

constexpr double kMinBand = 1e-4;  // m: the band of an approach where the repeatability is smaller

// What X3, X4 and X8 have in common.
struct PoseStudy {
  std::shared_ptr<const std::optional<TestPlane>> plane;
  std::string why;  // there are no cycles
  PoseCycles cycles;
};

std::shared_ptr<const PoseStudy> pose_study(const CheckContext& context, const ExtraArm& arm) {
  return shared_result<PoseStudy>(context, "pose cycles of " + arm.name(), [&] {
    PoseStudy out;
    out.plane = shared_test_plane(context, arm);
    if (*out.plane)
      out.why = run_pose_cycles(context, arm, **out.plane, context.amount(3, 10, 30), out.cycles);
    return out;
  });
}

// The cycles of each arm; judge() adds their numbers.
CheckResult run_cycles(
    const CheckContext& context, const char* id,
    const std::function<void(const ExtraArm&, const TestPlane&, const PoseCycles&, CheckResult&)>& judge) {
  const std::vector<ExtraArm> arms = extra_arms(context);
  if (arms.empty()) return not_applicable(id, no_arm_reason(context));
  CheckResult out = begin_result(id);
  for (const ExtraArm& arm : arms) {
    const auto study = pose_study(context, arm);
    if (!*study->plane) {
      out.notes.push_back(arm.name() + kNoPlane);
      continue;
    }
    if (!study->why.empty()) {
      out.notes.push_back(fmt::format("{}: {}", arm.name(), study->why));
      continue;
    }
    const TestPlane& plane = **study->plane;
    out.notes.push_back(fmt::format("{}: {}, {} cycles at half of the speed limits", arm.name(), plane.text(),
                                    study->cycles.approaches.front().size()));
    if (!plane.orientation)
      out.notes.push_back(arm.name() + ": the tool's orientation differs from pose to pose");
    judge(arm, plane, study->cycles, out);
  }
  if (out.items.empty()) return not_applicable(id, out.notes.front());
  return out;
}

std::vector<MeasuredPose> attained_of(const std::vector<PoseApproach>& approaches) {
  std::vector<MeasuredPose> out;
  for (const PoseApproach& approach : approaches) out.push_back(approach.attained);
  return out;
}

void note_variation(const PoseCycles& cycles, CheckResult& out) {
  if (!cycles.servos.empty()) {
    out.notes.push_back("cycles differ by the errors of the servos, as their datasheet has them: " +
                        cycles.servos);
  } else if (cycles.varies) {
    out.notes.emplace_back(
        "the twin is deterministic: cycles differ only by where friction holds the joints; a datasheet with "
        "resolution, backlash or noise of the servos makes them vary");
  } else {
    out.notes.emplace_back(
        "no joint has friction, resolution, backlash or noise: the repeatability is 0 by construction");
  }
}

void judge_accuracy(const ExtraArm& arm, const TestPlane& plane, const PoseCycles& cycles, CheckResult& out) {
  double worst = 0, worst_angle = 0, spread = 0;
  std::size_t worst_pose = 0;
  CheckItem item;
  item.subject = arm.name();
  for (std::size_t i = 0; i < kTestPoses; ++i) {
    const auto figures = pose_figures(attained_of(cycles.approaches[i]), cycles.commanded[i]);
    if (!figures) continue;
    const std::string subject = fmt::format("{}, P{}", arm.name(), i + 1);
    const double angle = figures->angle_accuracy.cwiseAbs().maxCoeff();
    out.metrics.push_back({"pose accuracy", subject, kMillimetres * figures->accuracy, "mm"});
    out.metrics.push_back({"angle accuracy", subject, angle / kDegree, "deg"});
    std::string text =
        fmt::format("P{}: {:.3f} mm, {:.3f} deg", i + 1, kMillimetres * figures->accuracy, angle / kDegree);
    if (cycles.varies) {
      out.metrics.push_back({"pose repeatability", subject, kMillimetres * figures->repeatability, "mm"});
      text += fmt::format(", repeatability {:.4f} mm", kMillimetres * figures->repeatability);
    }
    item.message += (item.message.empty() ? "" : "; ") + text;
    item.poses.push_back({fmt::format("P{}", i + 1), posed_joints(arm.model(), plane.q[i])});
    spread = std::max(spread, figures->repeatability);
    worst_angle = std::max(worst_angle, angle);
    if (figures->accuracy <= worst) continue;
    worst = figures->accuracy;
    worst_pose = i + 1;
  }
  out.summary +=
      fmt::format("{}{}: accuracy at most {:.3f} mm (P{}), {:.3f} deg{}", out.summary.empty() ? "" : "; ",
                  arm.name(), kMillimetres * worst, worst_pose, worst_angle / kDegree,
                  cycles.varies ? fmt::format(", repeatability {:.4f} mm", kMillimetres * spread) : "");
  out.add(std::move(item));
  note_variation(cycles, out);
}

struct ApproachMaxima {
  double time = 0, stabilisation = 0, overshoot = 0;
};

// Each approach, with the band of its pose.
ApproachMaxima measure_approaches(const PoseCycles& cycles, std::size_t pose, double band) {
  ApproachMaxima out;
  for (const PoseApproach& approach : cycles.approaches[pose]) {
    const auto figures =
        approach_figures(approach.time, approach.positions, approach.attained.position, band);
    if (!figures || !figures->reached) continue;
    out.time = std::max(out.time, figures->inside_for_good);
    out.stabilisation = std::max(out.stabilisation, figures->stabilisation);
    out.overshoot = std::max(out.overshoot, figures->overshoot);
  }
  return out;
}

void judge_approach(const ExtraArm& arm, const TestPlane&, const PoseCycles& cycles, CheckResult& out) {
  ApproachMaxima all;
  CheckItem item;
  item.subject = arm.name();
  PlotPanel panel;
  panel.title = arm.name() + ": distance from the attained pose, last cycle";
  panel.unit = "mm";
  for (std::size_t i = 0; i < kTestPoses; ++i) {
    const auto figures = pose_figures(attained_of(cycles.approaches[i]), cycles.commanded[i]);
    if (!figures) continue;
    const ApproachMaxima one = measure_approaches(cycles, i, std::max(kMinBand, figures->repeatability));
    all = {std::max(all.time, one.time), std::max(all.stabilisation, one.stabilisation),
           std::max(all.overshoot, one.overshoot)};
    const PoseApproach& last = cycles.approaches[i].back();
    PlotCurve curve{fmt::format("P{}", i + 1), last.time, {}};
    for (const Eigen::Vector3d& position : last.positions)
      curve.values.push_back(kMillimetres * (position - last.attained.position).norm());
    panel.curves.push_back(std::move(curve));
  }
  const auto distance = distance_figures(attained_of(cycles.approaches[1]), attained_of(cycles.approaches[3]),
                                         cycles.commanded[1], cycles.commanded[3]);
  out.metrics.push_back({"posing time", arm.name(), all.time, "s"});
  out.metrics.push_back({"stabilisation time", arm.name(), all.stabilisation, "s"});
  out.metrics.push_back({"overshoot", arm.name(), kMillimetres * all.overshoot, "mm"});
  item.message =
      fmt::format("posing time {:.3f} s (command {:.3f} s), stabilisation {:.3f} s, overshoot {:.3f} mm",
                  all.time, cycles.motion_time, all.stabilisation, kMillimetres * all.overshoot);
  if (distance) {
    out.metrics.push_back(
        {"distance accuracy", arm.name(), kMillimetres * std::abs(distance->accuracy), "mm"});
    item.message += fmt::format(", distance P2 to P4 {:+.3f} mm", kMillimetres * distance->accuracy);
    if (cycles.varies) {
      out.metrics.push_back(
          {"distance repeatability", arm.name(), kMillimetres * distance->repeatability, "mm"});
      item.message +=
          fmt::format(" with a repeatability of {:.4f} mm", kMillimetres * distance->repeatability);
    }
  }
  item.curves.push_back(std::move(panel));
  out.summary += fmt::format("{}{}: {}", out.summary.empty() ? "" : "; ", arm.name(), item.message);
  out.add(std::move(item));
  note_variation(cycles, out);
}

// ISO 9283, 7.6, over the cycles instead of eight hours: P1 at their begin and in each later part.
void judge_drift(const ExtraArm& arm, const PoseCycles& cycles, CheckResult& out) {
  constexpr std::size_t kParts = 3, kMinPart = 3;  // parts of the cycles, cycles of a part
  const std::vector<MeasuredPose> all = attained_of(cycles.approaches.front());
  const std::size_t size = all.size() / kParts;
  if (!cycles.varies || size < kMinPart) return;
  std::vector<PoseFigures> over_time;
  for (std::size_t i = 0; i < kParts; ++i) {
    const auto part = std::span(all).subspan(i * size, size);
    if (const auto figures = pose_figures(part, cycles.commanded.front())) over_time.push_back(*figures);
  }
  const auto drift = drift_figures(over_time);
  if (!drift) return;
  out.metrics.push_back({"drift of accuracy", arm.name(), kMillimetres * drift->accuracy, "mm"});
  out.items.back().message +=
      fmt::format(", drift of P1 {:.4f} mm in {:.0f} s", kMillimetres * drift->accuracy,
                  cycles.cycle_time * static_cast<double>(all.size()));
}

// The largest distance of a pose's means from direction to direction.
void judge_directions(const CheckContext& context, const ExtraArm& arm, const TestPlane& plane,
                      CheckResult& out) {
  PoseDirections directions;
  const std::string why = run_pose_directions(context, arm, plane, context.amount(3, 10, 30), directions);
  if (!why.empty()) {
    out.notes.push_back(fmt::format("{}: no variation by direction: {}", arm.name(), why));
    return;
  }
  double worst = 0;
  std::string text;
  for (std::size_t i = 0; i < directions.attained.size(); ++i) {
    std::vector<PoseFigures> means;
    for (const std::vector<MeasuredPose>& attained : directions.attained[i])
      if (const auto figures = pose_figures(attained, directions.commanded[i])) means.push_back(*figures);
    const auto variation = direction_figures(means);
    const std::string name = fmt::format("P{}", kDirectionPoses[i] + 1);
    if (!variation) continue;
    const double value = kMillimetres * variation->position;
    out.metrics.push_back({"variation by direction", fmt::format("{}, {}", arm.name(), name), value, "mm"});
    text +=
        fmt::format("{}{} {:.4f} mm ({} directions)", text.empty() ? "" : ", ", name, value, means.size());
    worst = std::max(worst, value);
  }
  if (text.empty()) {
    out.notes.push_back(arm.name() + ": no test pose can be approached from two directions");
    return;
  }
  out.notes.push_back(fmt::format("{}: variation by the direction of the approach: {}", arm.name(), text));
  out.items.back().message += fmt::format(", variation by direction {:.4f} mm", worst);
}

void judge_power(const CheckContext& context, const ExtraArm& arm, const PoseCycles& cycles,
                 CheckResult& out) {
  CheckItem item;
  item.subject = arm.name();
  out.metrics.push_back({"energy of a cycle", arm.name(), cycles.energy, "J"});
  out.metrics.push_back({"mean power", arm.name(), cycles.mean_power, "W"});
  out.metrics.push_back({"peak power", arm.name(), cycles.peak_power, "W"});
  item.message = fmt::format("{:.2f} J in a cycle of {:.2f} s, mean {:.2f} W, peak {:.2f} W (mechanical)",
                             cycles.energy, cycles.cycle_time, cycles.mean_power, cycles.peak_power);
  PlotPanel panel;
  panel.title = arm.name() + ": mechanical power of the drives, one cycle";
  panel.unit = "W";
  panel.curves.push_back({"power", cycles.power_time, cycles.power});
  if (context.suite.supply) {
    const PowerSupply& supply = *context.suite.supply;
    const double current = cycles.peak_power / (supply.voltage * supply.efficiency);
    out.metrics.push_back({"peak current", arm.name(), current, "A", supply.current});
    item.message += fmt::format(", peak current {:.2f} A of {:.3g} A", current, supply.current);
    panel.bands.push_back({"supply", 0, supply.voltage * supply.current * supply.efficiency, 0,
                           cycles.power_time.empty() ? 0 : cycles.power_time.back()});
    if (current > supply.current) {
      item.verdict = Verdict::warned;
      item.message += ": the supply's voltage breaks down";
      item.fix = "a stronger supply, or lower speeds and accelerations";
    }
  }
  item.curves.push_back(std::move(panel));
  out.summary += fmt::format("{}{}: {}", out.summary.empty() ? "" : "; ", arm.name(), item.message);
  out.add(std::move(item));
}

}  // namespace

CheckResult check_pose_accuracy(const CheckContext& context) {
  return run_cycles(context, "X3", judge_accuracy);
}

CheckResult check_pose_approach(const CheckContext& context) {
  CheckResult out = run_cycles(
      context, "X4",
      [&](const ExtraArm& arm, const TestPlane& plane, const PoseCycles& cycles, CheckResult& result) {
        judge_approach(arm, plane, cycles, result);
        judge_drift(arm, cycles, result);
        judge_directions(context, arm, plane, result);
      });
  if (out.verdict != Verdict::not_applicable)
    out.notes.emplace_back("a twin does not become warm: what drifts here are friction and chance");
  return out;
}

CheckResult check_power(const CheckContext& context) {
  CheckResult out = run_cycles(context, "X8",
                               [&](const ExtraArm& arm, const TestPlane&, const PoseCycles& cycles,
                                   CheckResult& result) { judge_power(context, arm, cycles, result); });
  if (out.verdict != Verdict::not_applicable)
    out.notes.emplace_back(
        "the sum of torque x speed of the drives that push; what others give back is lost. "
        "Losses in copper and the power of holding still are not part of a description");
  return out;
}

}  // namespace doppel
