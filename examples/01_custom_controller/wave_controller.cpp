// A controller from outside of doppel: moves one joint along a sine. Run it with
//   doppel up lab_arm --plugin build/examples/libwave_controller.so --controllers
//   examples/01_custom_controller/wave.yaml
#include <cmath>
#include <numbers>

#include "doppel/control/manager/controller.h"
#include "doppel/ros/bus/parameter_file.h"

namespace wave_controller {

class WaveController : public doppel::Controller {
 public:
  void on_init(doppel::ControllerContext& context) override {
    auto& parameters = context.node->parameters();
    joint_ = doppel::declare<std::string>(parameters, context.overrides, "joint", "",
                                          {"Which joint waves", false, {}});
    amplitude_ = doppel::declare(parameters, context.overrides, "amplitude", 0.3, {"rad", false, {}});
    frequency_ = doppel::declare(parameters, context.overrides, "frequency", 0.5, {"Hz", false, {}});
    if (context.model->find_joint(joint_) < 0) {
      throw doppel::InputError("wave.joint", {}, context.name + ": the robot has no joint '" + joint_ + "'",
                               "set the parameter 'joint' in the controllers' YAML");
    }
  }

  [[nodiscard]] doppel::InterfaceConfiguration command_interfaces() const override {
    return {doppel::InterfaceConfiguration::Kind::individual, {joint_ + "/position"}};
  }
  [[nodiscard]] doppel::InterfaceConfiguration state_interfaces() const override {
    return command_interfaces();
  }

  doppel::Status on_activate() override {
    centre_ = state_handles[0].get();
    elapsed_s_ = 0.0;
    return {};
  }

  void update(doppel::Time /*now*/, doppel::Duration period) override {
    elapsed_s_ += doppel::to_seconds(period);
    command_handles[0].set(centre_ + amplitude_ * std::sin(2.0 * std::numbers::pi * frequency_ * elapsed_s_));
  }

 private:
  std::string joint_;
  double amplitude_ = 0, frequency_ = 0, centre_ = 0, elapsed_s_ = 0;
};

}  // namespace wave_controller

DOPPEL_EXPORT_CONTROLLER(wave_controller::WaveController, "wave_controller/WaveController")
