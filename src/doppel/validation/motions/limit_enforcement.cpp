#include "doppel/validation/motions/limit_enforcement.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <atomic>
#include <map>
#include <memory>
#include <optional>
#include <set>

#include "doppel/base/core/parallel_work.h"
#include "doppel/robot/kinematics/dynamics.h"
#include "doppel/validation/motions/detail/failure_recorder.h"
#include "doppel/validation/motions/detail/free_space.h"
#include "doppel/validation/motions/detail/limit_trials.h"
#include "doppel/validation/statics/start_pose.h"

namespace doppel {
namespace {

constexpr double kOverTravel = 9e-3, kSlideOverTravel = 9e-4;   // rad, m: of a fall onto the stops
constexpr double kTrial = 1.0, kQuickTrial = 0.6, kFall = 3.0;  // s

using Trial = LimitTrial;

struct Placement {
  bool is_free = false;
  std::vector<std::pair<std::string, double>> positions;
};

// A command that was tried.
struct TriedCommand {
  JointWay way;
  Trial trial = Trial::above;
  Reaction reaction;
  std::optional<bool> let_through;  // by a stack that does not enforce limits; none: it has no such way
  bool is_placed = true;            // false: the joint may touch something on its way to the limit
  std::vector<std::pair<std::string, double>> posed;  // where the trial of a violation ended
};

struct TriedJoint {
  std::vector<TriedCommand> commands;
  bool is_crowded = false;  // it touches something near a limit
};

// Tries the commands of joints in twins of its own. Each trial begins at the same saved state, so that its
// result depends on no other.
class JointTrials {
 public:
  explicit JointTrials(const CheckContext& context)
      : context_(context),
        space_(context.subject),
        machine_(context, {.enforce_limits = context.subject.scenario.enforce_limits}),
        trusting_(context, {.enforce_limits = false}),
        start_(machine_.save()),
        trusting_start_(trusting_.save()),
        seconds_(context.effort == Effort::quick ? kQuickTrial : kTrial) {}

  [[nodiscard]] MachineRun& machine() { return machine_; }
  // A trial again, from the same state.
  void repeat(int joint, const JointWay& way, Trial trial) {
    placements_.clear();
    place(machine_, *start_, joint, way, trial);
    LimitTrialRun(machine_, joint, seconds_).run(way, trial);
  }

  TriedJoint run(int joint) {
    TriedJoint out;
    placements_.clear();
    std::vector<JointWay> ways = machine_.ways(joint);
    if (ways.empty()) return out;
    for (JointWay& service : machine_.service_ways(joint)) ways.push_back(std::move(service));
    for (const JointWay& way : ways) {
      for (std::size_t i = 0; i < kLimitTrialNames.size(); ++i) {
        const auto trial = static_cast<Trial>(i);
        if (LimitTrialRun(machine_, joint, seconds_).applies(way, trial) && is_chosen(way, trial))
          out.commands.push_back(try_command(joint, way, trial));
      }
    }
    for (const auto& [begin, placement] : placements_) out.is_crowded = out.is_crowded || !placement.is_free;
    return out;
  }

 private:
  // An action and a topic have the same trajectory behind them.
  [[nodiscard]] bool is_chosen(const JointWay& way, Trial trial) const {
    return context_.effort != Effort::quick || way.kind != JointWay::Kind::trajectory_action ||
           trial == Trial::above || trial == Trial::not_a_number;
  }

  // Services belong to the simulator, and an action lets through what its topic does.
  [[nodiscard]] bool is_compared(const JointWay& way, Trial trial) const {
    const bool is_command = way.kind == JointWay::Kind::trajectory || way.kind == JointWay::Kind::forward;
    const bool is_long = trial == Trial::fast || trial == Trial::jump;
    return is_command && !(is_long && context_.effort == Effort::quick);
  }

  // Where the joint is before the trial, with the others so that it moves freely to the limit and back; the
  // start pose where there is no such configuration.
  const Placement& placement_of(int joint, double begin, double end) {
    if (const auto found = placements_.find(begin); found != placements_.end()) return found->second;
    Placement& out = placements_[begin];
    const Model& model = *context_.subject.model;
    const int index = model.find_joint(machine_.joint(joint).name);
    std::vector<Eigen::VectorXd> candidates{start_configuration(context_.subject)};
    constexpr int kSamples = 128;
    for (Eigen::VectorXd& q : sample_configurations(model, kSamples)) candidates.push_back(std::move(q));
    for (Eigen::VectorXd& q : candidates) {
      q[model.joints[static_cast<std::size_t>(index)].q] = begin;
      model.apply_mimics(q);
      if (!space_.is_free(q) || !space_.is_way_free(q, index, end)) continue;
      out.is_free = true;
      out.positions = posed_joints(model, q);
      break;
    }
    return out;
  }

