#pragma once
// Follows joint trajectories from ~/joint_trajectory and the action ~/follow_joint_trajectory, checks them
// against tolerances and publishes ~/controller_state. Behaves as ros2_controllers'
// joint_trajectory_controller (Jazzy); behaviour that harms users without notice there is kept, but logged.
//
// Messages are checked and reordered between steps; update() only swaps pointers, samples and writes. Where
// the guard of the hardware rehearses paths (command_guard.h), a trajectory waits until it has passed: its
// goal is accepted, and executing from then on.

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "doppel/control/controllers/detail/jtc_interfaces.h"
#include "doppel/control/controllers/detail/jtc_settings.h"
#include "doppel/control/controllers/detail/pid.h"
#include "doppel/control/controllers/detail/tolerances.h"
#include "doppel/control/controllers/detail/trajectory.h"
#include "doppel/control/controllers/detail/trajectory_message.h"
#include "doppel/control/manager/command_guard.h"
#include "doppel/control/manager/controller.h"
#include "doppel/ros/bus/action_server.h"
#include "doppel/ros/messages/control_msgs.h"

namespace doppel {

class JointTrajectoryController : public Controller {
 public:
  JointTrajectoryController();
  ~JointTrajectoryController() override;

  void on_init(ControllerContext& context) override;
  [[nodiscard]] InterfaceConfiguration command_interfaces() const override;
  [[nodiscard]] InterfaceConfiguration state_interfaces() const override;
  Status on_configure() override;
  Status on_activate() override;
  Status on_deactivate() override;
  Status on_cleanup() override;
  void update(Time now, Duration period) override;
  void housekeeping(Time now) override;
  [[nodiscard]] double followed_value(std::string_view interface) const override;
  [[nodiscard]] double housekeeping_rate() const override;
  [[nodiscard]] bool save(SavedSlot& slot) const override;
  void restore(const SavedPart& saved, Time now) override;
  void abort_goals(const std::string& why) override;

 private:
  using FollowJointTrajectory = control_msgs::action::FollowJointTrajectory;
  using TrajectoryMessage = trajectory_msgs::msg::JointTrajectory;
  using QueryState = control_msgs::srv::QueryTrajectoryState;

  // The end of a trajectory: set in the loop, reported between steps.
  struct Ending {
    enum class Kind { none, reached, canceled, path_violated, goal_missed, timed_out } kind = Kind::none;
    std::optional<GoalId> goal;  // none: the trajectory is from the topic
    jtc::Violation worst;
    double trajectory_time = 0;  // s since the trajectory's start
    double late = 0;             // s since its last point
  };

  // The trajectory of a message is `received` until it is followed; the controller makes the others itself.
  enum class Source : std::uint8_t { none, received, followed, hold_0, hold_1, stop };
  // Everything that changes while the controller runs.
  struct Run {
    double cmd_timeout = 0;      // s; 0: none
    jtc::Tolerances tolerances;  // of the present trajectory
    double scaling = 1, scaling_command = 1;
    bool scaling_unusable = false, scaling_reported = false;

    // `current` is followed now, `next` from the next update.
    Source current = Source::none, next = Source::none;
    jtc::ReceivedTrajectory received, followed;  // the one not in use is freed between steps
    std::array<jtc::Trajectory, 2> holds;
    jtc::Trajectory stop;
    bool holding = true;  // tolerances are not checked

    Time trajectory_time{};  // advances with the speed scaling
    std::optional<Time> last_commanded_time;
    jtc::JointStates state, desired, command, last_commanded, error;
    std::vector<double> pid_command;
    Duration reference_time{}, feedback_time{};

    std::optional<GoalId> goal;
    bool followed_goal = false;  // at least one update since it was accepted
    std::optional<Ending> goal_ended, topic_ended;
  };
  struct Saved {
    Run run;
    std::vector<PidMemory> pids;
  };
  // A trajectory that is rehearsed.
  struct Pending {
    TrajectoryMessage message;
    std::optional<GoalId> goal = {};  // none: it is from the topic
    jtc::Tolerances tolerances = {};  // of the goal
    std::unique_ptr<Rehearsal> rehearsal = nullptr;
    Time begun{};
    std::vector<double> positions = {};  // [joints] at the beginning
  };

