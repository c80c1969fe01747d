#include "doppel/validation/extras/path_extra.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "doppel/base/math/pose.h"
#include "doppel/base/math/units.h"
#include "doppel/validation/extras/detail/arm_motion.h"
#include "doppel/validation/extras/detail/test_paths.h"
#include "doppel/validation/metrics/path_accuracy.h"

namespace doppel {
namespace {

constexpr std::array<int, 3> kSpeeds = {10, 50, 100};  // % of TestPath::speed
constexpr double kRamp = 0.25, kCircleRamp = 1.0 / 6;  // of the length
constexpr double kReturnPart = 0.5;                    // of that speed, on the way back
constexpr double kPathRest = 0.5;                      // s after a path
constexpr double kSample = 5e-3;                       // s between samples of the speed
constexpr double kMaxPathTime = 120;                   // s, of the cycles of a path at one speed
constexpr int kEqualPassages = 2;                      // of an arm in which nothing varies
constexpr std::size_t kCompared = 4;                   // of so many points, one is compared

// One passage of a path.
struct Passage {
  MeasuredPath poses;  // of the part that is compared, until the rest
  std::vector<double> speeds;
  std::vector<Eigen::Vector3d> positions;  // all
};

// The numbers of one path at one speed.
struct PathRun {
  double speed = 0;  // m/s
  std::size_t cycles = 0;
  std::optional<PathFigures> path;
  std::optional<VelocityFigures> velocity;
  double round_off = 0, overshoot = 0;  // m, the largest
  PlotCurve deviation;                  // m along the path, mm
};

class PathJudge {
 public:
  PathJudge(const CheckContext& context, const ExtraArm& arm, const TestPlane& plane, CheckResult& out)
      : context_(context), arm_(arm), plane_(plane), out_(out), motion_(context, arm) {
    varies_ = motion_.errors().any() ||
              std::ranges::any_of(arm.model().joints, [](const auto& one) { return one.friction > 0; });
  }

  void run(double begin, double end) {
    std::vector<std::string> why;
    const std::vector<TestPath> paths = test_paths(context_, arm_, plane_, why);
    for (const std::string& one : why) out_.notes.push_back(fmt::format("{}: {}", arm_.name(), one));
    double done = 0;
    for (const TestPath& path : paths) {
      CheckItem item;
      item.subject = fmt::format("{}, {}", arm_.name(), path.name);
      PlotPanel panel;
      panel.title = item.subject + ": distance from the commanded path, mean of the cycles";
      panel.unit = "mm";
      panel.x_axis = "m along the path";
      for (const int share : kSpeeds) {
        PathRun run;
        if (const std::string failed = measure(path, share, run); !failed.empty()) {
          out_.add({item.subject, Verdict::warned, fmt::format("at {} % of the speed {}", share, failed)});
        } else {
          add(path, share, run, item);
          panel.curves.push_back(std::move(run.deviation));
        }
        done += 1.0 / static_cast<double>(kSpeeds.size() * paths.size());
        context_.report(begin + (end - begin) * done);
      }
      if (item.message.empty()) continue;
      if (!panel.curves.empty() && !path.name.starts_with("corner")) item.curves.push_back(std::move(panel));
      out_.add(std::move(item));
    }
    add_notes();
  }

  [[nodiscard]] double worst() const { return worst_; }

 private:
  [[nodiscard]] std::string measure(const TestPath& path, int share, PathRun& out) {
    const bool is_circle = path.name == "circle";
    const PathProfile profile{path.length(), (is_circle ? kCircleRamp : kRamp) * path.length(),
                              share / kPercent * path.speed};
    const PathProfile back{path.length(), profile.ramp, kReturnPart * path.speed};
    const double cycle = profile.time() + back.time() + 2 * kPathRest;
    const int most = context_.amount(2, 5, 10);
    const int cycles = varies_ ? std::clamp(static_cast<int>(kMaxPathTime / cycle), 2, most) : kEqualPassages;
    Eigen::VectorXd q = plane_.q.front();
    arm_.chain().apply(arm_.model(), path.u.front(), q);
    if (std::string why = motion_.begin(q); !why.empty()) return why;
    std::vector<Passage> passages;
    for (int i = 0; i < cycles; ++i) {
      Passage& passage = passages.emplace_back();
      motion_.begin_run();
      if (!pass(path, profile, passage) || !retrace(path, back)) return "the physics diverges";
    }
    out.speed = profile.speed;
    out.cycles = passages.size();
    compare(path, passages, out);
    return "";
  }

  // Angles are those against the first commanded pose.
  [[nodiscard]] MeasuredPose measured(const TestPath& path, const Pose& X_RT) const {
    MeasuredPose out{X_RT.translation(), Eigen::Vector3d::Zero()};
    if (plane_.orientation)
      out.angles = rpy_from_rotation(path.X_RT.front().linear().transpose() * X_RT.linear());
    return out;
  }

  [[nodiscard]] bool pass(const TestPath& path, const PathProfile& profile, Passage& out) {
    // The tool lags behind its command, so that it is before the first plane at its time.
    const double first = path.way[path.begin];
    const double steady = profile.ramp_time(), slowing = profile.time() - profile.ramp_time();
    Eigen::Vector3d before = motion_.tool().translation();
    double due = kSample;
    const auto sample = [&](double time) {
      const Pose X_RT = motion_.real_tool();
      out.positions.emplace_back(X_RT.translation());
      if (profile.way(time) >= first) out.poses.push_back(measured(path, X_RT));
      if (time < due) return;
      due += kSample;
      const Eigen::Vector3d present = motion_.tool().translation();
      if (time > steady + kSample && time <= slowing)
        out.speeds.push_back((present - before).norm() / kSample);
      before = present;
    };
    const auto course = [&](double time) { return path.at(profile.way(time)); };
    return motion_.run(course, profile.time(), kPathRest, sample);
  }