  // Returns whether it moves freely there.
  bool place(MachineRun& machine, const SavedState& start, int joint, const JointWay& way, Trial trial) {
    machine.restore(start);
    // A service that refuses moves nothing, wherever the joint is.
    if (way.kind == JointWay::Kind::position_service) return true;
    const LimitTrialRun run(machine, joint, seconds_);
    const Placement& placement = placement_of(joint, run.start(trial), run.end(trial));
    if (placement.is_free) static_cast<void>(machine.place(placement.positions));
    static_cast<void>(machine.take_lines());
    return placement.is_free;
  }

  // How far the joint gives way under its load where it is commanded to the limit itself.
  double give_of(int joint, const JointWay& way, Trial trial) {
    const bool is_at_limit = trial == Trial::above || trial == Trial::below;
    if (!is_at_limit || way.kind == JointWay::Kind::position_service) return 0;
    place(machine_, *start_, joint, way, trial);
    return LimitTrialRun(machine_, joint, kTrial).legal(way, trial).beyond;
  }

  TriedCommand try_command(int joint, const JointWay& way, Trial trial) {
    TriedCommand out;
    out.way = way;
    out.trial = trial;
    const bool slides = machine_.slides(joint);
    // A joint that touches something on its way may never get to its limit.
    const bool needs_way = trial != Trial::not_a_number && trial != Trial::infinite;
    out.is_placed = place(machine_, *start_, joint, way, trial) || !needs_way;
    out.reaction = LimitTrialRun(machine_, joint, seconds_).run(way, trial);
    if (out.reaction.violates(slides)) out.posed = machine_.posed();
    if (out.reaction.violates(slides) && out.reaction.beyond > 0)
      out.reaction.beyond -= std::max(0.0, give_of(joint, way, trial));
    if (is_compared(way, trial)) {
      place(trusting_, *trusting_start_, joint, way, trial);
      out.let_through =
          LimitTrialRun(trusting_, joint, seconds_).run_to_violation(way, trial).violates(slides);
    }
    return out;
  }

  const CheckContext& context_;
  FreeSpace space_;
  MachineRun machine_, trusting_;  // trusting_: as ros2_control by its defaults
  std::shared_ptr<const SavedState> start_, trusting_start_;
  double seconds_;
  std::map<double, Placement> placements_;  // of the joint, by its position
};

class LimitJudge {
 public:
  LimitJudge(const CheckContext& context, CheckResult& out) : context_(context), out_(out) {}

  void run() {
    run_commands();
    run_fall();
    finish();
  }

 private:
  void run_commands() {
    const auto first = std::make_shared<JointTrials>(context_);
    const std::vector<int>& joints = first->machine().joints();
    std::vector<TriedJoint> tried(joints.size());
    std::atomic<bool> is_taken{false};
    std::atomic<std::size_t> ready{0};
    parallel_work(joints.size(), context_.threads, [&] {
      auto trials = is_taken.exchange(true) ? std::make_shared<JointTrials>(context_) : first;
      return [&, trials = std::move(trials)](std::size_t i) {
        tried[i] = trials->run(joints[i]);
        context_.report(0.9 * static_cast<double>(++ready) / static_cast<double>(joints.size()));
      };
    });
    for (std::size_t i = 0; i < joints.size(); ++i) judge(*first, joints[i], tried[i]);
  }

  void judge(JointTrials& trials, int joint, const TriedJoint& tried) {
    const MachineRun& machine = trials.machine();
    if (tried.commands.empty()) out_.notes.push_back(machine.joint(joint).name + " cannot be commanded");
    if (tried.is_crowded) crowded_.insert(machine.joint(joint).name);
    for (const TriedCommand& command : tried.commands) judge(trials, joint, command);
  }

