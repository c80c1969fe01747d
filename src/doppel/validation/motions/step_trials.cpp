#include "doppel/validation/motions/step_trials.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "doppel/robot/kinematics/dynamics.h"
#include "doppel/validation/motions/detail/free_space.h"
#include "doppel/validation/statics/start_pose.h"

namespace doppel {
namespace {

// A step that the speed limit alone makes slower than this is shrunk to kShrunkTime of it.
constexpr double kMaxLimitedTime = 0.4, kShrunkTime = 0.08;  // s
constexpr double kBefore = 0.1, kAfter = 1.5;                // s of the record before and after the step
constexpr double kSaturated = 0.999;                         // of the effort limit
constexpr int kSamples = 256;                                // configurations among which poses are chosen

struct Record {
  std::vector<double> time, position, effort;
  std::vector<double> others_low, others_high;  // [joints]
  bool diverged = false;
};

// How a joint is commanded to a position: every trajectory controller takes positions, whatever it commands.
struct PositionWay {
  JointWay way;
  bool closes_loop = false;  // the controller's gains hold the joint, not the servo
};

std::optional<PositionWay> position_way(const MachineRun& machine, int joint) {
  for (JointWay way : machine.ways(joint)) {
    const bool is_trajectory = way.kind == JointWay::Kind::trajectory;
    if (way.kind == JointWay::Kind::trajectory_action || (!is_trajectory && way.interface != "position"))
      continue;
    const bool closes_loop = way.interface != "position";
    way.interface = "position";
    return PositionWay{way, closes_loop};
  }
  if (const auto way = machine.reference_way(joint)) return PositionWay{*way, true};
  return std::nullopt;
}

// The height of a step that fits, upwards if there is room on a free way, else downwards.
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

// Chooses configurations of a machine for the steps of its joints.
class PlaceFinder {
 public:
  explicit PlaceFinder(const Subject& subject)
      : subject_(subject),
        model_(*subject.model),
        space_(subject),
        samples_(sample_configurations(model_, kSamples)) {}

  StepPlace start(const std::string& joint, double size) {
    StepPlace out{joint, "start pose", {}, 0};
    out.height = free_height(subject_, space_, start_configuration(subject_), joint, size).value_or(0);
    return out;
  }

  // The free configuration in which the joint carries the most, and can make its step.
  std::optional<StepPlace> heaviest(const std::string& joint, double size) {
    const auto index = static_cast<Eigen::Index>(model_.find_joint(joint));
    Data data(model_);
    Eigen::VectorXd torques(static_cast<Eigen::Index>(model_.joints.size()));
    return best(joint, "heaviest pose", size, [&](const Eigen::VectorXd& q) {
      gravity_torques(model_, data, q, subject_.robot().gravity_R());
      drive_torques(model_, data, torques);
      return std::abs(torques[index]);
    });
  }

  // With `sign` 1 the configuration in which the tool is farthest from the arm's base, with -1 nearest.
  std::optional<StepPlace> reaching(const std::string& joint, double size, double sign) {
    if (subject_.arms.empty()) return std::nullopt;
    const Chain& chain = subject_.arms.front().chain;
    Data data(model_);
    return best(joint, sign > 0 ? "stretched pose" : "folded pose", size, [&](const Eigen::VectorXd& q) {
      forward_kinematics(model_, data, q);
      return sign * (data.X_WL[static_cast<std::size_t>(chain.tip_link)].translation() -
                     data.X_WL[static_cast<std::size_t>(chain.base_link)].translation())
                        .norm();
    });
  }

 private:
  std::optional<StepPlace> best(const std::string& joint, const char* pose, double size,
                                const std::function<double(const Eigen::VectorXd&)>& measure) {
    std::vector<std::pair<double, const Eigen::VectorXd*>> order;
    for (const Eigen::VectorXd& q : samples_) order.emplace_back(measure(q), &q);
    std::ranges::stable_sort(order, std::greater(), [](const auto& one) { return one.first; });
    for (const auto& [value, q] : order) {
      if (!space_.is_free(*q)) continue;
      if (const auto height = free_height(subject_, space_, *q, joint, size))
        return StepPlace{joint, pose, *q, *height};
    }
    return std::nullopt;
  }