  [[nodiscard]] bool retrace(const TestPath& path, const PathProfile& back) {
    return motion_.run([&](double time) { return path.at(path.length() - back.way(time)); }, back.time(),
                       kPathRest, {});
  }

  void compare(const TestPath& path, const std::vector<Passage>& passages, PathRun& out) const {
    std::vector<MeasuredPose> commanded;
    std::vector<double> ways;
    for (std::size_t i = path.begin; i < path.end; i += kCompared) {
      commanded.push_back(measured(path, path.X_RT[i]));
      ways.push_back(path.way[i]);
    }
    std::vector<MeasuredPath> cycles;
    std::vector<std::vector<double>> speeds;
    for (const Passage& passage : passages) {
      if (auto cycle = at_normal_planes(passage.poses, commanded)) cycles.push_back(std::move(*cycle));
      speeds.push_back(passage.speeds);
    }
    out.path = path_figures(cycles, commanded);
    out.velocity = velocity_figures(speeds, out.speed);
    if (path.name == "corner") measure_corner(path, passages, out);
    if (!out.path) return;
    for (std::size_t i = 0; i < commanded.size(); ++i) {
      Eigen::Vector3d mean = Eigen::Vector3d::Zero();
      for (const MeasuredPath& cycle : cycles) mean += cycle[i].position / static_cast<double>(cycles.size());
      out.deviation.times.push_back(ways[i]);
      out.deviation.values.push_back(kMillimetres * (mean - commanded[i].position).norm());
    }
  }

  static void measure_corner(const TestPath& path, const std::vector<Passage>& passages, PathRun& out) {
    for (const Passage& passage : passages) {
      const auto figures = corner_figures(passage.positions, path.corner, path.before, path.after);
      if (!figures) continue;
      out.round_off = std::max(out.round_off, figures->round_off);
      out.overshoot = std::max(out.overshoot, figures->overshoot);
    }
  }

  void add(const TestPath& path, int share, PathRun& run, CheckItem& item) {
    const std::string subject = fmt::format("{}, {} %", item.subject, share);
    std::string text = fmt::format("{} % ({:.1f} mm/s)", share, kMillimetres * run.speed);
    run.deviation.label = fmt::format("{} %", share);
    const auto number = [&](const char* name, double value, const char* unit, const char* short_name) {
      out_.metrics.push_back({name, subject, value, unit});
      text += fmt::format(", {} {:.3f} {}", short_name, value, unit);
    };
    if (path.name == "corner") {
      number("cornering round-off", kMillimetres * run.round_off, "mm", "round-off");
      number("cornering overshoot", kMillimetres * run.overshoot, "mm", "overshoot");
    } else if (run.path) {
      number("path accuracy", kMillimetres * run.path->accuracy, "mm", "AT");
      worst_ = std::max(worst_, run.path->accuracy);
      if (plane_.orientation)
        number("path angle accuracy", run.path->angle_accuracy.maxCoeff() / kDegree, "deg", "angle");
      if (varies_) number("path repeatability", kMillimetres * run.path->repeatability, "mm", "RT");
      if (run.velocity) {
        number("speed accuracy", kPercent * std::abs(run.velocity->accuracy), "%", "AV");
        if (varies_) number("speed repeatability", kPercent * run.velocity->repeatability, "%", "RV");
        number("speed fluctuation", kMillimetres * run.velocity->fluctuation, "mm/s", "FV");
      }
    }
    item.message += (item.message.empty() ? "" : "; ") + text;
    cycles_ = std::min(cycles_, run.cycles);
  }

  void add_notes() {
    if (cycles_ == kNoCycles) return;
    out_.notes.push_back(
        fmt::format("{}: {}, at least {} cycles; 100 % is the largest speed of the tool at "
                    "which no joint exceeds its speed limit",
                    arm_.name(), plane_.text(), cycles_));
    if (motion_.errors().any())
      out_.notes.push_back("passages differ by the errors of the servos, as their datasheet has them: " +
                           motion_.errors().text());
    else if (!varies_)
      out_.notes.emplace_back(
          "nothing varies from passage to passage: repeatabilities are 0 by construction");
  }

  static constexpr std::size_t kNoCycles = SIZE_MAX;
  const CheckContext& context_;
  const ExtraArm& arm_;
  const TestPlane& plane_;
  CheckResult& out_;
  ArmMotion motion_;
  bool varies_ = false;
  std::size_t cycles_ = kNoCycles;
  double worst_ = 0;  // m
};

}  // namespace

CheckResult check_paths(const CheckContext& context) {
  const std::vector<ExtraArm> arms = extra_arms(context);
  if (arms.empty()) return not_applicable("X5", no_arm_reason(context));
  CheckResult out = begin_result("X5");
  for (std::size_t i = 0; i < arms.size(); ++i) {
    const auto plane = shared_test_plane(context, arms[i]);
    if (!*plane) {
      out.notes.push_back(arms[i].name() + kNoPlane);
      continue;
    }
    const auto count = static_cast<double>(arms.size()), done = static_cast<double>(i);
    PathJudge judge(context, arms[i], **plane, out);
    judge.run(done / count, (done + 1) / count);
    out.summary += fmt::format("{}{}: path accuracy at most {:.3f} mm", out.summary.empty() ? "" : "; ",
                               arms[i].name(), kMillimetres * judge.worst());
  }
  if (out.items.empty()) return not_applicable("X5", out.notes.empty() ? "no path" : out.notes.front());
  return out;
}

}  // namespace doppel