  void judge(JointTrials& trials, int joint, const TriedCommand& command) {
    const MachineRun& machine = trials.machine();
    ++trials_;
    const Reaction& reaction = command.reaction;
    if (command.let_through) {
      auto& [through, all] = let_through_[command.trial];
      ++all;
      through += *command.let_through ? 1 : 0;
    }
    worst_.beyond = std::max(worst_.beyond, reaction.beyond);
    worst_.speed = std::max(worst_.speed, reaction.speed);
    worst_.momentary_speed = std::max(worst_.momentary_speed, reaction.momentary_speed);
    worst_.effort = std::max(worst_.effort, reaction.effort);
    // A load from outside is no command: masses that it throws about are the subject of G04 and T6.
    if (reaction.diverged && command.way.kind == JointWay::Kind::effort_service) {
      out_.add({machine.joint(joint).name, Verdict::warned,
                fmt::format("the physics diverges under a load on {}", command.way.name()),
                "inertias (G04), and <dynamics damping=... friction=...> of the joint"});
    } else if (reaction.violates(machine.slides(joint))) {
      const Joint* const source = context_.subject.description().find_joint(machine.joint(joint).name);
      CheckItem& item = out_.add(
          {fmt::format("{}, {}, {}", machine.joint(joint).name,
                       kLimitTrialNames[static_cast<std::size_t>(command.trial)], command.way.name()),
           Verdict::failed, violation_text(machine, joint, command.way, reaction),
           violation_fix(machine, joint, reaction), source != nullptr ? source->source : SourceLocation{}});
      item.poses.push_back({"where the trial ended", command.posed});
      recorder_.record(item, machine.joint(joint).name, trials.machine(),
                       [&] { trials.repeat(joint, command.way, command.trial); });
    } else if (!reaction.answered && must_answer(command) && command.is_placed) {
      ++unanswered_;
    }
  }

  // A command within all limits is carried out without a word, and so is an effort from outside.
  static bool must_answer(const TriedCommand& command) {
    const bool is_push = command.way.kind == JointWay::Kind::effort_service;
    return command.trial != Trial::jump && command.trial != Trial::fast &&
           !(is_push && command.trial == Trial::effort);
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
    if (!whole) {
      out_.fail("fall onto the stops", "the physics diverges without drives");
      MachineRun again(context_, {.start_controllers = false});
      recorder_.record(out_.items.back(), "fall onto the stops", again, [&] { again.run(kFall); });
    }
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
                    kSpeedWindow, 100 * worst_.momentary_speed));
    if (unanswered_ > 0) {
      out_.add({"", Verdict::warned,
                fmt::format("{} commands were limited without a line of the log that names the joint",
                            unanswered_)});
    }
    out_.notes.push_back(let_through_text());
    if (context_.effort == Effort::quick) {
      out_.notes.push_back(
          "quick: trials end after 0.6 s instead of 1 s; of actions, which have the controllers of the "
          "topics "
          "behind them, only a command beyond the upper limit and NaN are tried; fast commands are not tried "
          "without limits");
    }
    const auto failed = std::ranges::count(out_.items, Verdict::failed, &CheckItem::verdict);
    out_.summary = fmt::format("{} commands beyond limits, {} got through", trials_, failed);
  }

  // "ros2_control by its defaults, ..., would have let 9 of 12 commands through: beyond the upper limit 2 of
  // 2, NaN 2 of 2".
  [[nodiscard]] std::string let_through_text() const {
    std::size_t through = 0, all = 0;
    std::string parts;
    for (const auto& [trial, counts] : let_through_) {
      through += counts.first;
      all += counts.second;
      parts += fmt::format("{}{} {} of {}", parts.empty() ? ": " : ", ",
                           kLimitTrialNames[static_cast<std::size_t>(trial)], counts.first, counts.second);
    }
    return fmt::format(
        "ros2_control by its defaults, which does not enforce limits, would have let {} of {} commands "
        "through{}",
        through, all, parts);
  }

  const CheckContext& context_;
  CheckResult& out_;
  FailureRecorder recorder_{context_, out_};
  std::set<std::string> crowded_;  // joints that touch something near a limit
  std::map<Trial, std::pair<std::size_t, std::size_t>> let_through_;  // of all
  Reaction worst_;
  std::size_t trials_ = 0, unanswered_ = 0;
};

}  // namespace

CheckResult check_limit_enforcement(const CheckContext& context) {
  CheckResult out = begin_result("T2");
  LimitJudge(context, out).run();
  return out;
}

}  // namespace doppel
