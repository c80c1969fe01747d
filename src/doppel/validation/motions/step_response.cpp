#include "doppel/validation/motions/step_response.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "doppel/robot/kinematics/dynamics.h"
#include "doppel/validation/metrics/step_response.h"
#include "doppel/validation/motions/detail/free_space.h"
#include "doppel/validation/motions/detail/machine_run.h"
#include "doppel/validation/statics/start_pose.h"

namespace doppel {
namespace {

// A step that the speed limit alone makes slower than this is shrunk to kShrunkTime of it.
constexpr double kMaxLimitedTime = 0.4, kShrunkTime = 0.08;  // s
constexpr double kBefore = 0.1, kAfter = 1.5;                // s of the record before and after the step
constexpr double kSaturated = 0.999;                         // of the effort limit

struct Step {
  int joint = -1;  // of the twin's model
  std::string pose;
  bool payload = false;
  double start = 0, height = 0;  // rad or m
  bool shrunk = false;           // by the speed limit
};

struct Record {
  std::vector<double> time, position, effort;
  std::vector<double> others_low, others_high;  // [joints]
  bool diverged = false;
};

struct Outcome {
  Step step;
  StepFigures figures;
  double peak_effort = 0, saturated = 0;  // of the effort limit; share of the time until it is settled
  double coupling = 0;                    // largest motion of another joint, rad or m
  PlotPanel panel;
};

std::optional<JointWay> position_way(const MachineRun& machine, int joint) {
  for (const JointWay& way : machine.ways(joint)) {
    if (way.interface == "position" && way.kind != JointWay::Kind::trajectory_action) return way;
  }
  return std::nullopt;
}

// A joint whose motion the suite's size fits, upwards if there is room on a free way, else downwards.
std::optional<double> free_height(const Subject& subject, FreeSpace& space, const Eigen::VectorXd& q,
                                  const std::string& name, double size) {
  const int joint = subject.model->find_joint(name);
  const ModelJoint& about = subject.model->joints[static_cast<std::size_t>(joint)];
  const double start = q[about.q];
  for (const double share : {1.0, 0.5, 0.2}) {
    for (const double sign : {1.0, -1.0}) {
      const double target = start + sign * share * size;
      if (target > about.upper || target < about.lower) continue;
      if (space.is_way_free(q, joint, target)) return target - start;
    }
  }
  return std::nullopt;
}

// The free configuration in which the joint carries the most, and can make its step.
std::optional<Eigen::VectorXd> heaviest_pose(const Subject& subject, FreeSpace& space,
                                             const std::string& name, double size) {
  constexpr int kSamples = 256;
  const Model& model = *subject.model;
  const auto joint = static_cast<std::size_t>(model.find_joint(name));
  Data data(model);
  Eigen::VectorXd torques(static_cast<Eigen::Index>(model.joints.size()));
  std::vector<std::pair<double, Eigen::VectorXd>> poses;
  for (const Eigen::VectorXd& q : sample_configurations(model, kSamples)) {
    gravity_torques(model, data, q, subject.robot().gravity_R());
    drive_torques(model, data, torques);
    poses.emplace_back(std::abs(torques[static_cast<Eigen::Index>(joint)]), q);
  }
  std::ranges::stable_sort(poses, std::greater(), [](const auto& pose) { return pose.first; });
  for (const auto& [torque, q] : poses) {
    if (space.is_free(q) && free_height(subject, space, q, name, size)) return q;
  }
  return std::nullopt;
}

Record record_step(MachineRun& machine, const JointWay& way, const Step& step) {
  Record out;
  const double begin = to_seconds(machine.twin().now());
  const std::size_t joints = machine.model().joints.size();
  out.others_low.assign(joints, kInfinity);
  out.others_high.assign(joints, -kInfinity);
  const auto sample = [&] {
    out.time.push_back(to_seconds(machine.twin().now()) - begin - kBefore);
    out.position.push_back(machine.position(step.joint));
    out.effort.push_back(machine.effort(step.joint));
    for (std::size_t i = 0; i < joints; ++i) {
      if (!machine.joint(static_cast<int>(i)).scalar()) continue;
      const double q = machine.position(static_cast<int>(i));
      out.others_low[i] = std::min(out.others_low[i], q);
      out.others_high[i] = std::max(out.others_high[i], q);
    }
  };
  if (!machine.run(kBefore, sample)) out.diverged = true;
  machine.send(way, step.start + step.height);
  if (!out.diverged && !machine.run(kAfter, sample)) out.diverged = true;
  return out;
}

// The other joint that moves the most; mimics of this one move with it.
double coupling_of(const MachineRun& machine, const Record& record, int joint) {
  double out = 0;
  for (std::size_t i = 0; i < record.others_low.size(); ++i) {
    const ModelJoint& other = machine.joint(static_cast<int>(i));
    if (static_cast<int>(i) == joint || !other.scalar() || other.mimic_leader == joint) continue;
    out = std::max(out, record.others_high[i] - record.others_low[i]);
  }
  return out;
}

PlotPanel panel_of(const Step& step, const Record& record, const StepResponseLimits& limits, double error,
                   bool slides) {
  PlotPanel out;
  out.title = step.pose + (step.payload ? ", with payload" : "");
  out.unit = slides ? "m" : "rad";
  const double target = step.start + step.height;
  const double over = std::abs(step.height) * limits.overshoot, sign = step.height > 0 ? 1 : -1;
  out.curves.push_back({"position", record.time, record.position});
  out.curves.push_back({"command", {-kBefore, 0, 0, kAfter}, {step.start, step.start, target, target}});
  const double far = target + sign * over;
  out.bands.push_back(
      {"overshoot", std::min(step.start, far), std::max(step.start, far), 0, limits.settling});
  out.bands.push_back({"error", target - error, target + error, kAfter - 0.2, kAfter});
  return out;
}

double error_limit(const StepResponseLimits& limits, bool slides) {
  return slides ? limits.slide_error : limits.error;
}

// The reason of a step that misses a limit, by what the drive did.
std::string cause_of(const MachineRun& machine, const Outcome& outcome) {
  const ModelJoint& joint = machine.joint(outcome.step.joint);
  if (outcome.saturated > 0.05)
    return fmt::format("the effort limit of {:.3g} {} is reached during {:.0f} % of the motion", joint.effort,
                       machine.slides(outcome.step.joint) ? "N" : "N m", 100 * outcome.saturated);
  if (outcome.figures.error > 0 && !outcome.figures.reached) return "the joint does not get there";
  return "the servo or the controller's gains";
}

class StepJudge {
 public:
  StepJudge(const CheckContext& context, CheckResult& out)
      : context_(context), space_(context.subject), out_(out) {}

