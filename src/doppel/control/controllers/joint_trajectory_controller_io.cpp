// Messages, goals and reports of joint_trajectory_controller.h, between steps. Only tell_state() runs
// in the loop.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "doppel/control/controllers/detail/joint_trajectory_controller.h"
#include "doppel/control/manager/joint_list.h"

namespace doppel {

using jtc::Kind;

namespace {

jtc::MessageRules rules_of(const jtc::Settings& settings, const jtc::Tuning& tuning) {
  return {settings.joints,
          settings.ignored,
          tuning.allow_partial_joints,
          tuning.allow_integration,
          tuning.allow_nonzero_velocity_at_end,
          settings.commands(Kind::effort)};
}

}  // namespace

void JointTrajectoryController::open_topics() {
  Node& node = *context_->node;
  node.subscribe<TrajectoryMessage>(
      "~/joint_trajectory", [this](const TrajectoryMessage& message) { receive(message); },
      Qos::system_default_subscription());
  state_topic_ = node.advertise<control_msgs::msg::JointTrajectoryControllerState>(
      "~/controller_state", Qos::system_default_publisher());
  node.serve<QueryState>("~/query_state", [this](const QueryState::Request& request,
                                                 const Responder<QueryState::Response>& respond) {
    QueryState::Response response;
    answer_query(request, response);
    respond(response);
  });
  action_ = std::make_unique<ActionServer<FollowJointTrajectory>>(
      node, "~/follow_joint_trajectory",
      ActionServer<FollowJointTrajectory>::Callbacks{
          [this](const GoalId& id, const FollowJointTrajectory::Goal& goal) { return accept_goal(id, goal); },
          [this](const GoalId& id) { return cancel_goal(id); }});
  if (settings_.commands_only(Kind::position)) {
    node.subscribe<control_msgs::msg::SpeedScalingFactor>(
        "~/speed_scaling_input", [this](const auto& message) { set_scaling(message.factor); },
        Qos{.depth = 1, .latched = true, .best_effort = true});
  }
}

// -- ~/controller_state

void JointTrajectoryController::size_state_message() {
  const std::size_t joints = settings_.joints.size();
  auto& m = state_message_;
  m = {};
  m.joint_names = settings_.joints;
  for (auto* values : {&m.reference.positions, &m.reference.velocities, &m.reference.accelerations,
                       &m.feedback.positions, &m.error.positions}) {
    values->resize(joints);
  }
  for (auto* point : {&m.feedback, &m.error}) {
    if (settings_.measures(Kind::velocity)) point->velocities.resize(joints);
    if (settings_.measures(Kind::acceleration)) point->accelerations.resize(joints);
  }
  for (auto* values :
       {&m.output.positions, &m.output.velocities, &m.output.accelerations, &m.output.effort}) {
    values->reserve(joints);
  }
}

void JointTrajectoryController::publish_controller_state(Time now) {
  if (!state_topic_.has_listeners()) return;
  auto& m = state_message_;
  m.header.stamp = to_time_msg(context_->node->bus().stamp(now));
  m.reference.time_from_start = to_duration_msg(run_.reference_time);
  m.reference.positions = run_.desired.positions;
  m.reference.velocities = run_.desired.velocities;
  m.reference.accelerations = run_.desired.accelerations;
  m.feedback.time_from_start = to_duration_msg(run_.feedback_time);
  m.feedback.positions = run_.state.positions;
  m.error.positions = run_.error.positions;
  if (settings_.measures(Kind::velocity)) {
    m.feedback.velocities = run_.state.velocities;
    m.error.velocities = run_.error.velocities;
  }
  if (settings_.measures(Kind::acceleration)) {
    m.feedback.accelerations = run_.state.accelerations;
    m.error.accelerations = run_.error.accelerations;
  }
  fill_output();
  m.speed_scaling_factor = run_.scaling;
  state_topic_.publish(m, now);
}

// As in ros2_controllers: the present commands once all of them are finite, and empty before.
void JointTrajectoryController::fill_output() {
  auto& output = state_message_.output;
  std::vector<double>* const fields[] = {&output.positions, &output.velocities, &output.accelerations,
                                         &output.effort};
  const Kind kinds[] = {Kind::position, Kind::velocity, Kind::acceleration, Kind::effort};
  const bool complete = std::all_of(std::begin(kinds), std::end(kinds), [this](Kind kind) {
    return !settings_.commands(kind) || interfaces_.all_commanded(kind);
  });
  for (const Kind kind : kinds) {
    std::vector<double>& values = *fields[index(kind)];
    values.resize(complete && settings_.commands(kind) ? settings_.joints.size() : 0);
    for (std::size_t j = 0; j < values.size(); ++j) values[j] = interfaces_.command(kind, j);
  }
}

// -- input

Status JointTrajectoryController::check(const TrajectoryMessage& message) const {
  return jtc::check_message(message, rules_of(settings_, tuning_), now());
}

// The message with its stamp, if it is not zero, converted to the loop's time.
JointTrajectoryController::TrajectoryMessage JointTrajectoryController::in_own_time(
    TrajectoryMessage message) const {
  auto& stamp = message.header.stamp;
  if (from_msg(stamp) != Time{}) stamp = to_time_msg(context_->node->bus().from_stamp(from_msg(stamp)));
  return message;
}

void JointTrajectoryController::receive(const TrajectoryMessage& received) {
  if (!active_) {
    warn("control.jtc_inactive", "received a trajectory while the controller is not active; ignored",
         "activate it first");
    return;
  }
  const TrajectoryMessage message = in_own_time(received);
  Status fine = check(message);
  if (fine) fine = check_path(message);
  if (!fine) {
    context_->log->error(context_->name, fine.why() + "; the trajectory is ignored");
    return;
  }
  if (run_.goal) {
    warn("control.jtc_goal_redirected",
         fmt::format("a trajectory from the topic replaces the trajectory of the active goal for {}; the "
                     "goal continues and is checked against the new one",
                     fmt::join(settings_.joints, ", ")),
         "cancel the goal before sending to the topic");
  }
  drop_pending("Current goal preempted by a trajectory from the topic.");
  if (!rehearse({message})) adopt(message);
}

// The positions that the joints are commanded to, or have.
std::vector<double> JointTrajectoryController::held_positions() const {
  std::vector<double> hold = run_.state.positions;
  for (std::size_t j = 0; j < hold.size(); ++j) {
    const double commanded = interfaces_.command(Kind::position, j);
    if (std::isfinite(commanded)) hold[j] = commanded;
  }
  return hold;
}

// Joints that the message leaves out stay where they are held.
jtc::ReceivedTrajectory JointTrajectoryController::trajectory_of(const TrajectoryMessage& message) const {
  return jtc::make_trajectory(message, rules_of(settings_, tuning_), held_positions());
}

// The trajectory is followed from the next update.
void JointTrajectoryController::adopt(const TrajectoryMessage& message) {
  for (const std::string& joint : jtc::repeated_joints(message)) {
    warn("control.jtc_repeated_joint",
         fmt::format("the trajectory lists joint '{}' more than once; its last values are used", joint),
         "list it once");
  }
  run_.received = trajectory_of(message);
  warn_of_stamp(message);
  run_.next = Source::received;
  run_.holding = false;
}

// As in ros2_controllers a late trajectory is entered in the middle, and an early one starts at once. Both
// can surprise the sender of the stamp, so both are warnings.
void JointTrajectoryController::warn_of_stamp(const TrajectoryMessage& message) {
  const Time stamp = from_msg(message.header.stamp);
  const Duration grace = from_seconds(2.0 / context_->update_rate);
  const Duration late = now() - stamp;
  if (stamp == Time{} || (late >= -grace && late <= grace)) return;
  jtc::JointStates there(settings_.joints.size());
  const Time entry = std::max(now(), stamp + from_msg(message.points.front().time_from_start));
  jtc::Trajectory preview = *run_.received.get();
  preview.begin(now(), now(), run_.state, wraps_);
  if (!preview.sample(entry, jtc::Interpolation::splines, there)) return;
  std::size_t farthest = 0;
  const auto distance = [&](std::size_t j) { return std::abs(there.positions[j] - run_.state.positions[j]); };
  for (std::size_t j = 1; j < settings_.joints.size(); ++j) {
    if (distance(j) > distance(farthest)) farthest = j;
  }
  const std::string& joint = settings_.joints[farthest];
  if (late < Duration{}) {
    warn("control.jtc_early_stamp",
         fmt::format("the trajectory's stamp is {:.3f} s in the future, but the running trajectory is "
                     "replaced now and joint '{}' moves to its first point, {:.3f} away, immediately",
                     -to_seconds(late), joint, distance(farthest)),
         "send the trajectory when it is due, or set the stamp to 0");
  } else if (entry == now()) {
    warn("control.jtc_late_stamp",
         fmt::format("the trajectory's stamp is {:.3f} s in the past, so it starts in the middle, where "
                     "joint '{}' jumps by {:.3f}",
                     to_seconds(late), joint, distance(farthest)),
         "send the trajectory in time, or set the stamp to 0 to start at its beginning");
  }
}

void JointTrajectoryController::set_scaling(double factor) {
  if (!(factor >= 0) || !std::isfinite(factor)) {
    warn("control.jtc_bad_scaling", fmt::format("a speed scaling factor of {:g} is ignored", factor),
         "send a factor of at least 0");
    return;
  }
  run_.scaling = factor;
  if (settings_.scaling_state.empty() || !settings_.scaling_command.empty()) {
    run_.scaling_command = factor;
  } else if (!run_.scaling_reported) {
    run_.scaling_reported = true;
    warn("control.jtc_scaling_overwritten",
         fmt::format("the hardware's '{}' will overwrite the speed scaling factor", settings_.scaling_state),
         "set speed_scaling.command_interface too, so that the hardware receives it");
  }
}

// -- the action

Status JointTrajectoryController::accept_goal(const GoalId& id, const FollowJointTrajectory::Goal& goal) {
  const auto refuse = [this](const std::string& why) {
    context_->log->error(context_->name, why + "; the goal is rejected");
    return Status::refused(why);
  };
  if (!active_) return refuse(fmt::format("'{}' is not active; activate it first", context_->name));
  const TrajectoryMessage trajectory = in_own_time(goal.trajectory);
  if (Status fine = check(trajectory); !fine) return refuse(fine.why());
  if (Status free = check_path(trajectory); !free) return refuse(free.why());
  std::string problem;
  const jtc::Tolerances tolerances =
      jtc::tolerances_of(goal, tuning_.tolerances, settings_.joints, settings_.ignored, problem);
  if (!problem.empty()) {
    context_->log->error(context_->name, problem + "; the goal uses the default tolerances");
  }
  drop_pending("Current goal preempted by new incoming action.");
  if (!rehearse({trajectory, id, tolerances})) follow_goal(id, trajectory, tolerances);
  return {};
}

void JointTrajectoryController::follow_goal(const GoalId& id, const TrajectoryMessage& message,
                                            jtc::Tolerances tolerances) {
  report_endings();
  if (run_.goal) {
    finish(*run_.goal, GoalStatus::aborted, FollowJointTrajectory::Result::INVALID_GOAL,
           "Current goal preempted by new incoming action.");
  }
  adopt(message);
  run_.tolerances = std::move(tolerances);
  run_.goal = id;
  run_.followed_goal = false;
  action_->set_executing(id);
}

Status JointTrajectoryController::cancel_goal(const GoalId& id) {
  if (pending_ && pending_->goal == id) {
    pending_.reset();
    finish(id, GoalStatus::canceled, FollowJointTrajectory::Result::SUCCESSFUL, "");
    return {};
  }
  if (run_.goal == id) {
    run_.goal_ended = Ending{Ending::Kind::canceled, id, {}, 0, 0};
    run_.goal.reset();
    stop();
  }
  return {};
}

void JointTrajectoryController::finish(const GoalId& id, GoalStatus status, std::int32_t code,
                                       std::string text) {
  if (!text.empty()) {
    context_->log->line(status == GoalStatus::aborted ? Severity::warning : Severity::note, context_->name,
                        text);
  }
  FollowJointTrajectory::Result result;
  result.error_code = code;
  result.error_string = std::move(text);
  action_->finish(id, status, result);
}

// -- output at action_monitor_rate

double JointTrajectoryController::housekeeping_rate() const {
  constexpr double kRehearsalRate = 100;
  return is_guarded() ? std::max(settings_.action_monitor_rate, kRehearsalRate)
                      : settings_.action_monitor_rate;
}

void JointTrajectoryController::housekeeping(Time now) {
  if (is_guarded()) {
    attend_rehearsal();
    if (now < next_report_) return;
    next_report_ = now + from_seconds(1.0 / std::max(settings_.action_monitor_rate, 1e-3));
  }
  report_endings();
  if (run_.scaling_unusable) {
    warn("control.jtc_bad_scaling",
         fmt::format("'{}' is not a usable speed scaling factor; the last one stays in effect",
                     settings_.scaling_state),
         "correct the state interface of the hardware");
    run_.scaling_unusable = false;
  }
  if (run_.goal && run_.followed_goal) send_feedback(now);
}

void JointTrajectoryController::send_feedback(Time now) {
  FollowJointTrajectory::Feedback feedback;
  feedback.header.stamp = to_time_msg(context_->node->bus().stamp(now));
  feedback.joint_names = settings_.joints;
  if (current() != nullptr)
    feedback.index = static_cast<std::int32_t>(current()->next_point(run_.trajectory_time));
  feedback.desired.positions = run_.desired.positions;
  feedback.actual.positions = run_.state.positions;
  feedback.error.positions = run_.error.positions;
  if (settings_.measures(Kind::velocity)) {
    feedback.desired.velocities = run_.desired.velocities;
    feedback.actual.velocities = run_.state.velocities;
    feedback.error.velocities = run_.error.velocities;
  }
  if (settings_.measures(Kind::acceleration)) {
    feedback.desired.accelerations = run_.desired.accelerations;
    feedback.actual.accelerations = run_.state.accelerations;
    feedback.error.accelerations = run_.error.accelerations;
  }
  feedback.desired.time_from_start = to_duration_msg(run_.reference_time);
  feedback.actual.time_from_start = to_duration_msg(run_.feedback_time);
  action_->publish_feedback(*run_.goal, feedback);
}

void JointTrajectoryController::report_endings() {
  using Result = FollowJointTrajectory::Result;
  if (run_.goal_ended) {
    const Ending ending = *run_.goal_ended;
    run_.goal_ended.reset();
    if (ending.kind == Ending::Kind::canceled) {
      finish(*ending.goal, GoalStatus::canceled, Result::SUCCESSFUL, "");
    } else if (ending.kind == Ending::Kind::reached) {
      finish(*ending.goal, GoalStatus::succeeded, Result::SUCCESSFUL, "Goal successfully reached!");
    } else {
      const bool path = ending.kind == Ending::Kind::path_violated;
      finish(*ending.goal, GoalStatus::aborted,
             path ? Result::PATH_TOLERANCE_VIOLATED : Result::GOAL_TOLERANCE_VIOLATED,
             "Aborted due to " + describe(ending));
    }
  }
  if (run_.topic_ended) {
    context_->log->error(context_->name, "Holding position due to " + describe(*run_.topic_ended));
    run_.topic_ended.reset();
  }
}

std::string JointTrajectoryController::describe(const Ending& ending) const {
  std::string joint;
  if (ending.worst.any()) {
    joint = fmt::format(": joint '{}' has a {} error of {:.4g}, the tolerance is {:.4g}",
                        settings_.joints[ending.worst.joint], to_string(ending.worst.quantity),
                        ending.worst.error, ending.worst.tolerance);
  }
  const std::string time = fmt::format(", {:.3f} s after the start", ending.trajectory_time);
  switch (ending.kind) {
    case Ending::Kind::path_violated:
      return "path tolerance violation" + joint + time;
    case Ending::Kind::goal_missed:
      return fmt::format("goal_time_tolerance exceeding by {:.6f} seconds{}{}",
                         ending.late - run_.tolerances.goal_time, joint, time);
    default:
      return fmt::format("command timeout, {:.3f} s after the last point{}{}", ending.late, joint, time);
  }
}

// -- ~/query_state

void JointTrajectoryController::answer_query(const QueryState::Request& request,
                                             QueryState::Response& response) {
  const Time time = context_->node->bus().from_stamp(from_msg(request.time));
  if (!active_) {
    response.message =
        fmt::format("'{}' is not active, so it follows no trajectory; activate it first", context_->name);
  } else {
    response.name = settings_.joints;
    jtc::JointStates there = run_.state;
    const bool known = current() != nullptr && current()->sample(time, settings_.interpolation, there);
    if (!known) {
      there = run_.state;
      response.message =
          current() == nullptr || !current()->begun()
              ? "no trajectory has started yet; query again after the next update"
              : fmt::format("{:.3f} s is before the start of the trajectory at {:.3f} s; query a later time",
                            to_seconds(time), to_seconds(current()->start_time()));
    } else if (time >= current()->end_time()) {
      response.message = fmt::format(
          "{:.3f} s is at or after the end of the trajectory at {:.3f} s, after which it repeats its last "
          "point; query an earlier time",
          to_seconds(time), to_seconds(current()->end_time()));
    }
    response.success = response.message.empty();
    response.position = there.positions;
    response.velocity = there.velocities;
    response.acceleration = there.accelerations;
  }
  if (!response.success) warn("control.jtc_no_state", "query_state: " + response.message, "");
}

}  // namespace doppel
