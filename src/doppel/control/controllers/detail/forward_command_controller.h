#pragma once
// Controllers that forward ~/commands (std_msgs/msg/Float64MultiArray) to command interfaces, one number
// each. They write nothing until the first message; with the parameter command_timeout (s; 0: never) they
// write zero to all interfaces but positions after that time without a message. Compatible with
// ros2_controllers' forward_command_controller and its groups.

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "doppel/control/hardware/hardware.h"
#include "doppel/control/manager/controller.h"
#include "doppel/ros/messages/std_msgs.h"

namespace doppel {

// The common base. A message has one value for each interface that the YAML lists; those of mimic joints,
// which cannot be commanded, are ignored.
class CommandForwarder : public Controller {
 public:
  [[nodiscard]] InterfaceConfiguration command_interfaces() const override;
  [[nodiscard]] InterfaceConfiguration state_interfaces() const override { return {}; }
  Status on_activate() override;
  Status on_deactivate() override;
  void update(Time now, Duration period) override;
  void housekeeping(Time now) override;

 protected:
  // `listed`: the interfaces of a message, in order; `driven`: those that are claimed. on_stop:
  // written at deactivation.
  void forward(ControllerContext& context, std::vector<std::string> listed, std::vector<std::string> driven,
               std::optional<double> on_stop = std::nullopt);
  void receive(const std_msgs::msg::Float64MultiArray& message);
  [[nodiscard]] std::size_t listed_count() const { return listed_.size(); }
  // Written from the activation until the first message; NaN: nothing is.
  void start_with(double value) { initial_ = value; }

 private:
  std::string name_;
  const Log* log_ = nullptr;
  std::vector<std::string> listed_, driven_;
  std::vector<std::size_t> source_;  // of each driven interface: its index in a message
  std::optional<double> on_stop_;
  double initial_ = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> values_;  // of the last message, one for each driven interface
  std::vector<bool> stops_;     // of each driven interface: zero is no motion
  Duration timeout_{};          // zero: commands hold forever
  Time last_message_{};
  bool message_came_ = false, timed_out_ = false, timeout_logged_ = false;
  bool active_ = false, commanded_ = false, error_logged_ = false;
};

// Parameters: joints, interface_name.
class ForwardCommandController : public CommandForwarder {
 public:
  void on_init(ControllerContext& context) override;
};

// Parameters: joint, interface_names.
class MultiInterfaceForwardCommandController : public CommandForwarder {
 public:
  void on_init(ControllerContext& context) override;
};

// Parameter: joints. Velocity and effort go to zero when it is deactivated.
class JointGroupController : public CommandForwarder {
 public:
  explicit JointGroupController(std::string interface) : interface_(std::move(interface)) {}
  void on_init(ControllerContext& context) override;

 private:
  std::string interface_;
};

// One number for all its joints, also as ~/command (std_msgs/msg/Float64), as the joint plugins of gz-sim read it.
// Parameters: joints, interface_name, initial_value (NaN: none). Velocity and effort go to zero when it is deactivated.
class ScalarCommandController : public CommandForwarder {
 public:
  void on_init(ControllerContext& context) override;
};

}  // namespace doppel