  void run() {
    const bool has_payload = context_.suite.tool.mass > 0;
    for (const bool payload : {false, true}) {
      if (payload && !has_payload) continue;
      MachineOptions options;
      options.payload = payload;
      MachineRun machine(context_, options);
      const std::shared_ptr<const SavedState> start = machine.save();
      for (std::size_t i = 0; i < machine.joints().size(); ++i) {
        judge_joint(machine, *start, machine.joints()[i], payload);
        context_.report(
            (static_cast<double>(i + 1) / static_cast<double>(machine.joints().size()) + (payload ? 1 : 0)) /
            (has_payload ? 2 : 1));
      }
    }
    finish();
  }

 private:
  void judge_joint(MachineRun& machine, const SavedState& start, int joint, bool payload) {
    const std::string& name = machine.joint(joint).name;
    const auto way = position_way(machine, joint);
    if (!way) {
      if (!payload)
        out_.notes.push_back(fmt::format("{} has no position command, so that it makes no step", name));
      return;
    }
    const bool slides = machine.slides(joint);
    const StepResponseLimits& limits = context_.suite.step_of(name);
    const double size = slides ? limits.slide_size : limits.size;
    judge_pose(machine, start, joint, *way, "start pose", start_configuration(context_.subject), size,
               payload);
    const bool can_be_placed = context_.subject.robot().base() == BaseKind::fixed;
    if (const auto heavy = can_be_placed ? heaviest_pose(context_.subject, space_, name, size) : std::nullopt)
      judge_pose(machine, start, joint, *way, "heaviest pose", *heavy, size, payload);
  }

