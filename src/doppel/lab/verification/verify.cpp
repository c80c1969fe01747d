#include "doppel/lab/verification/verify.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/base/core/names.h"
#include "doppel/physics/contract/step_scheme.h"

namespace doppel {
namespace {

constexpr double kRounding = 1e-12;  // rad or m: smaller differences are rounding and have no order
constexpr int kFineness[] = {1, 2, 4};

struct Runs {
  MotionRecord at[3];   // h, h/2, h/4
  MotionRecord beside;  // at h, from a perturbed start

  // The number of samples that all runs have; at least the start.
  [[nodiscard]] std::size_t samples() const {
    return std::min({at[0].x.size(), at[1].x.size(), at[2].x.size(), beside.x.size()});
  }
};

// The first sample at which the perturbation has grown by kChaoticGrowth; nullopt: there is none.
std::optional<std::size_t> chaotic_from(const Runs& runs) {
  for (std::size_t i = 0; i < runs.samples(); ++i) {
    if (runs.at[0].x[i].size() > 0 &&
        (runs.beside.x[i] - runs.at[0].x[i]).lpNorm<Eigen::Infinity>() > kChaoticGrowth * kPerturbation)
      return i;
  }
  return std::nullopt;
}

std::optional<double> order_seen(const Runs& runs, std::size_t samples) {
  double coarse = 0, fine = 0, count = 0;
  for (std::size_t i = 0; i < samples; ++i) {
    coarse += (runs.at[0].x[i] - runs.at[1].x[i]).squaredNorm();
    fine += (runs.at[1].x[i] - runs.at[2].x[i]).squaredNorm();
    count += static_cast<double>(runs.at[0].x[i].size());
  }
  if (!(std::sqrt(std::min(coarse, fine) / std::max(1.0, count)) >= kRounding)) return std::nullopt;
  return 0.5 * std::log2(coarse / fine);
}

class ErrorEstimate {
 public:
  ErrorEstimate(const Runs& runs, const std::vector<Coordinate>& coordinates, double order)
      : runs_(runs), coordinates_(coordinates), factor_(1.0 / (std::exp2(order) - 1.0)) {}

  void write(MotionVerdict& out, std::size_t samples) const {
    for (const Coordinate& coordinate : coordinates_)
      out.joints.push_back({coordinate.name, coordinate.slides, 0, 0});
    for (std::size_t i = 0; i < runs_.samples(); ++i) {
      out.curve.time.push_back(runs_.at[0].time[i]);
      const Eigen::VectorXd exact = extrapolated(runs_.at[1].x[i], runs_.at[2].x[i]);
      for (int step = 0; step < 3; ++step) {
        const Eigen::VectorXd error = (runs_.at[step].x[i] - exact).cwiseAbs();
        out.curve.error[step].push_back(error.size() > 0 ? error.maxCoeff() : 0.0);
        if (step == 0 && i < samples) write_errors(out, i, error);
      }
    }
  }

 private:
  template <typename Vector>
  [[nodiscard]] Vector extrapolated(const Vector& half, const Vector& quarter) const {
    return quarter + factor_ * (quarter - half);
  }
  void write_errors(MotionVerdict& out, std::size_t i, const Eigen::VectorXd& error) const {
    for (std::size_t j = 0; j < out.joints.size(); ++j) {
      out.joints[j].at_end = error[static_cast<Eigen::Index>(j)];
      out.joints[j].largest = std::max(out.joints[j].largest, out.joints[j].at_end);
    }
    const bool good_so_far = i == 0 || out.good_until == out.curve.time[i - 1];
    if (good_so_far && out.curve.error[0].back() < kStillGood) out.good_until = out.curve.time[i];
    out.tool_at_end = (runs_.at[0].tool[i] - extrapolated(runs_.at[1].tool[i], runs_.at[2].tool[i])).norm();
    out.tool_largest = std::max(out.tool_largest, out.tool_at_end);
  }

  const Runs& runs_;
  const std::vector<Coordinate>& coordinates_;
  double factor_;
};

MotionVerdict verify_motion(const MotionSubject& subject, MotionKind kind, const VerifyOptions& options,
                            const std::string& tool) {
  MotionVerdict out;
  out.kind = kind;
  const Motion motion(subject, kind, tool);
  Runs runs;
  const auto announce = [&](int run) {
    if (options.on_run) options.on_run(kind, run);
  };
  for (int step = 0; step < 3; ++step) {
    announce(step + 1);
    runs.at[step] =
        motion.run(options.duration, kFineness[step], 0.0, step == 0 && kind != MotionKind::smooth);
    if (runs.at[step].diverged && !out.runs_away_after) out.runs_away_after = runs.at[step].time.back();
  }
  announce(kRuns);
  runs.beside = motion.run(options.duration, 1, kPerturbation);
  const std::optional<std::size_t> chaos = chaotic_from(runs);
  const std::size_t samples = chaos.value_or(runs.samples());
  if (chaos) out.chaotic_after = runs.at[0].time[*chaos];
  out.span = runs.at[0].time[std::max<std::size_t>(samples, 1) - 1];
  out.order = order_seen(runs, samples);
  const double most = step_scheme(subject.world.integrator).order;
  ErrorEstimate(runs, motion.coordinates(), std::clamp(out.order.value_or(most), kMinSeenOrder, most))
      .write(out, samples);
  out.touches_after = runs.at[0].touches_after;
  if (kind == MotionKind::smooth) out.energy_drift = runs.at[0].energy_drift;
  return out;
}

}  // namespace

double MotionVerdict::largest(bool slides) const {
  double out = 0;
  for (const JointError& joint : joints) {
    if (joint.slides == slides) out = std::max(out, joint.largest);
  }
  return out;
}

Verification verify(const MotionSubject& asked, const VerifyOptions& options) {
  MotionSubject subject = asked;
  subject.world.step -= subject.world.step % kFineness[2];  // times are whole nanoseconds
  Verification out;
  out.robot = subject.robot.model->name;
  out.world = subject.world.name;
  out.integrator = subject.world.integrator;
  out.step = to_seconds(subject.world.step);
  out.duration = options.duration;
  out.tool = options.tool.empty() ? choose_tool(*subject.robot.model) : options.tool;
  if (subject.robot.model->find_link(out.tool) < 0) {
    std::vector<std::string> links;
    for (const ModelLink& link : subject.robot.model->links) links.push_back(link.name);
    throw InputError("verify.tool", {},
                     fmt::format("the robot has no link '{}'{}", out.tool, did_you_mean(out.tool, links)),
                     "give a link of the robot with --tool; `doppel tree` prints them");
  }
  std::vector<MotionKind> motions = options.motions;
  if (motions.empty()) motions.assign(std::begin(kMotions), std::end(kMotions));
  for (const MotionKind kind : motions)
    out.motions.push_back(verify_motion(subject, kind, options, out.tool));
  return out;
}

}  // namespace doppel
