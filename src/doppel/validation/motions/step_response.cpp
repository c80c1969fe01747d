#include "doppel/validation/motions/step_response.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "doppel/validation/motions/detail/failure_recorder.h"
#include "doppel/validation/motions/step_trials.h"

namespace doppel {
namespace {

class StepJudge {
 public:
  StepJudge(const CheckContext& context, CheckResult& out)
      : context_(context), out_(out), recorder_(context, out) {}

  void run() {
    const std::vector<StepPlace> places = step_places(context_, StepPoses::standard);
    const bool has_payload = context_.suite.tool.mass > 0;
    for (const bool payload : {false, true}) {
      if (payload && !has_payload) continue;
      MachineOptions options;
      options.payload = payload;
      MachineRun machine(context_, options);
      const std::shared_ptr<const SavedState> start = machine.save();
      const auto report = [&](std::size_t done) {
        const double share = static_cast<double>(done) / static_cast<double>(places.size());
        context_.report((share + (payload ? 1 : 0)) / (has_payload ? 2 : 1));
      };
      for (const StepTrial& trial : run_steps(context_, machine, payload, places, report)) {
        judge(trial);
        record(trial, machine, *start);
      }
    }
    finish();
  }

 private:
  // The step again, from the state from which all have started.
  void record(const StepTrial& trial, MachineRun& machine, const SavedState& start) {
    if (out_.items.empty() || out_.items.back().verdict != Verdict::failed) return;
    recorder_.record(out_.items.back(), trial.place.joint, machine, [&] {
      machine.restore(start);
      run_steps(context_, machine, trial.payload, {trial.place});
    });
  }

  void judge(const StepTrial& trial) {
    const std::string& name = trial.place.joint;
    if (!trial.commanded) {
      if (!trial.payload && trial.place.pose == "start pose")
        out_.notes.push_back(fmt::format("{} has no position command, so that it makes no step", name));
    } else if (trial.place.height == 0) {
      out_.add({name, Verdict::not_judged,
                fmt::format("there is no room for a step at the {}", trial.place.pose)});
    } else if (!trial.refusal.empty()) {
      out_.notes.push_back(
          fmt::format("{}: the {} cannot be taken: {}", name, trial.place.pose, trial.refusal));
    } else {
      if (trial.limited_time > 0) note_speed(trial);
      judge_figures(trial);
    }
  }

  void note_speed(const StepTrial& trial) {
    const std::string& name = trial.place.joint;
    if (std::ranges::find(slow_, name) != slow_.end()) return;
    slow_.push_back(name);
    out_.notes.push_back(fmt::format(
        "{}: {} take {:.2g} s by the speed limit of {} alone; a step of {} is judged instead", name,
        position_text(std::abs(trial.place.height), trial.slides), trial.limited_time,
        speed_text(trial.speed, trial.slides), position_text(std::abs(trial.height), trial.slides)));
  }

  void judge_figures(const StepTrial& trial) {
    if (trial.diverged > 0) {
      out_.fail(trial.place.joint,
                fmt::format("the physics diverges after {:.3f} s of a step at the {}", trial.diverged,
                            trial.place.pose),
                "smaller gains, or a smaller step of the physics");
      return;
    }
    if (!trial.figures) return;
    const StepFigures& figures = *trial.figures;
    add_metrics(trial, figures);
    settling_ = std::max(settling_, figures.settling);
    overshoot_ = std::max(overshoot_, figures.overshoot);
    const double limit = error_limit(context_.suite.step_of(trial.place.joint), trial.slides);
    if (figures.error / limit >= error_share_) {
      error_share_ = figures.error / limit;
      error_ = fmt::format("{} (limit {})", position_text(figures.error, trial.slides),
                           position_text(limit, trial.slides));
    }
    CheckItem item;
    item.subject = trial.subject();
    item.message =
        fmt::format("step of {}: rise {:.3f} s, overshoot {:.1f} %, settling {:.3f} s, error {}",
                    position_text(trial.height, trial.slides), figures.rise, 100 * figures.overshoot,
                    figures.settling, position_text(figures.error, trial.slides));
    item.curves.push_back(trial.panel);
    const auto misses = trial.misses(context_.suite.step_of(trial.place.joint));
    if (!misses.empty()) {
      item.verdict = Verdict::failed;
      item.message = fmt::format("{}: {}", fmt::join(misses, ", "), trial.cause());
      if (trial.limited_time > 0)
        item.message +=
            fmt::format(" (the whole step would take {:.2g} s by the speed limit alone)", trial.limited_time);
      item.fix = "doppel tune finds gains; a stiffer servo or another effort limit of the joint";
      item.poses.push_back({"at the step", trial.posed});
      if (const Joint* const source = context_.subject.description().find_joint(trial.place.joint))
        item.where = source->source;
    }
    out_.add(std::move(item));
  }

  void add_metrics(const StepTrial& trial, const StepFigures& figures) {
    const std::string subject = trial.subject();
    const StepResponseLimits& limits = context_.suite.step_of(trial.place.joint);
    const char* const unit = trial.slides ? "m" : "rad";
    out_.metrics.push_back({"overshoot", subject, 100 * figures.overshoot, "%", 100 * limits.overshoot});
    out_.metrics.push_back({"settling", subject, figures.settling, "s", limits.settling});
    out_.metrics.push_back({"error", subject, figures.error, unit, error_limit(limits, trial.slides)});
    out_.metrics.push_back({"rise", subject, figures.rise, "s"});
    out_.metrics.push_back({"peak effort", subject, 100 * trial.peak_effort, "%"});
    out_.metrics.push_back({"coupling", subject, trial.coupling, unit});
  }

  void finish() {
    const bool any = !out_.metrics.empty();
    if (!any && out_.items.empty()) {
      out_.verdict = Verdict::not_applicable;
      out_.summary = "no joint has a position command";
      return;
    }
    const StepResponseLimits& limits = context_.suite.step;
    out_.summary =
        fmt::format("settling at most {:.3f} s (limit {:.3g} s), overshoot {:.1f} % (limit {:.3g} %)",
                    settling_, limits.settling, 100 * overshoot_, 100 * limits.overshoot);
    if (!error_.empty()) out_.summary += ", error " + error_;
  }

  const CheckContext& context_;
  CheckResult& out_;
  FailureRecorder recorder_;
  std::vector<std::string> slow_;
  double settling_ = 0, overshoot_ = 0, error_share_ = 0;
  std::string error_;  // the largest, of its limit
};

}  // namespace

CheckResult check_step_response(const CheckContext& context) {
  CheckResult out = begin_result("T4");
  StepJudge(context, out).run();
  return out;
}

}  // namespace doppel
