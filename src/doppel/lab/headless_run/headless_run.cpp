#include "doppel/lab/headless_run/headless_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/base/core/parallel_work.h"
#include "doppel/base/core/thrown.h"
#include "doppel/twin/loop/rest_check.h"

namespace doppel {
namespace {

constexpr double kFarOff = 0.05, kSlideFarOff = 0.005;  // rad, m: from the target, at the effort limit

class Findings {
 public:
  explicit Findings(Twin& twin) : twin_(twin) {}

  std::vector<RunFinding> collect(bool diverged, bool at_rest) {
    if (diverged) {
      add_divergence();
      return std::move(found_);
    }
    for (const auto& robot : twin_.robots()) {
      if (at_rest) add_unrest(*robot);
      for (const OscillationReport& oscillation : robot->oscillations())
        add("run.oscillation", *robot, oscillation.joint, oscillation.message);
    }
    return std::move(found_);
  }

 private:
  void add(const char* rule, const TwinRobot& robot, const std::string& joint, std::string message) {
    const Joint* const source = robot.description().find_joint(joint);
    const SourceLocation& where = source != nullptr ? source->source : robot.description().source;
    found_.push_back(
        {rule, robot.description().name, source != nullptr ? joint : "", std::move(message), where});
  }

  void add_divergence() {
    std::string message =
        fmt::format("the simulation diverges {:.3f} s after the start", to_seconds(twin_.now()));
    if (twin_.robots().empty()) {
      found_.push_back({"run.diverged", "", "", std::move(message), {}});
    } else {
      add("run.diverged", twin_.robot(), "", std::move(message));
    }
  }

  void add_unrest(const TwinRobot& robot) {
    const std::size_t before = found_.size();
    for (UnsettledJoint& unsettled : find_unsettled_joints(robot.description(), robot.instance())) {
      unsettled.where = {};  // the finding has it
      const auto index = static_cast<std::size_t>(robot.model().find_joint(unsettled.joint));
      const bool slides = robot.model().joints[index].type == JointType::prismatic;
      add("run.unrest", robot, unsettled.joint, to_string(unsettled, slides));
    }
    if (found_.size() == before) add_weak(robot);
  }

  // Joints whose drives cannot hold them, although they may be at rest now.
  void add_weak(const TwinRobot& robot) {
    const Instance& instance = robot.instance();
    for (std::size_t j = 0; j < robot.model().joints.size(); ++j) {
      const ModelJoint& joint = robot.model().joints[j];
      const int index = static_cast<int>(j);
      if (!joint.scalar() || instance.drive(index) != DriveMode::position) continue;
      const bool slides = joint.type == JointType::prismatic;
      const double off = instance.drive_target(index) - instance.q()[static_cast<std::size_t>(joint.q)];
      const double limit = instance.made_of().servos[j].effort;
      if (std::abs(off) < (slides ? kSlideFarOff : kFarOff)) continue;
      if (!at_effort_limit(instance, index)) continue;
      add("run.unrest", robot, joint.name,
          fmt::format("joint '{}' is {:.3g} {} from its held position: its effort limit of {:.3g} {} is too "
                      "low for the load",
                      joint.name, std::abs(off), slides ? "m" : "rad", limit, slides ? "N" : "N m"));
    }
  }

  Twin& twin_;
  std::vector<RunFinding> found_;
};

StepLimits limits_of(const HeadlessOptions& options, Twin& twin) {
  StepLimits limits;
  if (options.duration) limits.steps = steps_in(*options.duration, twin.step_size());
  if (options.until) limits.until = [&] { return options.until(twin); };
  limits.cancel = options.cancel;
  return limits;
}

// Called in a catch clause.
std::vector<Diagnostic> errors_thrown() {
  try {
    throw;
  } catch (const InputError& error) {
    return error.diagnostics();
  } catch (...) {
    return {{Severity::error, "run.failed", thrown_text(), {}, ""}};
  }
}

}  // namespace

void RunResult::throw_if_failed() const {
  if (end == RunEnd::failed) throw InputError(errors);
}

RunResult run_headless(Twin& twin, const HeadlessOptions& options) {
  RunResult result;
  const Time begin = twin.now();
  const std::uint64_t before = twin.steps();
  const auto step = [&twin] {
    twin.between_steps();
    twin.step();
  };
  const auto observe = [&] {
    for (const auto& observer : options.observers) observer(twin);
  };
  try {
    result.end = run_steps({step, [&twin] { return twin.diverged(); }}, limits_of(options, twin), observe);
    twin.between_steps();
    result.findings = Findings(twin).collect(result.end == RunEnd::diverged, options.at_rest);
  } catch (...) {
    result.end = RunEnd::failed;
    result.errors = errors_thrown();
  }
  result.simulated = twin.now() - begin;
  result.steps = twin.steps() - before;
  result.state_hash = twin.state_hash();
  return result;
}

RunResult run_headless(const HeadlessRun& run) {
  const Log quiet;
  RunResult result;
  Diagnostics diagnostics;
  try {
    Twin twin(run.scenario, quiet, diagnostics);
    result = run_headless(twin, run.options);
  } catch (...) {
    result.errors = errors_thrown();
  }
  result.diagnostics = std::move(diagnostics);
  return result;
}

std::vector<RunResult> run_headless(const std::vector<HeadlessRun>& runs, std::size_t threads) {
  std::vector<RunResult> results(runs.size());
  parallel_work(runs.size(), threads,
                [&] { return [&](std::size_t i) { results[i] = run_headless(runs[i]); }; });
  return results;
}

}  // namespace doppel
