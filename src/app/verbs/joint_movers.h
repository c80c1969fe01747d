#pragma once
// The controllers that bring joints to positions: trajectory, gripper action and forward controllers.

#include <memory>
#include <string>
#include <vector>

#include "app/verbs/controllers.h"
#include "app/verbs/robot_watch.h"

namespace doppel::app {

// One controller with the target positions of its joints.
class JointMover {
 public:
  JointMover(std::string controller, Positions targets)
      : controller_(std::move(controller)), targets_(std::move(targets)) {}
  virtual ~JointMover() = default;
  JointMover(const JointMover&) = delete;
  JointMover& operator=(const JointMover&) = delete;

  [[nodiscard]] const std::string& controller() const { return controller_; }
  [[nodiscard]] const Positions& targets() const { return targets_; }
  // True if the duration of the motion is that of the command; a gripper moves at a speed of its own.
  [[nodiscard]] virtual bool is_timed() const { return true; }
  // True if commands are sent until the end of the motion, not only at its start.
  [[nodiscard]] virtual bool sends_all_the_way() const { return false; }
  // Throws ClientError with the reason if the controller refuses the command.
  virtual void start(Client& twin, const RobotWatch& robot, double seconds) = 0;
  // True if the command is completed; called with every state of the joints.
  virtual bool is_finished(const RobotWatch& robot) = 0;
  virtual void cancel(const RobotWatch& robot) = 0;
  // After the end: what the controller reports as an error; "": success.
  [[nodiscard]] virtual std::string problem() const = 0;

 private:
  std::string controller_;
  Positions targets_;
};

// The movers for the targets. `only`: the name of the controller to use; empty: any. Throws InputError for a
// joint that no controller can bring to a position, ClientError if the controller that could is not active,
// with the reason.
std::vector<std::unique_ptr<JointMover>> assign_movers(Client& twin, const RobotWatch& robot,
                                                       const std::string& manager, const Positions& targets,
                                                       const std::string& only);

}  // namespace doppel::app
