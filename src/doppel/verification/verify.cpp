#include "doppel/verification/verify.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/core/names.h"
#include "doppel/physics/step_scheme.h"

namespace doppel {
namespace {

constexpr double kRounding = 1e-12;  // rad or m: smaller differences say nothing of the order
constexpr double kLeastOrder = 0.5;  // that an extrapolation is made with
constexpr int kFineness[] = {1, 2, 4};

struct Runs {
  MotionRecord at[3];   // h, h/2, h/4
  MotionRecord beside;  // at h, from a perturbed start

  // That all have; at least the start.
  [[nodiscard]] std::size_t samples() const {
    return std::min({at[0].q.size(), at[1].q.size(), at[2].q.size(), beside.q.size()});
  }
};

std::vector<const ModelJoint*> free_joints(const Model& model) {
  std::vector<const ModelJoint*> out;
  for (const ModelJoint& joint : model.joints) {
    if (joint.scalar() && !joint.mimics()) out.push_back(&joint);
  }
  return out;
}

// The first sample at which the perturbation has grown by kChaoticGrowth; none: it has not.
std::optional<std::size_t> chaotic_from(const Runs& runs, const std::vector<const ModelJoint*>& joints) {
  for (std::size_t i = 0; i < runs.samples(); ++i) {
    for (const ModelJoint* joint : joints) {
      if (std::abs(runs.beside.q[i][joint->q] - runs.at[0].q[i][joint->q]) > kChaoticGrowth * kPerturbation)
        return i;
    }
  }
  return std::nullopt;
}

std::optional<double> order_seen(const Runs& runs, const std::vector<const ModelJoint*>& joints,
                                 std::size_t samples) {
  double coarse = 0, fine = 0;
  for (std::size_t i = 0; i < samples; ++i) {
    for (const ModelJoint* joint : joints) {
      coarse += std::pow(runs.at[0].q[i][joint->q] - runs.at[1].q[i][joint->q], 2);
      fine += std::pow(runs.at[1].q[i][joint->q] - runs.at[2].q[i][joint->q], 2);
    }
  }
  const double count = static_cast<double>(std::max<std::size_t>(1, samples * joints.size()));
  if (std::sqrt(fine / count) < kRounding || std::sqrt(coarse / count) < kRounding) return std::nullopt;
  return 0.5 * std::log2(coarse / fine);
}

class Judge {
 public:
  Judge(const Runs& runs, const Model& model, double order)
      : runs_(runs), joints_(free_joints(model)), factor_(1.0 / (std::exp2(order) - 1.0)) {}

  void write(MotionVerdict& out, std::size_t samples) const {
    for (const ModelJoint* joint : joints_)
      out.joints.push_back({joint->name, joint->type == JointType::prismatic, 0, 0});
    for (std::size_t i = 0; i < runs_.samples(); ++i) {
      double worst[3] = {};
      for (std::size_t j = 0; j < joints_.size(); ++j) {
        for (int step = 0; step < 3; ++step)
          worst[step] = std::max(worst[step], error(step, i, joints_[j]->q));
        if (i >= samples) continue;
        out.joints[j].at_end = error(0, i, joints_[j]->q);
        out.joints[j].largest = std::max(out.joints[j].largest, out.joints[j].at_end);
      }
      out.curve.time.push_back(runs_.at[0].time[i]);
      for (int step = 0; step < 3; ++step) out.curve.error[step].push_back(worst[step]);
      if (i >= samples) continue;
      if (worst[0] < kStillGood && out.good_until == out.curve.time[i > 0 ? i - 1 : 0])
        out.good_until = out.curve.time[i];
      out.tool_at_end = tool_error(i);
      out.tool_largest = std::max(out.tool_largest, out.tool_at_end);
    }
  }

 private:
  [[nodiscard]] double error(int step, std::size_t i, int q) const {
    const double finest = runs_.at[2].q[i][q];
    const double exact = finest + factor_ * (finest - runs_.at[1].q[i][q]);
    return std::abs(runs_.at[step].q[i][q] - exact);
  }
  [[nodiscard]] double tool_error(std::size_t i) const {
    const Eigen::Vector3d& finest = runs_.at[2].tool[i];
    return (runs_.at[0].tool[i] - finest - factor_ * (finest - runs_.at[1].tool[i])).norm();
  }

  const Runs& runs_;
  std::vector<const ModelJoint*> joints_;
  double factor_;
};

MotionVerdict judge(const MotionSubject& subject, MotionKind kind, const VerifyOptions& options,
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
  const auto joints = free_joints(motion.model());
  const std::optional<std::size_t> chaos = chaotic_from(runs, joints);
  const std::size_t samples = chaos.value_or(runs.samples());
  if (chaos) out.chaotic_after = runs.at[0].time[*chaos];
  out.span = runs.at[0].time[std::max<std::size_t>(samples, 1) - 1];
  out.order = order_seen(runs, joints, samples);
  const double most = step_scheme(subject.world.integrator).order;
  Judge(runs, motion.model(), std::clamp(out.order.value_or(most), kLeastOrder, most)).write(out, samples);
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

Verification verify(const MotionSubject& subject, const VerifyOptions& options) {
  Verification out;
  out.robot = subject.model.name;
  out.world = subject.world.name;
  out.integrator = subject.world.integrator;
  out.step = to_seconds(subject.world.step);
  out.duration = options.duration;
  out.tool = options.tool.empty() ? choose_tool(subject.model) : options.tool;
  if (subject.model.find_link(out.tool) < 0) {
    std::vector<std::string> links;
    for (const ModelLink& link : subject.model.links) links.push_back(link.name);
    throw InputError("verify.tool", {},
                     fmt::format("the robot has no link '{}'{}", out.tool, did_you_mean(out.tool, links)),
                     "name a link of the robot with --tool; `doppel tree` prints them");
  }
  std::vector<MotionKind> motions = options.motions;
  if (motions.empty()) motions.assign(std::begin(kMotions), std::end(kMotions));
  for (const MotionKind kind : motions) out.motions.push_back(judge(subject, kind, options, out.tool));
  return out;
}

}  // namespace doppel