  void judge_pose(MachineRun& machine, const SavedState& start, int joint, const JointWay& way,
                  const std::string& pose, const Eigen::VectorXd& q, double size, bool payload) {
    const std::string& name = machine.joint(joint).name;
    machine.restore(start);
    if (pose != "start pose") {
      if (const Status placed = machine.place(posed_joints(*context_.subject.model, q)); !placed) {
        out_.notes.push_back(fmt::format("{}: the {} cannot be taken: {}", name, pose, placed.why()));
        return;
      }
      machine.run(0.3);  // until it rests under its load
    }
    const auto height = free_height(context_.subject, space_, q, name, size);
    if (!height) {
      out_.add({name, Verdict::not_judged, fmt::format("there is no room for a step at the {}", pose)});
      return;
    }
    Step step{joint, pose, payload, machine.position(joint), *height, false};
    const double limit = machine.joint(joint).velocity;
    if (std::isfinite(limit) && std::abs(step.height) / limit > kMaxLimitedTime) {
      note_speed(machine, step, limit);
      step.height = std::copysign(kShrunkTime * limit, step.height);
      step.shrunk = true;
    }
    judge_step(machine, way, step);
  }

  void note_speed(const MachineRun& machine, const Step& step, double limit) {
    const std::string& name = machine.joint(step.joint).name;
    if (std::ranges::find(slow_, name) != slow_.end()) return;
    slow_.push_back(name);
    const bool slides = machine.slides(step.joint);
    out_.notes.push_back(
        fmt::format("{}: {} take {:.2g} s by the speed limit of {} alone; a step of {} is judged instead",
                    name, position_text(std::abs(step.height), slides), std::abs(step.height) / limit,
                    speed_text(limit, slides), position_text(kShrunkTime * limit, slides)));
  }

  void judge_step(MachineRun& machine, const JointWay& way, const Step& step) {
    const std::string& name = machine.joint(step.joint).name;
    const Record record = record_step(machine, way, step);
    if (record.diverged) {
      out_.fail(name,
                fmt::format("the physics diverges after {:.3f} s of a step at the {}", record.time.back(),
                            step.pose),
                "smaller gains, or a smaller step of the physics");
      return;
    }
    const auto figures = step_figures(record.time, record.position, step.start + step.height);
    if (!figures) return;
    Outcome outcome{step, *figures, 0, 0, coupling_of(machine, record, step.joint), {}};
    measure_effort(machine, record, outcome);
    const bool slides = machine.slides(step.joint);
    const StepResponseLimits& limits = context_.suite.step_of(name);
    outcome.panel = panel_of(step, record, limits, error_limit(limits, slides), slides);
    add_metrics(machine, outcome);
    judge(machine, outcome);
  }

  static void measure_effort(const MachineRun& machine, const Record& record, Outcome& outcome) {
    const double limit = machine.joint(outcome.step.joint).effort;
    if (!std::isfinite(limit) || limit <= 0) return;
    std::size_t moving = 0, saturated = 0;
    const double end = std::max(outcome.figures.settling, 0.05);
    for (std::size_t i = 0; i < record.time.size(); ++i) {
      const double share = std::abs(record.effort[i]) / limit;
      outcome.peak_effort = std::max(outcome.peak_effort, share);
      if (record.time[i] < 0 || record.time[i] > end) continue;
      ++moving;
      saturated += share > kSaturated ? 1 : 0;
    }
    outcome.saturated = moving == 0 ? 0 : static_cast<double>(saturated) / static_cast<double>(moving);
  }

