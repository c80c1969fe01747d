#pragma once
// A PID controller for each degree of freedom, from ~/reference (control_msgs/msg/MultiDOFCommand), or from
// the controller before it in a chain, and a measured state to one command interface; publishes
// ~/controller_state. Compatible with ros2_controllers' pid_controller.

#include <string>
#include <vector>

#include "doppel/control/controllers/detail/pid.h"
#include "doppel/control/manager/controller.h"
#include "doppel/ros/messages/control_msgs.h"
#include "doppel/ros/messages/std_srvs.h"

namespace doppel {

class PidController : public Controller {
 public:
  void on_init(ControllerContext& context) override;
  [[nodiscard]] InterfaceConfiguration command_interfaces() const override;
  [[nodiscard]] InterfaceConfiguration state_interfaces() const override;
  Status on_activate() override;
  Status on_deactivate() override;
  void update(Time now, Duration period) override;
  [[nodiscard]] std::vector<std::string> reference_interfaces() const override;
  void set_chained_mode(bool chained) override;

 private:
  struct Dof {
    std::string name, measured;  // the commanded one; the one of the measured state
    Pid pid;
    double feedforward = 0;
    bool wraps = false;     // an angle whose error is the shortest rotation
    double last_error = 0;  // NaN: none yet
  };
  void declare_names(ControllerContext& context);
  void declare_gains(ControllerContext& context, Dof& dof);
  Status take_gains(const Parameters& parameters, Dof& dof);
  void listen_to_gains(ControllerContext& context);
  void declare_topics(ControllerContext& context);
  void receive(const control_msgs::msg::MultiDOFCommand& message);
  [[nodiscard]] std::string fault_of(const control_msgs::msg::MultiDOFCommand& message) const;
  void step(std::size_t index, double dt);
  void follow(std::size_t index, double reference, double reference_dot);

  std::string name_, command_interface_;
  const Log* log_ = nullptr;
  const Bus* bus_ = nullptr;
  std::vector<std::string> interfaces_;  // one or two: of reference and measured state
  std::vector<Dof> dofs_;
  bool use_feedforward_ = false, active_ = false, error_logged_ = false;
  bool chained_ = false;  // another controller writes the references
  Publisher<control_msgs::msg::MultiDOFStateStamped> state_topic_;
  control_msgs::msg::MultiDOFStateStamped state_;
};

}  // namespace doppel
