#include "doppel/validation/motions/limit_enforcement.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "doppel/robot/kinematics/dynamics.h"
#include "doppel/validation/motions/detail/free_space.h"
#include "doppel/validation/motions/machine_run.h"
#include "doppel/validation/statics/start_pose.h"

namespace doppel {
namespace {

constexpr double kBeyond = 0.5, kSlideBeyond = 0.1;            // rad, m: beyond a limit
constexpr double kPositionRoom = 2e-3, kSlideRoom = 2e-4;      // rad, m: that are no violation
constexpr double kSpeedRoom = 1.02, kEffortRoom = 1.001;       // of the limits
constexpr double kOverTravel = 9e-3, kSlideOverTravel = 9e-4;  // rad, m: of a fall onto the stops
constexpr double kNearLimit = 0.1, kSlideNearLimit = 0.01;     // rad, m: the start of a trial
// s; kWindow: over which a speed is a mean, because a servo that follows a command at the speed limit is
// faster for a moment.
constexpr double kTrial = 1.0, kFall = 3.0, kApproach = 0.5, kWindow = 0.2, kJumpRoom = 0.1;

enum class Trial { above, below, fast, effort, not_a_number, infinite, jump };
constexpr std::array<const char*, 7> kTrialNames = {"beyond the upper limit",
                                                    "beyond the lower limit",
                                                    "at twice the speed limit",
                                                    "twice the effort limit",
                                                    "NaN",
                                                    "infinity",
                                                    "a jump across the range"};

// The largest that a trial did to its joint.
struct Reaction {
  double beyond = 0;                                  // rad or m beyond a position limit
  double command_beyond = 0;                          // the same of the drive's target
  double speed = 0, momentary_speed = 0, effort = 0;  // of the limits
  bool finite = true, diverged = false, answered = false;
  double command = 0;  // the drive's target that is farthest beyond the limits
};

class TrialRun {
 public:
  TrialRun(MachineRun& machine, int joint) : machine_(machine), joint_(joint), about_(machine.joint(joint)) {}

  Reaction run(const JointWay& way, Trial trial) {
    send(way, trial);
    Reaction out;
    out.diverged = !machine_.run(kTrial, [&] { observe(out); });
    for (const LogLine& line : machine_.take_lines())
      out.answered = out.answered ||
                     (line.severity != Severity::note && line.text.find(about_.name) != std::string::npos) ||
                     line.text.find("limit") != std::string::npos ||
                     line.text.find("NaN") != std::string::npos ||
                     line.text.find("finite") != std::string::npos;
    return out;
  }

  // The same motion to the limit and no farther.
  Reaction legal(const JointWay& way, Trial trial) {
    machine_.send(way, end(trial), kApproach);
    Reaction out;
    out.diverged = !machine_.run(kTrial, [&] { observe(out); });
    return out;
  }

  // Whether the trial means something for this joint and way.
  [[nodiscard]] bool applies(const JointWay& way, Trial trial) const {
    const bool is_position = way.interface == "position";
    switch (trial) {
      case Trial::above:
        return is_position && std::isfinite(about_.upper);
      case Trial::below:
        return is_position && std::isfinite(about_.lower);
      case Trial::fast:
        return std::isfinite(about_.velocity) && (is_position || way.interface == "velocity");
      case Trial::effort:
        return std::isfinite(about_.effort) && way.interface == "effort";
      case Trial::jump:
        return is_position && std::isfinite(about_.lower) && std::isfinite(about_.upper);
      case Trial::not_a_number:
      case Trial::infinite:
        break;
    }
    return true;
  }

  // The position from which the trial begins.
  [[nodiscard]] double start(Trial trial) const {
    const double near = machine_.slides(joint_) ? kSlideNearLimit : kNearLimit;
    const double room =
        std::isfinite(about_.upper - about_.lower) ? 0.25 * (about_.upper - about_.lower) : near;
    if (trial == Trial::above) return about_.upper - std::min(near, room);
    if (trial == Trial::below || trial == Trial::jump) return about_.lower + std::min(near, room);
    const double middle = 0.5 * (about_.lower + about_.upper);
    return std::isfinite(middle) ? middle : 0.0;
  }

  // The farthest position of the joint in the trial, if limits are enforced.
  [[nodiscard]] double end(Trial trial) const {
    if (trial == Trial::above) return about_.upper;
    if (trial == Trial::below) return about_.lower;
    if (trial == Trial::jump) return about_.upper - kJumpRoom * (about_.upper - about_.lower);
    if (trial == Trial::fast && std::isfinite(about_.upper)) return 0.5 * (start(trial) + about_.upper);
    return start(trial);
  }

