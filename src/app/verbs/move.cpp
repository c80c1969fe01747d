// doppel move: brings joints to positions, and reports whether they have arrived.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "app/number_checks.h"
#include "app/print_stderr.h"
#include "app/verbs/arrival.h"
#include "app/verbs/controllers.h"
#include "app/verbs/joint_movers.h"
#include "app/verbs/log_lines.h"
#include "app/verbs/position_text.h"
#include "app/verbs/robot_watch.h"
#include "app/verbs/verbs.h"
#include "doppel/ros/bus/name_rules.h"

namespace doppel::app {
namespace {

using Clock = std::chrono::steady_clock;
using Movers = std::vector<std::unique_ptr<JointMover>>;

constexpr double kLimitSlack = 1e-6;  // rad or m: a limit that is written with six digits is reached
constexpr double kDurationMargin =
    1.02;  // over the shortest motion, so that rounding is not beyond the limit

struct MoveOptions {
  std::vector<std::string> targets;
  double seconds = 2;
  double tolerance = 0;  // rad or m; 0: the default of each joint
  std::string controller, manager;
  bool no_wait = false, clamp = false, exact_time = false;
};

// "Revolute 2=1.2", "Revolute 2=90deg": rad, or m for a joint that slides.
std::pair<std::string, double> parse_target(const std::string& text) {
  const std::size_t equals = text.rfind('=');
  if (equals == std::string::npos || equals == 0) {
    throw_usage_error(fmt::format("'{}' is not a target position", text),
                      "write \"Joint=1.2\" (rad or m) or \"Joint=90deg\"");
  }
  return {text.substr(0, equals), parse_position(std::string_view(text).substr(equals + 1), text)};
}

Positions parse_targets(const MoveOptions& options) {
  Positions targets;
  for (const std::string& text : options.targets) {
    const auto [joint, position] = parse_target(text);
    if (!targets.emplace(joint, position).second)
      throw_usage_error(fmt::format("'{}' has two target positions", joint));
  }
  return targets;
}

// A viewer has the topics of a robot, but no controllers.
void check_is_twin(Client& twin, const std::string& manager) {
  const std::string command = expand_name("joint_command", manager);
  const auto viewed = twin.topics().find(command);
  if (!find_managers(twin).empty() || viewed == twin.topics().end() || viewed->second.subscribers.empty())
    return;
  throw ClientError(fmt::format(
      "this is 'doppel view', which has no controllers that could move joints\n  fix: start a twin with "
      "doppel "
      "up, or set the picture's joints: doppel topic pub --once {} sensor_msgs/msg/JointState '{{name: "
      "[JOINT], position: [0.5]}}'",
      command));
}

// Targets beyond the limits of their joints are refused, or with --clamp brought to the limit.
void check_limits(const RobotWatch& robot, Positions& targets, bool clamp) {
  for (auto& [name, target] : targets) {
    const ModelJoint* joint = robot.find(name);
    if (joint == nullptr || (target >= joint->lower - kLimitSlack && target <= joint->upper + kLimitSlack))
      continue;
    const char* unit = joint_unit(*joint);
    if (!clamp) {
      throw_usage_error(fmt::format("'{}={:.6g}' is outside the limits of the joint, {:.6g} to {:.6g} {}",
                                    name, target, joint->lower, joint->upper, unit),
                        "choose a position between them, or add --clamp to move to the limit");
    }
    const double inside = std::clamp(target, joint->lower, joint->upper);
    print_note(fmt::format("note: '{}' moves to its limit of {:.6g} {} instead of {:.6g}", name, inside, unit,
                           target));
    target = inside;
  }
}

// The duration by which no joint has to be faster than its velocity limit.
double feasible_duration(const RobotWatch& robot, const Movers& movers, const MoveOptions& options) {
  double seconds = options.seconds;
  std::string cause;
  for (const auto& mover : movers) {
    if (!mover->is_timed()) continue;
    for (const auto& [name, target] : mover->targets()) {
      const ModelJoint* joint = robot.find(name);
      const std::optional<double> present = robot.position(name);
      if (joint == nullptr || !present || !std::isfinite(joint->velocity)) continue;
      const double distance = distance_to(joint, *present, target);
      const double shortest = distance / joint->velocity;
      if (shortest <= seconds * (1 + 1e-9)) continue;
      seconds = shortest * kDurationMargin;
      cause =
          fmt::format("'{}' has a velocity limit of {:.4g} {}/s, so that {:.4g} {} take at least {:.3g} s",
                      name, joint->velocity, joint_unit(*joint), distance, joint_unit(*joint), shortest);
    }
  }
  if (cause.empty()) return seconds;
  if (options.exact_time) {
    throw_usage_error(fmt::format("--in {:g} is too short: {}", options.seconds, cause),
                      fmt::format("use --in {:.3g}, or omit --exact-time", std::ceil(seconds * 100) / 100));
  }
  print_note(
      fmt::format("note: {}; the motion takes {:.3g} s instead of {:g} s", cause, seconds, options.seconds));
  return seconds;
}

// One line that is overwritten while the arm moves; only on a terminal.
class Progress {
 public:
  explicit Progress(const Positions& targets) : targets_(targets), visible_(isatty(STDERR_FILENO) != 0) {}
  ~Progress() {
    if (visible_ && drawn_) print_stderr("\r\033[K");
  }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void show(const RobotWatch& robot) {
    const auto now = Clock::now();
    if (!visible_ || now - last_ < std::chrono::milliseconds(100)) return;
    last_ = now;
    drawn_ = true;
    std::string line = fmt::format("{:5.1f} s", std::chrono::duration<double>(now - begin_).count());
    for (const auto& [joint, target] : targets_) {
      if (const std::optional<double> present = robot.position(joint))
        line += fmt::format("  {} {:.3f} → {:.3f}", joint, *present, target);
    }
    print_stderr("\r\033[K{}", line);
  }

