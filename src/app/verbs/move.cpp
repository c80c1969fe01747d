#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <numbers>

#include "app/print_stderr.h"
#include "app/verbs/controllers.h"
#include "app/verbs/goals.h"
#include "app/verbs/verbs.h"
#include "doppel/bus/name_rules.h"
#include "doppel/core/names.h"
#include "doppel/messages/control_msgs.h"
#include "doppel/messages/sensor_msgs.h"

namespace doppel::app {
namespace {

using Clock = std::chrono::steady_clock;
using Follow = control_msgs::action::FollowJointTrajectory;
using Positions = std::map<std::string, double>;

struct MoveOptions {
  std::vector<std::string> targets;
  double seconds = 2;
  std::string controller, manager;
  bool no_wait = false;
};

// "Revolute 2=1.2", "Revolute 2=90deg": rad, or m for a joint that slides.
std::pair<std::string, double> parse_target(const std::string& text) {
  const std::size_t equals = text.rfind('=');
  if (equals == std::string::npos || equals == 0) {
    throw_usage_error(fmt::format("'{}' is not a target position", text),
                      "write \"Joint=1.2\" (rad or m) or \"Joint=90deg\"");
  }
  std::string_view number = std::string_view(text).substr(equals + 1);
  if (number.starts_with('+')) number.remove_prefix(1);
  double value = 0;
  const auto [end, problem] = std::from_chars(number.data(), number.data() + number.size(), value);
  const std::string_view unit = number.substr(static_cast<std::size_t>(end - number.data()));
  const bool known_unit = unit.empty() || unit == "rad" || unit == "m" || unit == "deg";
  if (problem != std::errc() || !known_unit || !std::isfinite(value)) {
    throw_usage_error(fmt::format("'{}' is not a position in '{}'", number, text),
                      "write 1.2 (rad or m) or 90deg");
  }
  return {text.substr(0, equals), unit == "deg" ? value * std::numbers::pi / 180 : value};
}

struct Mover {
  std::string controller;
  std::vector<std::string> joints;  // all that it commands
  Positions targets;                // those that are to move
};

std::vector<std::string> joints_of(const controller_manager_msgs::msg::ControllerState& controller) {
  const auto& interfaces = controller.claimed_interfaces.empty() ? controller.required_command_interfaces
                                                                 : controller.claimed_interfaces;
  std::vector<std::string> joints;
  for (const std::string& interface : interfaces) {
    std::string joint = interface.substr(0, interface.rfind('/'));
    if (std::ranges::find(joints, joint) == joints.end()) joints.push_back(std::move(joint));
  }
  return joints;
}

// The active trajectory controllers with the joints that each is to move.
std::vector<Mover> assign(Client& twin, const std::string& manager, const Positions& targets,
                          const std::string& only) {
  std::vector<Mover> movers;
  std::vector<std::string> inactive, names;
  for (const auto& controller : list_controllers(twin, manager)) {
    if (controller.type.find("JointTrajectoryController") == std::string::npos) continue;
    names.push_back(controller.name);
    if (!only.empty() && controller.name != only) continue;
    if (controller.state == "active") {
      movers.push_back({controller.name, joints_of(controller), {}});
    } else {
      inactive.push_back(controller.name);
    }
  }
  if (!only.empty() && std::ranges::find(names, only) == names.end()) {
    throw ClientError(
        fmt::format("there is no trajectory controller '{}'{}", only, did_you_mean(only, names)));
  }
  if (movers.empty()) {
    throw ClientError(inactive.empty()
                          ? "no trajectory controller is loaded"
                          : fmt::format("{} is not active; doppel control set_controller_state {} active",
                                        inactive.front(), inactive.front()));
  }
  std::vector<std::string> joints;
  for (const Mover& mover : movers) joints.insert(joints.end(), mover.joints.begin(), mover.joints.end());
  for (const auto& [joint, position] : targets) {
    const auto mover = std::ranges::find_if(movers, [&, &name = joint](const Mover& m) {
      return std::ranges::find(m.joints, name) != m.joints.end();
    });
    if (mover == movers.end()) {
      throw ClientError(
          fmt::format("no active trajectory controller moves '{}'{}", joint, did_you_mean(joint, joints)));
    }
    mover->targets[joint] = position;
  }
  std::erase_if(movers, [](const Mover& mover) { return mover.targets.empty(); });
  return movers;
}

void take_positions(const Client::Received& message, Positions& positions) {
  const auto state = decode<sensor_msgs::msg::JointState>(message.cdr);
  for (std::size_t i = 0; i < std::min(state.name.size(), state.position.size()); ++i) {
    positions[state.name[i]] = state.position[i];
  }
}

Positions present_positions(Client& twin, const std::string& topic) {
  twin.subscribe(topic);
  Client::Received message;
  if (!twin.next(message, Clock::now() + std::chrono::seconds(2))) {
    throw ClientError(fmt::format(
        "no message arrives on {}; is the twin paused, or the joint_state_broadcaster inactive?", topic));
  }
  Positions positions;
  take_positions(message, positions);
  return positions;
}

Bytes make_goal(const Mover& mover, const Positions& present, double seconds) {
  Follow::Goal goal;
  goal.trajectory.joint_names = mover.joints;
  trajectory_msgs::msg::JointTrajectoryPoint point;
  for (const std::string& joint : mover.joints) {
    const auto target = mover.targets.find(joint);
    const auto now = present.find(joint);
    if (target == mover.targets.end() && now == present.end()) {
      throw ClientError(
          fmt::format("joint_states does not contain '{}', which {} moves too", joint, mover.controller));
    }
    point.positions.push_back(target != mover.targets.end() ? target->second : now->second);
  }
  point.time_from_start = to_duration_msg(from_seconds(seconds));
  goal.trajectory.points.push_back(std::move(point));
  return to_cdr(goal);
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

  void show(const Positions& positions) {
    const auto now = Clock::now();
    if (!visible_ || now - last_ < std::chrono::milliseconds(100)) return;
    last_ = now;
    drawn_ = true;
    std::string line = fmt::format("{:5.1f} s", std::chrono::duration<double>(now - begin_).count());
    for (const auto& [joint, target] : targets_) {
      const auto found = positions.find(joint);
      if (found != positions.end()) line += fmt::format("  {} {:.3f} → {:.3f}", joint, found->second, target);
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

struct Running {
  std::string controller;
  ActionGoal goal;
  bool done = false;
  GoalOutcome outcome;
};

bool all_done(std::vector<Running>& running) {
  for (Running& r : running) r.done = r.done || r.goal.take_outcome(r.outcome);
  return std::ranges::all_of(running, &Running::done);
}

void wait_for_all(Client& twin, std::vector<Running>& running, const Positions& targets,
                  Positions& positions) {
  Progress progress(targets);
  while (!all_done(running)) {
    Client::Received message;
    if (twin.next(message, Clock::now() + std::chrono::milliseconds(100))) take_positions(message, positions);
    progress.show(positions);
  }
  Client::Received message;  // more messages may be pending when the goal ends
  while (twin.next(message, Clock::now())) take_positions(message, positions);
}

int report_moves(const std::vector<Running>& running, const Positions& targets, const Positions& positions) {
  for (const auto& [joint, target] : targets) {
    const auto found = positions.find(joint);
    if (found != positions.end()) print_line("{}: {:.4f} (target {:.4f})\n", joint, found->second, target);
  }
  int exit_code = 0;
  for (const Running& r : running) {
    if (r.outcome.status == kSucceeded) continue;
    exit_code = 1;
    print_note(fmt::format("error: {} ended with {}\n{}", r.controller, status_name(r.outcome.status),
                           r.outcome.result_yaml));
  }
  return exit_code;
}

int move(Shell& shell, const MoveOptions& options) {
  Positions targets;
  for (const std::string& text : options.targets) {
    const auto [joint, position] = parse_target(text);
    if (!targets.emplace(joint, position).second)
      throw_usage_error(fmt::format("'{}' has two target positions", joint));
  }
  Client& twin = shell.twin();
  // Controllers and their topics are in the manager's namespace.
  const std::string manager = find_manager(twin, options.manager);
  const std::vector<Mover> movers = assign(twin, manager, targets, options.controller);
  Positions positions = present_positions(twin, expand_name("joint_states", manager));
  Shell::catch_interrupts();
  std::vector<Running> running;
  for (const Mover& mover : movers) {
    const std::string action = expand_name(mover.controller + "/follow_joint_trajectory", manager);
    running.push_back(
        {mover.controller,
         ActionGoal(twin, action, action_support<Follow>(), make_goal(mover, positions, options.seconds)),
         false,
         {}});
  }
  if (options.no_wait) return 0;
  try {
    wait_for_all(twin, running, targets, positions);
  } catch (const Interrupted&) {
    Shell::clear_interrupt();
    print_note("Canceling...");
    for (Running& r : running) {
      if (!r.done) r.goal.cancel();
    }
    wait_for_all(twin, running, targets, positions);
  }
  return report_moves(running, targets, positions);
}

}  // namespace

void add_move(CLI::App& app, int& exit_code) {
  add_verb<MoveOptions>(
      app, "move", "Move joints and wait until they reach their targets",
      R"(doppel move "Revolute 2=1.2" "Revolute 3=45deg" --in 3)", exit_code,
      [](CLI::App& verb, MoveOptions& options) {
        verb.add_option("targets", options.targets,
                        "JOINT=POSITION in rad or m, or 90deg; other joints hold their position")
            ->required();
        verb.add_option("--in", options.seconds, "Duration of the motion, in simulated seconds (default 2)")
            ->check(CLI::PositiveNumber);
        verb.add_option("--controller", options.controller,
                        "Trajectory controller (default: the one that commands the joints)");
        declare_manager(verb, options.manager);
        verb.add_flag("--no-wait", options.no_wait, "Do not wait for the result");
      },
      move);
}

}  // namespace doppel::app