 private:
  void send(const JointWay& way, Trial trial) {
    const bool slides = machine_.slides(joint_);
    const double beyond = slides ? kSlideBeyond : kBeyond;
    const double present = machine_.position(joint_);
    switch (trial) {
      case Trial::above:
        return machine_.send(way, about_.upper + beyond, kApproach);
      case Trial::below:
        return machine_.send(way, about_.lower - beyond, kApproach);
      case Trial::fast: {
        if (way.interface == "velocity") return machine_.send(way, 2 * about_.velocity);
        const double room = std::isfinite(about_.upper) ? 0.5 * (about_.upper - present) : 1.0;
        return machine_.send(way, present + room, room / (2 * about_.velocity));
      }
      case Trial::effort:
        return machine_.send(way, 2 * about_.effort);
      case Trial::not_a_number:
        return machine_.send(way, std::numeric_limits<double>::quiet_NaN(), 0.1);
      case Trial::infinite:
        return machine_.send(way, std::numeric_limits<double>::infinity(), 0.1);
      case Trial::jump:
        return machine_.send(way, about_.upper - kJumpRoom * (about_.upper - about_.lower));
    }
  }

  void observe(Reaction& out) {
    const double q = machine_.position(joint_), v = machine_.speed(joint_), tau = machine_.effort(joint_);
    const DriveState drive = machine_.twin().robot().instance().drive_state(joint_);
    out.finite = out.finite && std::isfinite(q) && std::isfinite(drive.target);
    out.beyond = std::max({out.beyond, q - about_.upper, about_.lower - q});
    if (drive.mode == DriveMode::position) {
      const double target = std::max(drive.target - about_.upper, about_.lower - drive.target);
      if (target > out.command_beyond) out.command = drive.target;
      out.command_beyond = std::max(out.command_beyond, target);
    }
    if (std::isfinite(about_.velocity) && about_.velocity > 0) {
      out.momentary_speed = std::max(out.momentary_speed, std::abs(v) / about_.velocity);
      const auto steps = static_cast<std::size_t>(kWindow / to_seconds(machine_.twin().step_size()));
      past_.push_back(q);
      if (past_.size() > steps)
        out.speed =
            std::max(out.speed, std::abs(q - past_[past_.size() - 1 - steps]) / kWindow / about_.velocity);
    }
    if (std::isfinite(about_.effort) && about_.effort > 0)
      out.effort = std::max(out.effort, std::abs(tau) / about_.effort);
  }

  MachineRun& machine_;
  int joint_;
  const ModelJoint& about_;
  std::vector<double> past_;  // positions
};

struct Placement {
  bool is_free = false;
  std::vector<std::pair<std::string, double>> positions;
};

class LimitJudge {
 public:
  LimitJudge(const CheckContext& context, CheckResult& out)
      : context_(context), space_(context.subject), out_(out) {}

  void run() {
    run_commands();
    run_fall();
    finish();
  }

 private:
  void run_commands() {
    MachineRun machine(context_, {.enforce_limits = context_.subject.scenario.enforce_limits});
    MachineRun trusting(context_, {.enforce_limits = false});  // as ros2_control by its defaults
    const std::shared_ptr<const SavedState> start = machine.save(), trusting_start = trusting.save();
    const std::vector<int>& joints = machine.joints();
    for (std::size_t i = 0; i < joints.size(); ++i) {
      const std::vector<JointWay> ways = machine.ways(joints[i]);
      if (ways.empty()) out_.notes.push_back(machine.joint(joints[i]).name + " cannot be commanded");
      for (const JointWay& way : ways) {
        for (std::size_t trial = 0; trial < kTrialNames.size(); ++trial)
          judge_trial(machine, *start, trusting, *trusting_start, joints[i], way, static_cast<Trial>(trial));
      }
      context_.report(0.9 * static_cast<double>(i + 1) / static_cast<double>(joints.size()));
    }
  }

  // Where the joint is before the trial, with the others so that it moves freely to the limit and back; the
  // start pose where there is no such configuration.
  const Placement& placement_of(const MachineRun& machine, int joint, double begin, double end) {
    const auto key = std::pair(joint, begin);
    if (const auto found = placements_.find(key); found != placements_.end()) return found->second;
    Placement& out = placements_[key];
    const Model& model = *context_.subject.model;
    const std::string& name = machine.joint(joint).name;
    const int index = model.find_joint(name);
    std::vector<Eigen::VectorXd> candidates{start_configuration(context_.subject)};
    constexpr int kSamples = 128;
    for (Eigen::VectorXd& q : sample_configurations(model, kSamples)) candidates.push_back(std::move(q));
    for (Eigen::VectorXd& q : candidates) {
      q[model.joints[static_cast<std::size_t>(index)].q] = begin;
      model.apply_mimics(q);
      if (!space_.is_free(q) || !space_.is_way_free(q, index, end)) continue;
      out.is_free = true;
      out.positions = posed_joints(model, q);
      return out;
    }
    // It stays where it starts, and contacts may stop it on its way.
    crowded_.insert(name);
    return out;
  }

