#pragma once
// ros2_control hardware simulated by a physics engine: used for each <ros2_control> component of the
// description without registered real hardware. The claimed command interface determines the joint's drive
// (position before velocity before effort); <param name="unclaimed"> sets the behaviour of an unclaimed
// joint: free (the default), hold or brake.

#include <limits>
#include <memory>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/control/hardware/hardware.h"
#include "doppel/control/hardware/hardware_registry.h"
#include "doppel/description/gazebo/simulator_plugins.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"
#include "doppel/physics/contract/engine.h"
#include "doppel/sensors/models/sensor_binding.h"
#include "doppel/sensors/rigs/sensor_readings.h"

namespace doppel {

class DOPPEL_API SimulatedHardware : public HardwareComponent {
 public:
  explicit SimulatedHardware(Instance robot) : robot_(robot) {}

  // Between ticks: what the <sensor>s of the description read, in place of what they read before; sensors
  // that stay keep their start. A state interface without a sensor keeps its initial value, or NaN.
  void use_sensors(const SensorBindings& bindings, std::unique_ptr<SensorReadings> readings);
  // Between ticks: the sensors that `before` has, too, keep its start and noise.
  void resume_sensors(const SimulatedHardware& before) {
    if (readings_ && before.readings_) readings_->resume(*before.readings_, robot_.engine().time());
  }
  // Continues with another instance of a model with the same joints: the drives are set there, too.
  void rebind(Instance robot);
  // The state was reset: it is that of the start for its sensors.
  void restart_sensors() {
    forget_efforts();
    if (readings_) readings_->restart(robot_.engine());
  }
  // The state was written; its sensors keep their start and their noise.
  void state_written() {
    forget_efforts();
    if (readings_) readings_->state_written();
  }
  // In the loop, before the step at whose end it is read.
  void before_step() {
    if (readings_) readings_->before_step(robot_.engine());
  }
  // In the loop, after each step. The effort that is read is the mean of the steps since the last reading, as
  // of a drive that filters its current: at each command a stiff drive's effort rises and decays within a few
  // steps, so that one step of a cycle says little about the others.
  void after_step();
  // In the loop: the values of its sensors as they were read, for the hash of the state.
  [[nodiscard]] const SensorReadings* readings() const { return readings_.get(); }
  [[nodiscard]] std::size_t sensor_count() const { return sensors_; }

  // Unknown joints, fixed joints and commanded mimics are left out with warnings. Throws InputError for an
  // invalid value of `unclaimed`.
  Status on_init(const HardwareInfo& info) override;
  [[nodiscard]] std::vector<InterfaceDescription> state_interfaces() const override;
  [[nodiscard]] std::vector<InterfaceDescription> command_interfaces() const override;
  Status on_activate() override;
  Status on_deactivate() override;
  Status prepare_switch(std::span<const std::string> start, std::span<const std::string> stop) override;
  void perform_switch(std::span<const std::string> start, std::span<const std::string> stop) override;
  [[nodiscard]] PassiveJoint when_unclaimed() const override { return unclaimed_; }
  void on_stop() override;
  void on_stop_reset() override;
  HardwareReturn read(Time now, Duration period, std::span<double> states) override;
  HardwareReturn write(Time now, Duration period, std::span<const double> commands) override;
  // The drives are part of the engine, which is restored before.
  [[nodiscard]] bool save(SavedSlot& slot) const override;
  void restore(const SavedPart& saved) override;

 private:
  enum class Quantity { position, velocity, effort, sensor, constant };
  struct StepMean {
    double sum = 0;  // over the steps since the last reading
    int steps = 0;
    double mean = std::numeric_limits<double>::quiet_NaN();  // of the last reading that had steps
  };
  struct Interface {
    InterfaceDescription description;
    int joint = -1;
    Quantity quantity = Quantity::constant;
    bool claimed = false;     // command interfaces only
    SensorValue sensed = {};  // of Quantity::sensor
    StepMean effort = {};     // of Quantity::effort
  };
  struct Saved {
    std::vector<bool> claimed;  // [commands]
    bool active = false, stopped = false;
    std::vector<StepMean> efforts;  // [states]
    SavedSlot readings;
  };
  static Quantity quantity_of(const std::string& interface);
  void add_joint(const HardwareJointDescription& joint, const HardwareInfo& info);
  void add_sensor(const HardwareJointDescription& sensor);
  void bind_states();
  void add_part(const HardwareJointDescription& part);
  void choose_drives();
  void forget_efforts();
  [[nodiscard]] DriveMode drive_of(int joint) const;
  [[nodiscard]] double nearest_turn(const Interface& command, double value) const;

  Instance robot_;
  std::vector<Interface> states_, commands_;
  std::vector<std::vector<std::optional<SensorValue>>> bound_;  // [sensors][state interfaces]
  std::vector<std::size_t> first_states_;                       // [sensors], in states_
  std::unique_ptr<SensorReadings> readings_;                    // nullptr: no sensor is bound
  std::size_t sensors_ = 0;                                     // in `readings_`
  std::vector<int> driven_;                                     // joints with a command interface, each once
  PassiveJoint unclaimed_ = PassiveJoint::free;
  bool active_ = false, stopped_ = false;
};

// Registers SimulatedHardware under the plugin names of the simulators.
DOPPEL_API void register_simulated_hardware(HardwareRegistry& registry, Instance robot);

// A generated component for a description without <ros2_control>: a system with position commands, position,
// velocity and effort states for every driven joint, and states of the mimics.
DOPPEL_API HardwareDescription generated_hardware(const Model& model);

// Real: the type that is registered under the plugin's name drives real hardware. Driver: doppel has one for
// it, which is not used now. Simulated: it has none.
enum class PluginUse { real, driver, simulated };
// For messages: how hardware without a driver here is driven.
inline constexpr const char* kWaysToHardware =
    "servos: <plugin>doppel/FeetechSts</plugin> (or doppel/DynamixelX, doppel/ServoLine) with port and ids "
    "in "
    "hardware.yaml; an arm that another node drives: doppel/Topic; a driver of your own: --plugin LIBRARY "
    "(doppel man hardware)";
// Reports by a note or a warning how a plugin name is treated.
DOPPEL_API void report_plugin(const HardwareDescription& hardware, PluginUse use, Diagnostics& diagnostics);
// Reports by a note that the devices of a plugin are emulated.
DOPPEL_API void report_emulated(const HardwareDescription& hardware, Diagnostics& diagnostics);

// Writes the initial_value of every position state interface into `q` [nq] (rad, m); values outside the
// limits are warnings.
DOPPEL_API void apply_initial_values(const RobotDescription& robot, const Model& model, Eigen::VectorXd& q,
                                     Diagnostics& diagnostics);

}  // namespace doppel