  const Subject& subject_;
  const Model& model_;
  FreeSpace space_;
  std::vector<Eigen::VectorXd> samples_;
};

Record record_step(MachineRun& machine, const JointWay& way, int joint, double target) {
  Record out;
  const double begin = to_seconds(machine.twin().now());
  const std::size_t joints = machine.model().joints.size();
  out.others_low.assign(joints, kInfinity);
  out.others_high.assign(joints, -kInfinity);
  const auto sample = [&] {
    out.time.push_back(to_seconds(machine.twin().now()) - begin - kBefore);
    out.position.push_back(machine.position(joint));
    out.effort.push_back(machine.effort(joint));
    for (std::size_t i = 0; i < joints; ++i) {
      if (!machine.joint(static_cast<int>(i)).scalar()) continue;
      const double q = machine.position(static_cast<int>(i));
      out.others_low[i] = std::min(out.others_low[i], q);
      out.others_high[i] = std::max(out.others_high[i], q);
    }
  };
  if (!machine.run(kBefore, sample)) out.diverged = true;
  machine.send(way, target);
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

PlotPanel panel_of(const StepTrial& trial, const Record& record, const StepResponseLimits& limits) {
  PlotPanel out;
  out.title = trial.place.pose + (trial.payload ? ", with payload" : "");
  out.unit = trial.slides ? "m" : "rad";
  const double target = trial.start + trial.height, error = error_limit(limits, trial.slides);
  const double over = std::abs(trial.height) * limits.overshoot, sign = trial.height > 0 ? 1 : -1;
  out.curves.push_back({"position", record.time, record.position});
  out.curves.push_back({"command", {-kBefore, 0, 0, kAfter}, {trial.start, trial.start, target, target}});
  const double far = target + sign * over;
  out.bands.push_back(
      {"overshoot", std::min(trial.start, far), std::max(trial.start, far), 0, limits.settling});
  out.bands.push_back({"error", target - error, target + error, kAfter - 0.2, kAfter});
  return out;
}

void measure_effort(const Record& record, StepTrial& trial) {
  if (!std::isfinite(trial.effort) || trial.effort <= 0 || !trial.figures) return;
  std::size_t moving = 0, saturated = 0;
  const double end = std::max(trial.figures->settling, 0.05);
  for (std::size_t i = 0; i < record.time.size(); ++i) {
    const double share = std::abs(record.effort[i]) / trial.effort;
    trial.peak_effort = std::max(trial.peak_effort, share);
    if (record.time[i] < 0 || record.time[i] > end) continue;
    ++moving;
    saturated += share > kSaturated ? 1 : 0;
  }
  trial.saturated = moving == 0 ? 0 : static_cast<double>(saturated) / static_cast<double>(moving);
}

// Runs until the machine rests under its load. The integral of a controller takes seconds for that.
void settle(MachineRun& machine, bool closes_loop) {
  constexpr int kMaxWaits = 40;
  constexpr double kResting = 1e-3;  // rad/s or m/s
  machine.run(0.3);
  if (!closes_loop) return;
  for (int i = 0; i < kMaxWaits; ++i) {
    double fastest = 0;
    const bool runs = machine.run(0.1, [&] {
      for (const int joint : machine.joints()) fastest = std::max(fastest, std::abs(machine.speed(joint)));
    });
    if (!runs || fastest < kResting) return;
  }
}

void make_step(MachineRun& machine, const JointWay& way, int joint, const StepResponseLimits& limits,
               StepTrial& trial) {
  trial.start = machine.position(joint);
  trial.height = trial.place.height;
  if (std::isfinite(trial.speed) && std::abs(trial.height) / trial.speed > kMaxLimitedTime) {
    trial.limited_time = std::abs(trial.height) / trial.speed;
    trial.height = std::copysign(kShrunkTime * trial.speed, trial.height);
  }
  // A servo that gives way under its load is held at another position than it has. It steps by the height
  // from there, and what it gives way is an error, and neither overshoot nor missing height.
  const double command = trial.height + (machine.drive(joint) == DriveMode::position
                                             ? machine.twin().robot().instance().drive_target(joint)
                                             : trial.start);
  const Record record = record_step(machine, way, joint, command);
  trial.posed = machine.posed();
  if (record.diverged) {
    trial.diverged = record.time.empty() ? 1e-9 : std::max(1e-9, record.time.back());
    return;
  }
  trial.figures = step_figures(record.time, record.position, trial.start + trial.height);
  if (trial.figures) {
    StepFigures& figures = *trial.figures;
    const double sign = trial.height > 0 ? 1 : -1;
    figures.error = std::abs(command - figures.final_position);
    figures.overshoot =
        std::min(figures.overshoot,
                 std::max(0.0, sign * (figures.peak - figures.final_position)) / std::abs(trial.height));
  }
  trial.coupling = coupling_of(machine, record, joint);
  measure_effort(record, trial);
  trial.panel = panel_of(trial, record, limits);
}

StepTrial run_step(const CheckContext& context, MachineRun& machine, const SavedState& start,
                   const StepPlace& place, bool payload) {
  StepTrial out;
  out.place = place;
  out.payload = payload;
  const int joint = machine.model().find_joint(place.joint);
  out.slides = machine.slides(joint);
  out.effort = machine.joint(joint).effort;
  out.speed = machine.joint(joint).velocity;
  const auto way = position_way(machine, joint);
  out.commanded = way.has_value();
  if (!way || place.height == 0) return out;
  machine.restore(start);
  if (place.q) {
    if (const Status placed = machine.place(posed_joints(*context.subject.model, *place.q)); !placed) {
      out.refusal = placed.why();
      return out;
    }
  }
  // A controller without a reference commands nothing.
  if (way->way.kind == JointWay::Kind::reference) machine.send(way->way, machine.position(joint));
  if (place.q || way->closes_loop) settle(machine, way->closes_loop);
  make_step(machine, way->way, joint, context.suite.step_of(place.joint), out);
  return out;
}

}  // namespace

std::vector<StepPlace> step_places(const CheckContext& context, StepPoses poses) {
  const Subject& subject = context.subject;
  PlaceFinder finder(subject);
  std::vector<StepPlace> out;
  const bool can_be_placed = subject.robot().base() == BaseKind::fixed;
  for (const std::string& joint : subject.model->driven_joint_names()) {
    if (!context.joint.empty() && context.joint != joint) continue;
    const auto index = static_cast<std::size_t>(subject.model->find_joint(joint));
    const bool slides = subject.model->joints[index].type == JointType::prismatic;
    const StepResponseLimits& limits = context.suite.step_of(joint);
    const double size = slides ? limits.slide_size : limits.size;
    out.push_back(finder.start(joint, size));
    if (!can_be_placed) continue;
    const auto add = [&out](std::optional<StepPlace> place) {
      if (place) out.push_back(*std::move(place));
    };
    add(finder.heaviest(joint, size));
    if (poses != StepPoses::all) continue;
    add(finder.reaching(joint, size, 1));
    add(finder.reaching(joint, size, -1));
  }
  return out;
}

std::vector<StepTrial> run_steps(const CheckContext& context, MachineRun& machine, bool payload,
                                 const std::vector<StepPlace>& places,
                                 const std::function<void(std::size_t)>& report) {
  const std::shared_ptr<const SavedState> start = machine.save();
  std::vector<StepTrial> out;
  for (const StepPlace& place : places) {
    out.push_back(run_step(context, machine, *start, place, payload));
    if (report) report(out.size());
  }
  return out;
}

std::string StepTrial::subject() const {
  return fmt::format("{}, {}{}", place.joint, place.pose, payload ? ", with payload" : "");
}

std::vector<std::string> StepTrial::misses(const StepResponseLimits& limits) const {
  std::vector<std::string> out;
  if (!figures) return out;
  const double error = error_limit(limits, slides);
  if (!figures->reached)
    out.push_back(fmt::format("it gets to {} of {}", position_text(figures->final_position, slides),
                              position_text(start + height, slides)));
  if (figures->overshoot > limits.overshoot)
    out.push_back(
        fmt::format("overshoot {:.1f} % (limit {:.3g} %)", 100 * figures->overshoot, 100 * limits.overshoot));
  if (figures->settling > limits.settling || !figures->settled)
    out.push_back(fmt::format("settling {:.3f} s (limit {:.3g} s)", figures->settling, limits.settling));
  if (figures->error > error)
    out.push_back(fmt::format("error {} (limit {})", position_text(figures->error, slides),
                              position_text(error, slides)));
  return out;
}

std::string StepTrial::cause() const {
  if (saturated > 0.05)
    return fmt::format("the effort limit of {:.3g} {} is reached during {:.0f} % of the motion", effort,
                       slides ? "N" : "N m", 100 * saturated);
  if (figures && figures->error > 0 && !figures->reached) return "the joint does not get there";
  return "the servo or the controller's gains";
}

}  // namespace doppel