  void place(MachineRun& machine, const SavedState& start, const TrialRun& run, int joint, Trial trial) {
    machine.restore(start);
    const Placement& placement = placement_of(machine, joint, run.start(trial), run.end(trial));
    if (placement.is_free) static_cast<void>(machine.place(placement.positions));
    static_cast<void>(machine.take_lines());
  }

  Reaction react(MachineRun& machine, const SavedState& start, int joint, const JointWay& way, Trial trial) {
    TrialRun run(machine, joint);
    place(machine, start, run, joint, trial);
    return run.run(way, trial);
  }

  // How far the joint gives way under its load where it is commanded to the limit itself.
  double give_of(MachineRun& machine, const SavedState& start, int joint, const JointWay& way, Trial trial) {
    if (trial != Trial::above && trial != Trial::below) return 0;
    TrialRun run(machine, joint);
    place(machine, start, run, joint, trial);
    return run.legal(way, trial).beyond;
  }

  void judge_trial(MachineRun& machine, const SavedState& start, MachineRun& trusting,
                   const SavedState& trusting_start, int joint, const JointWay& way, Trial trial) {
    if (!TrialRun(machine, joint).applies(way, trial)) return;
    ++trials_;
    Reaction reaction = react(machine, start, joint, way, trial);
    if (violates(machine, joint, reaction) && reaction.beyond > 0)
      reaction.beyond -= std::max(0.0, give_of(machine, start, joint, way, trial));
    // An action and a topic have the same trajectory behind them.
    if (way.kind != JointWay::Kind::trajectory_action) {
      const Reaction otherwise = react(trusting, trusting_start, joint, way, trial);
      if (violates(machine, joint, otherwise)) ++let_through_;
    }
    worst_.beyond = std::max(worst_.beyond, reaction.beyond);
    worst_.speed = std::max(worst_.speed, reaction.speed);
    worst_.momentary_speed = std::max(worst_.momentary_speed, reaction.momentary_speed);
    worst_.effort = std::max(worst_.effort, reaction.effort);
    const std::string subject = fmt::format("{}, {}, {}", machine.joint(joint).name,
                                            kTrialNames[static_cast<std::size_t>(trial)], way.name());
    if (violates(machine, joint, reaction)) {
      const Joint* const source = context_.subject.description().find_joint(machine.joint(joint).name);
      CheckItem& item = out_.add({subject, Verdict::failed, violation_text(machine, joint, way, reaction),
                                  violation_fix(machine, joint, reaction),
                                  source != nullptr ? source->source : SourceLocation{}});
      item.poses.push_back({"where the trial ended", machine.posed()});
    } else if (!reaction.answered && must_answer(trial) && is_placed(machine, joint, trial)) {
      ++unanswered_;
    }
  }

  // A joint that touches something on its way may never get to its limit.
  bool is_placed(const MachineRun& machine, int joint, Trial trial) const {
    return !crowded_.contains(machine.joint(joint).name) || trial == Trial::not_a_number ||
           trial == Trial::infinite;
  }

  // A command within all limits is carried out without a word.
  static bool must_answer(Trial trial) { return trial != Trial::jump && trial != Trial::fast; }

  static bool violates(const MachineRun& machine, int joint, const Reaction& reaction) {
    const double room = machine.slides(joint) ? kSlideRoom : kPositionRoom;
    return reaction.diverged || !reaction.finite || reaction.beyond > room ||
           reaction.command_beyond > room || reaction.speed > kSpeedRoom || reaction.effort > kEffortRoom;
  }

