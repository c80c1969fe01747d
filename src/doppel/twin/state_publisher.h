#pragma once
// robot_state_publisher and the clock: robot_description and /tf_static (latched), /tf, /clock. TF is
// computed from the true state of every joint, mimics included, and not from joint_states. Without simulated
// time on the bus there is no clock.

#include <memory>
#include <optional>

#include "doppel/bus/bus.h"
#include "doppel/control/parameter_file.h"
#include "doppel/description/robot_description.h"
#include "doppel/kinematics/model.h"
#include "doppel/messages/rosgraph_msgs.h"
#include "doppel/messages/std_msgs.h"
#include "doppel/messages/tf2_msgs.h"

namespace doppel {

class StatePublisher {
 public:
  // `model` has to outlive it. X_WR: the root link in the world. Where no link is called "world", /tf_static
  // has the root link in a frame of that name; where one is, and the world file moves it, the engine's world
  // is the frame "ground". `file`: what is written of the node's parameters; may be null. Throws InputError
  // where one of them cannot be used.
  StatePublisher(Bus& bus, const RobotDescription& robot, const Model& model, const Pose& X_WR,
                 const ParameterFile* file = nullptr);

  // In the loop: no allocation, no lock, no throw. q: [model.nq].
  void publish_transforms(Time now, const Eigen::Ref<const Eigen::VectorXd>& q);
  void publish_clock(Time now);  // with simulated time only
  // Between steps, at the start and after a reset of time.
  void publish_latched(Time now);
  // Between two publications of /tf; zero: at every step.
  [[nodiscard]] Duration period() const { return period_; }

 private:
  void declare_parameters(const RobotDescription& robot, ParameterOverrides& parameters);
  void collect_transforms(const Pose& X_WR);
  void set_frame_prefix(const std::string& prefix);

  const Model& model_;
  Node node_;
  std::optional<Node> clock_node_;
  Publisher<std_msgs::msg::String> description_;
  Publisher<tf2_msgs::msg::TFMessage> tf_, tf_static_;
  Publisher<rosgraph_msgs::msg::Clock> clock_;
  std_msgs::msg::String description_message_;
  tf2_msgs::msg::TFMessage moving_, fixed_;
  std::string frame_prefix_;
  Duration period_{20'000'000};
  std::vector<std::size_t> moving_joints_;
};

}  // namespace doppel