  [[nodiscard]] static std::string subject_of(const MachineRun& machine, const Step& step) {
    return fmt::format("{}, {}{}", machine.joint(step.joint).name, step.pose,
                       step.payload ? ", with payload" : "");
  }

  void add_metrics(const MachineRun& machine, const Outcome& outcome) {
    const bool slides = machine.slides(outcome.step.joint);
    const std::string subject = subject_of(machine, outcome.step);
    const StepResponseLimits& limits = context_.suite.step_of(machine.joint(outcome.step.joint).name);
    const char* const unit = slides ? "m" : "rad";
    out_.metrics.push_back(
        {"overshoot", subject, 100 * outcome.figures.overshoot, "%", 100 * limits.overshoot});
    out_.metrics.push_back({"settling", subject, outcome.figures.settling, "s", limits.settling});
    out_.metrics.push_back({"error", subject, outcome.figures.error, unit, error_limit(limits, slides)});
    out_.metrics.push_back({"rise", subject, outcome.figures.rise, "s"});
    out_.metrics.push_back({"peak effort", subject, 100 * outcome.peak_effort, "%"});
    out_.metrics.push_back({"coupling", subject, outcome.coupling, unit});
  }

  void judge(const MachineRun& machine, Outcome& outcome) {
    const bool slides = machine.slides(outcome.step.joint);
    const StepFigures& figures = outcome.figures;
    const StepResponseLimits& limits = context_.suite.step_of(machine.joint(outcome.step.joint).name);
    const double error = error_limit(limits, slides);
    std::vector<std::string> misses;
    if (!figures.reached)
      misses.push_back(fmt::format("it gets to {} of {}", position_text(figures.final_position, slides),
                                   position_text(outcome.step.start + outcome.step.height, slides)));
    if (figures.overshoot > limits.overshoot)
      misses.push_back(fmt::format("overshoot {:.1f} % (limit {:.3g} %)", 100 * figures.overshoot,
                                   100 * limits.overshoot));
    if (figures.settling > limits.settling || !figures.settled)
      misses.push_back(fmt::format("settling {:.3f} s (limit {:.3g} s)", figures.settling, limits.settling));
    if (figures.error > error)
      misses.push_back(fmt::format("error {} (limit {})", position_text(figures.error, slides),
                                   position_text(error, slides)));
    settling_ = std::max(settling_, figures.settling);
    overshoot_ = std::max(overshoot_, figures.overshoot);
    CheckItem item;
    item.subject = subject_of(machine, outcome.step);
    item.message =
        fmt::format("step of {}: rise {:.3f} s, overshoot {:.1f} %, settling {:.3f} s, error {}",
                    position_text(outcome.step.height, slides), figures.rise, 100 * figures.overshoot,
                    figures.settling, position_text(figures.error, slides));
    item.curves.push_back(outcome.panel);
    if (!misses.empty()) {
      item.verdict = Verdict::failed;
      std::string text;
      for (const std::string& miss : misses) text += (text.empty() ? "" : ", ") + miss;
      item.message = text + ": " + cause_of(machine, outcome);
      item.fix = "doppel tune finds gains; a stiffer servo or another effort limit of the joint";
      item.poses.push_back({"at the step", machine.posed()});
      if (const Joint* const source =
              context_.subject.description().find_joint(machine.joint(outcome.step.joint).name))
        item.where = source->source;
    }
    out_.add(std::move(item));
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
  }

  const CheckContext& context_;
  FreeSpace space_;
  CheckResult& out_;
  std::vector<std::string> slow_;
  double settling_ = 0, overshoot_ = 0;
};

}  // namespace

CheckResult check_step_response(const CheckContext& context) {
  CheckResult out = begin_result("T4");
  StepJudge(context, out).run();
  return out;
}

}  // namespace doppel
