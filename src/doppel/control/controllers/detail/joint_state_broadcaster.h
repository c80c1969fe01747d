#pragma once
// Publishes the state interfaces of the hardware on /joint_states (sensor_msgs/msg/JointState) and
// /dynamic_joint_states (control_msgs/msg/DynamicJointState), in the order of the hardware. Compatible
// with ros2_controllers' broadcaster.

#include <map>
#include <string>
#include <vector>

#include "doppel/control/manager/controller.h"
#include "doppel/ros/messages/control_msgs.h"
#include "doppel/ros/messages/sensor_msgs.h"

namespace doppel {

class JointStateBroadcaster : public Controller {
 public:
  void on_init(ControllerContext& context) override;
  [[nodiscard]] InterfaceConfiguration command_interfaces() const override { return {}; }
  [[nodiscard]] InterfaceConfiguration state_interfaces() const override;
  Status on_activate() override;
  void update(Time now, Duration /*period*/) override { publish_state(now); }
  void publish_state(Time now) override;

 private:
  // The place of a state handle's value in a message.
  struct Link {
    std::size_t handle = 0, row = 0, column = 0;
  };
  void lay_out_joint_states();
  void lay_out_dynamic_joint_states();
  [[nodiscard]] bool belongs_in_joint_states(const std::string& prefix) const;

  const ControllerContext* context_ = nullptr;
  std::vector<std::string> joints_, interfaces_, extra_joints_;
  std::map<std::string, int> field_of_;  // interface name -> 0 position, 1 velocity, 2 effort
  bool only_model_joints_ = true;

  Bus* bus_ = nullptr;
  Publisher<sensor_msgs::msg::JointState> states_topic_;
  Publisher<control_msgs::msg::DynamicJointState> dynamic_topic_;
  sensor_msgs::msg::JointState states_;  // both are sized at activation, and only filled in the loop
  control_msgs::msg::DynamicJointState dynamic_;
  std::vector<Link> to_states_, to_dynamic_;
};

}  // namespace doppel