 private:
  const Positions& targets_;
  const bool visible_;
  bool drawn_ = false;
  const Clock::time_point begin_ = Clock::now();
  Clock::time_point last_{};
};

// A sentence on the hardware of the joint, if it is not active; empty: it is, or there is no answer.
std::string hardware_problem(Client& twin, const std::string& manager, const std::string& joint) {
  using controller_manager_msgs::srv::ListHardwareComponents;
  ListHardwareComponents::Response all;
  try {
    all = call<ListHardwareComponents>(twin, manager + "/list_hardware_components");
  } catch (const ClientError&) {
    return {};
  }
  for (const auto& one : all.component) {
    const bool drives = std::ranges::any_of(one.command_interfaces, [&](const auto& command) {
      return std::string_view(command.name).starts_with(joint + "/");
    });
    if (!drives || one.state.label == "active") continue;
    return fmt::format(
        "'{}' is not at its target, because the hardware '{}' is {}; the log of the twin has the cause. Once "
        "it is "
        "fixed: doppel control set_hardware_component_state {} active",
        joint, std::string(one.name), std::string(one.state.label), std::string(one.name));
  }
  return {};
}

// The movers on their way to the targets, and all that arrives from the twin meanwhile.
class Motion {
 public:
  Motion(Client& twin, std::string manager, RobotWatch& robot, Movers movers, const Positions& targets)
      : twin_(twin),
        manager_(std::move(manager)),
        robot_(robot),
        movers_(std::move(movers)),
        targets_(targets),
        progress_(targets) {}

  // If one controller refuses its command, those that were started before are stopped.
  void start(double seconds) {
    std::size_t started = 0;
    try {
      for (; started < movers_.size(); ++started) movers_[started]->start(twin_, robot_, seconds);
    } catch (const ClientError&) {
      while (started-- > 0) movers_[started]->cancel(robot_);
      throw;
    }
    lines_.emplace(twin_);
  }

  // Until the commands are completed; joints may still be on their way.
  void wait_for_commands() {
    const auto is_finished = [&](const auto& mover) { return mover->is_finished(robot_); };
    while (static_cast<std::size_t>(std::ranges::count_if(movers_, is_finished)) < movers_.size())
      static_cast<void>(next(Clock::now() + std::chrono::milliseconds(100)));
  }

  void wait_for_arrival(const Arrival& arrival) {
    arrival.wait(robot_, targets_, [&](Clock::time_point until) { return next(until); });
  }

  void cancel() {
    for (const auto& mover : movers_) mover->cancel(robot_);
  }

