#pragma once
// ros2_control's hardware, played by a physics engine: each <ros2_control> system of the description becomes
// one of these. A claimed interface chooses the joint's drive (position before velocity before effort); an
// unclaimed joint is limp.

#include <memory>
#include <vector>

#include "doppel/control/hardware.h"
#include "doppel/core/diagnostic.h"
#include "doppel/description/robot_description.h"
#include "doppel/physics/engine.h"

namespace doppel {

class SimulatedHardware : public SystemInterface {
 public:
  // Joints that the model lacks are errors in `diagnostics`, fixed ones and commanded mimics warnings; they
  // are left out.
  SimulatedHardware(const HardwareDescription& description, Instance instance, Diagnostics& diagnostics);

  // Another instance of a model with the same joints takes over: what is claimed drives there, too.
  void rebind(Instance instance);

  [[nodiscard]] const std::string& name() const override { return name_; }
  [[nodiscard]] const std::string& plugin() const override { return plugin_; }
  [[nodiscard]] std::vector<InterfaceDescription> state_interfaces() const override;
  [[nodiscard]] std::vector<InterfaceDescription> command_interfaces() const override;
  Status activate() override { return {}; }
  Status deactivate() override;
  Status prepare_switch(std::span<const std::string> start, std::span<const std::string> stop) override;
  void perform_switch(std::span<const std::string> start, std::span<const std::string> stop) override;
  void read(Time now, Duration period, std::span<double> states) override;
  void write(Time now, Duration period, std::span<const double> commands) override;

 private:
  enum class Quantity { position, velocity, effort, constant };
  struct Interface {
    InterfaceDescription description;
    int joint = -1;
    Quantity quantity = Quantity::constant;
    bool claimed = false;  // command interfaces only
  };
  void choose_drive(int joint);
  [[nodiscard]] double nearest_turn(const Interface& command, double value) const;

  std::string name_, plugin_;
  Instance instance_;
  std::vector<Interface> states_, commands_;
};

// A system for a description without <ros2_control>: position commands, position, velocity and effort states
// for every driven joint, and states of the mimics.
HardwareDescription generated_hardware(const Model& model);

// What the plugin's name means to doppel; a note or a warning for the user says so.
void report_plugin(const HardwareDescription& hardware, Diagnostics& diagnostics);

// q with every position state interface's initial_value written into `q`; values outside the limits are
// warnings.
void apply_initial_values(const RobotDescription& robot, const Model& model, Eigen::VectorXd& q,
                          Diagnostics& diagnostics);

}  // namespace doppel
