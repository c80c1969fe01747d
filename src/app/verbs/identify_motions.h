#pragma once
// The motions of an identification, one goal of a trajectory controller after the other, with the releases of
// single joints between them.

#include <chrono>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "app/verbs/client_recorder.h"
#include "app/verbs/goals.h"
#include "app/verbs/robot_watch.h"
#include "doppel/review/identification/motion_plan.h"

namespace doppel::app {

// A trajectory controller of positions, and where it holds its joints.
struct Arm {
  std::string node;  // "/omarm_arm_controller"
  std::vector<std::string> joints;
  Positions held;
};

struct MotionPart {
  const Arm* arm = nullptr;
  std::string joint;
  std::vector<Waypoint> path;
  bool rehearsal = false;
  // A motion from where the joint is to `target`, slowly; then its torque goes off.
  std::optional<double> target = {};
  std::optional<PlannedRelease> release = {};
};

// At rest behind it.
std::vector<Waypoint> slow_path(const ModelJoint& joint, double start, double target);

// Sends one goal after the other while the recorder runs; rehearsals are not recorded. Behind the goal of a
// release it waits until the device reports that the joint is caught.
class Motions {
 public:
  // The topic of the devices, and the service that releases one joint.
  Motions(Client& twin, const RobotWatch& robot, std::string devices, std::string service,
          std::deque<MotionPart> parts);

  void look(ClientRecorder& recorder);
  void take(const Client::Received& message);
  // Stops the arm where it is.
  void cancel();
  [[nodiscard]] const std::string& problem() const { return problem_; }

 private:
  using Clock = std::chrono::steady_clock;
  void end(const GoalOutcome& outcome);
  void start(ClientRecorder& recorder);
  void release();

  Client& twin_;
  const RobotWatch& robot_;
  const std::string devices_, service_;
  std::deque<MotionPart> parts_;
  std::optional<ActionGoal> goal_;
  std::optional<PlannedRelease> release_;  // behind the present goal
  std::optional<double> place_;            // where the joint is held
  bool falls_ = false;
  Clock::time_point falls_until_;
  double before_ = 0;  // s, the last release's begin
  std::string joint_, problem_;
};

}  // namespace doppel::app