  // -- life cycle (joint_trajectory_controller.cpp)
  void configure_deceleration();
  void seed_states();
  void take_tuning(const std::string& changed);

  // -- in the loop (joint_trajectory_controller_update.cpp)
  void take_next();
  void exchange_scaling();
  void follow(Time now, Duration period);
  void begin_trajectory(Time now);
  void compute_errors();
  [[nodiscard]] Ending check_goal(bool first);
  void write_commands(Time now, Duration period);
  void end_with(const Ending& ending);
  void hold_at(std::span<const double> positions);
  void stop();
  [[nodiscard]] jtc::Trajectory* trajectory(Source source);
  [[nodiscard]] jtc::Trajectory* current() { return trajectory(run_.current); }
  [[nodiscard]] Source free_hold() const {
    return run_.current == Source::hold_0 ? Source::hold_1 : Source::hold_0;
  }

  // -- input and output, between steps (joint_trajectory_controller_io.cpp)
  void open_topics();
  void size_state_message();
  void publish_controller_state(Time now);
  void fill_output();
  void receive(const TrajectoryMessage& received);
  [[nodiscard]] TrajectoryMessage in_own_time(TrajectoryMessage message) const;
  void set_scaling(double factor);
  Status accept_goal(const GoalId& id, const FollowJointTrajectory::Goal& goal);
  Status cancel_goal(const GoalId& id);
  Status check(const TrajectoryMessage& message) const;
  [[nodiscard]] std::vector<double> held_positions() const;
  void follow_goal(const GoalId& id, const TrajectoryMessage& message, jtc::Tolerances tolerances);
  [[nodiscard]] jtc::ReceivedTrajectory trajectory_of(const TrajectoryMessage& message) const;
  void adopt(const TrajectoryMessage& message);
  void warn_of_stamp(const TrajectoryMessage& message);
  void send_feedback(Time now);
  void report_endings();
  void finish(const GoalId& id, GoalStatus status, std::int32_t code, std::string text);
  [[nodiscard]] std::string describe(const Ending& ending) const;
  void answer_query(const QueryState::Request& request, QueryState::Response& response);
  [[nodiscard]] Time now() const { return context_->node->bus().now(); }
  void warn(const char* rule, std::string message, std::string fix) const;

  // -- the guard, between steps (joint_trajectory_controller_guard.cpp)
  [[nodiscard]] bool is_guarded() const;
  void preview(const TrajectoryMessage& message, const std::function<void(const GuardedPath&)>& use) const;
  [[nodiscard]] Status check_path(const TrajectoryMessage& message) const;
  // False: trajectories are followed without it.
  bool rehearse(Pending pending);
  void attend_rehearsal();
  [[nodiscard]] bool has_moved_since(const Pending& pending) const;
  void drop_pending(const std::string& why);

  ControllerContext* context_ = nullptr;
  jtc::Settings settings_;
  jtc::Tuning tuning_;
  std::vector<std::size_t> joint_of_command_;
  std::vector<bool> wraps_;   // [joints] continuous
  std::vector<Pid> pids_;     // [command joints]; empty: no PID
  bool decelerates_ = false;  // on cancel and abort, instead of holding at once
  bool active_ = false;

  jtc::Interfaces interfaces_;
  Run run_;
  std::optional<Pending> pending_;
  Time next_report_{};  // where rehearsals need a higher rate than reports

  std::unique_ptr<ActionServer<FollowJointTrajectory>> action_;

  Publisher<control_msgs::msg::JointTrajectoryControllerState> state_topic_;
  control_msgs::msg::JointTrajectoryControllerState state_message_;
};

}  // namespace doppel