  // Prints where the joints are, and why one is not where it should be. Returns the exit code.
  int report(const Arrival& arrival) {
    for (const auto& [joint, target] : targets_) {
      if (const std::optional<double> present = robot_.position(joint))
        print_line("{}: {:.4f} (target {:.4f})\n", joint, *present, target);
    }
    std::vector<std::string> problems;
    for (const auto& mover : movers_) {
      std::string problem = mover->problem();
      if (problem.empty()) continue;
      if (problem.find(": ") == std::string::npos)
        problem += lines_->reason(expand_name(mover->controller(), manager_));
      problems.push_back(std::move(problem));
    }
    for (const auto& [joint, target] : targets_) {
      std::string problem = arrival.why_not(robot_, joint, target);
      if (problem.empty()) continue;
      // States of hardware that has failed are old, and say nothing of a cause.
      const std::string failed = hardware_problem(twin_, manager_, joint);
      problems.push_back(failed.empty() ? std::move(problem) : failed);
    }
    for (const std::string& problem : problems) print_note("error: " + problem);
    return problems.empty() ? 0 : 1;
  }

 private:
  bool next(Clock::time_point until) {
    Client::Received message;
    if (!twin_.next(message, until)) return false;
    if (robot_.take(message)) {
      progress_.show(robot_);
    } else {
      lines_->take(message);
    }
    return true;
  }

  Client& twin_;
  const std::string manager_;
  RobotWatch& robot_;
  const Movers movers_;
  const Positions& targets_;
  Progress progress_;
  std::optional<LogLines> lines_;
};

int move(Shell& shell, const MoveOptions& options) {
  Positions targets = parse_targets(options);
  Client& twin = shell.twin();
  // Controllers and their topics are in the manager's namespace.
  const std::string manager = find_manager(twin, options.manager);
  check_is_twin(twin, manager);
  RobotWatch robot(twin, manager);
  if (robot.is_stopped())
    throw ClientError("the emergency stop is on, so nothing moves\n  fix: doppel stop --reset");
  check_limits(robot, targets, options.clamp);
  Movers movers = assign_movers(twin, robot, manager, targets, options.controller);
  const double seconds = feasible_duration(robot, movers, options);
  const bool sends_all_the_way = std::ranges::any_of(movers, &JointMover::sends_all_the_way);
  const Arrival arrival(options.tolerance);
  Motion motion(twin, manager, robot, std::move(movers), targets);
  Shell::catch_interrupts();
  motion.start(seconds);
  try {
    if (!options.no_wait || sends_all_the_way) motion.wait_for_commands();
    if (options.no_wait) return 0;
    motion.wait_for_arrival(arrival);
  } catch (const Interrupted&) {
    Shell::clear_interrupt();
    print_note("Canceling...");
    motion.cancel();
    motion.wait_for_commands();
  }
  return motion.report(arrival);
}

}  // namespace

void add_move(CLI::App& app, int& exit_code) {
  add_verb<MoveOptions>(
      app, "move", "Move joints and wait until they reach their targets",
      "doppel move \"Revolute 2=1.2\" \"Revolute 3=45deg\" --in 3\n  doppel move katana_r_finger_joint=0.2   "
      "  "
      " # a gripper\n"
      "The exit code is 0 if every joint has arrived, 1 with the cause if not, 2 for targets that cannot be "
      "reached.",
      exit_code,
      [](CLI::App& verb, MoveOptions& options) {
        verb.add_option("targets", options.targets,
                        "JOINT=POSITION in rad or m, or 90deg; other joints hold their position")
            ->required();
        verb.add_option("--in", options.seconds,
                        "Duration of the motion, in simulated seconds (default 2); extended where a velocity "
                        "limit requires it")
            ->check(positive_number());
        verb.add_flag("--exact-time", options.exact_time,
                      "Refuse a duration that is too short for the velocity limits");
        verb.add_flag("--clamp", options.clamp, "Move to the limit where a target is beyond it");
        verb.add_option("--tolerance", options.tolerance,
                        "Distance at which a joint has arrived, rad or m (default 0.02 rad, 0.002 m)")
            ->check(positive_number());
        verb.add_option("--controller", options.controller,
                        "Controller to use (default: the one that commands the joints)");
        declare_manager(verb, options.manager);
        verb.add_flag("--no-wait", options.no_wait, "Do not wait for the result");
      },
      move);
}

}  // namespace doppel::app