  static std::string violation_text(const MachineRun& machine, int joint, const JointWay& way,
                                    const Reaction& reaction) {
    const ModelJoint& about = machine.joint(joint);
    const bool slides = machine.slides(joint);
    const double room = slides ? kSlideRoom : kPositionRoom;
    if (reaction.diverged) return "the physics diverges";
    if (!reaction.finite)
      return fmt::format("{} passes a command that is not finite to the drive", way.controller);
    if (reaction.beyond > room)
      return fmt::format("the joint gets {} beyond its limits {} to {} (at most {})",
                         position_text(reaction.beyond, slides), position_text(about.lower, slides),
                         position_text(about.upper, slides), position_text(room, slides));
    if (reaction.command_beyond > room)
      return fmt::format("{} passes {} to the drive, beyond the limits {} to {}", way.controller,
                         position_text(reaction.command, slides), position_text(about.lower, slides),
                         position_text(about.upper, slides));
    if (reaction.speed > kSpeedRoom)
      return fmt::format("the joint moves at {}, {:.0f} % of its speed limit (at most {:.0f} %)",
                         speed_text(reaction.speed * about.velocity, slides), 100 * reaction.speed,
                         100 * kSpeedRoom);
    return fmt::format("the drive gives {:.0f} % of the effort limit", 100 * reaction.effort);
  }

  static std::string violation_fix(const MachineRun& machine, int joint, const Reaction& reaction) {
    const double room = machine.slides(joint) ? kSlideRoom : kPositionRoom;
    if (!reaction.finite || reaction.command_beyond > room)
      return "the controller manager enforces limits unless it is told not to (enforce_command_limits, "
             "--no-limits)";
    if (reaction.beyond > room)
      return "the command is limited, and the joint goes on by its load or its speed: a stiffer servo or "
             "stop, or a "
             "limit with a margin";
    return "the command is limited, and the joint is faster by its load or an impact: more damping, another "
           "effort "
           "limit";
  }

  // Without drives the arm falls onto its stops.
  void run_fall() {
    MachineRun machine(context_, {.start_controllers = false});
    std::vector<double> beyond(machine.model().joints.size(), 0.0);
    const bool whole = machine.run(kFall, [&] {
      for (const int joint : machine.joints()) {
        const ModelJoint& about = machine.joint(joint);
        const double q = machine.position(joint);
        auto& most = beyond[static_cast<std::size_t>(joint)];
        most = std::max({most, q - about.upper, about.lower - q});
      }
    });
    if (!whole) out_.fail("fall onto the stops", "the physics diverges without drives");
    for (const int joint : machine.joints()) {
      const bool slides = machine.slides(joint);
      const double limit = slides ? kSlideOverTravel : kOverTravel,
                   most = beyond[static_cast<std::size_t>(joint)];
      out_.metrics.push_back({"over-travel", machine.joint(joint).name, most, slides ? "m" : "rad", limit});
      if (most > limit)
        out_.add({machine.joint(joint).name + ", fall onto its stop", Verdict::warned,
                  fmt::format("it travels {} beyond its limit (at most {})", position_text(most, slides),
                              position_text(limit, slides)),
                  "a stiffer stop (<stopStiffness>), a smaller step, or damping of the joint"});
    }
  }

  void finish() {
    if (trials_ == 0 && out_.items.empty()) {
      out_.verdict = Verdict::not_applicable;
      out_.summary = "no joint can be commanded";
      return;
    }
    out_.metrics.push_back({"beyond a limit", "", worst_.beyond, "rad or m"});
    out_.metrics.push_back({"speed", "", 100 * worst_.speed, "%", 100 * kSpeedRoom});
    out_.metrics.push_back({"effort", "", 100 * worst_.effort, "%", 100.0});
    if (!crowded_.empty()) {
      out_.notes.push_back(
          fmt::format("trials of {} begin at the start pose, because near a limit they touch something",
                      fmt::join(crowded_, ", ")));
    }
    out_.notes.push_back(
        fmt::format("speeds are means over {:.2g} s; the largest for a moment is {:.0f} % of its limit",
                    kWindow, 100 * worst_.momentary_speed));
    if (unanswered_ > 0) {
      out_.add({"", Verdict::warned,
                fmt::format("{} commands were limited without a line of the log that names the joint",
                            unanswered_)});
    }
    out_.notes.push_back(
        fmt::format("ros2_control by its defaults, which does not enforce limits, would have let {} of these "
                    "commands through",
                    let_through_));
    const auto failed = std::ranges::count(out_.items, Verdict::failed, &CheckItem::verdict);
    out_.summary = fmt::format("{} commands beyond limits, {} got through", trials_, failed);
  }

  const CheckContext& context_;
  FreeSpace space_;
  std::set<std::string> crowded_;                           // joints that touch something near a limit
  std::map<std::pair<int, double>, Placement> placements_;  // by joint and its position
  CheckResult& out_;
  Reaction worst_;
  std::size_t trials_ = 0, let_through_ = 0, unanswered_ = 0;
};

}  // namespace

CheckResult check_limit_enforcement(const CheckContext& context) {
  CheckResult out = begin_result("T2");
  LimitJudge(context, out).run();
  return out;
}

}  // namespace doppel
