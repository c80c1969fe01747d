#include "doppel/validation/tuning/detail/tuning_twin.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace doppel {
namespace {

GivenParameter given(const std::string& node, const std::string& name, ParameterValue value) {
  GivenParameter out;
  out.node = node;
  out.name = name;
  out.text = node + ":" + name;
  out.value = std::move(value);
  return out;
}

void count(const StepTrial& trial, const StepResponseLimits& limits, WorstStep& out) {
  out.judged = true;
  const std::string place = trial.place.pose + (trial.payload ? ", with payload" : "");
  if (trial.diverged > 0 || !trial.figures) {
    out.passed = false;
    out.use = 100;
    out.place = place;
    out.message = "the physics diverges";
    return;
  }
  const StepFigures& figures = *trial.figures;
  const double settling = figures.settled ? figures.settling : std::max(figures.settling, 1.5);
  double use = std::max({figures.overshoot / limits.overshoot, settling / limits.settling,
                         figures.error / error_limit(limits, trial.slides)});
  if (!figures.reached) use = std::max(use, 2.0);
  out.overshoot = std::max(out.overshoot, figures.overshoot);
  out.settling = std::max(out.settling, settling);
  out.error = std::max(out.error, figures.error);
  out.peak_effort = std::max(out.peak_effort, trial.peak_effort);
  const auto misses = trial.misses(limits);
  if (!misses.empty()) out.passed = false;
  if (use <= out.use) return;
  out.use = use;
  out.saturated = trial.saturated;
  out.place = place;
  out.message = misses.empty() ? "" : fmt::format("{}: {}", fmt::join(misses, ", "), trial.cause());
}

}  // namespace

Subject TuningTwin::variant(const Gains& gains, const Perturbation& perturbation) const {
  Subject out = subject_;
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const TunedJoint& joint = joints_[i];
    if (i < gains.size() && gains[i] && joint.gains_act) {
      const std::string prefix = "gains." + joint.joint + ".";
      const std::pair<const char*, double> values[] = {{"p", gains[i]->p},
                                                       {"i", gains[i]->i},
                                                       {"d", gains[i]->d},
                                                       {"i_clamp_max", gains[i]->clamp},
                                                       {"i_clamp_min", -gains[i]->clamp}};
      for (const auto& [name, value] : values)
        out.scenario.ros.parameters.emplace_back(given(joint.controller, prefix + name, value));
    }
  }
  out.scenario.factors = {perturbation.mass, perturbation.friction};
  // A controller that holds its command for a period is late by half of it, so that a slower one stands for
  // the transport.
  if (perturbation.delay == 1 && !(options_.transport > 0)) return out;
  for (const TunedJoint& joint : joints_) {
    if (!joint.gains_act || !(joint.period > 0)) continue;
    const double period = perturbation.delay * (joint.period + 2 * options_.transport);
    const auto rate = static_cast<std::int64_t>(std::max(1.0, std::round(1 / period)));
    out.scenario.ros.parameters.emplace_back(given("controller_manager", "update_rate", rate));
    break;
  }
  return out;
}

std::vector<StepTrial> TuningTwin::run(const Gains& gains, const std::vector<StepPlace>& places,
                                       const Perturbation& perturbation, std::optional<bool> payload) const {
  const Subject changed = variant(gains, perturbation);
  CheckContext context{changed, suite_};
  context.progress = [this](double) { return !options_.progress || options_.progress(-1, ""); };
  std::vector<StepTrial> out;
  for (const bool loaded : {false, true}) {
    if (payload && *payload != loaded) continue;
    if (loaded && !(suite_.tool.mass > 0)) continue;
    MachineOptions options;
    options.payload = loaded;
    MachineRun machine(context, options);
    auto trials = run_steps(context, machine, loaded, places, [&](std::size_t) { context.report(0); });
    std::ranges::move(trials, std::back_inserter(out));
  }
  return out;
}

WorstStep worst_step(const std::vector<StepTrial>& trials, const std::string& joint, const Suite& suite) {
  WorstStep out;
  out.passed = true;
  for (const StepTrial& trial : trials) {
    if (trial.place.joint != joint || !trial.commanded || !trial.refusal.empty() || trial.height == 0)
      continue;
    count(trial, suite.step_of(joint), out);
  }
  out.passed = out.passed && out.judged;
  return out;
}

}  // namespace doppel
