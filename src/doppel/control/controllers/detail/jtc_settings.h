#pragma once
// The parameters of a joint_trajectory_controller, by ros2_controllers' names and defaults. Between steps.

#include <array>
#include <string>
#include <vector>

#include "doppel/control/controllers/detail/pid.h"
#include "doppel/control/controllers/detail/tolerances.h"
#include "doppel/control/controllers/detail/trajectory.h"
#include "doppel/control/manager/controller.h"

namespace doppel::jtc {

// In the order of Field.
enum class Kind : std::uint8_t { position = 0, velocity = 1, acceleration = 2, effort = 3 };
inline constexpr std::size_t kKinds = 4;
inline constexpr std::size_t index(Kind kind) {
  return static_cast<std::size_t>(kind);
}

// Settings that are fixed once the controller is loaded.
struct Settings {
  std::vector<std::string> joints;          // of the controller
  std::vector<std::string> ignored;         // listed in the YAML, but without a drive (mimics)
  std::vector<std::string> command_joints;  // names in the command interfaces
  std::vector<std::string> command_interfaces, state_interfaces;
  std::array<bool, kKinds> commanded{}, measured{};
  std::string scaling_state, scaling_command;  // full names; empty: none
  double initial_scaling = 1;
  bool interpolate_from_desired = false;  // start from the last command instead of the measured state
  bool seed_from_commands = true;         // at activation the present commands are the initial state
  bool decelerate_on_cancel = false;
  std::vector<double> max_deceleration;  // [joints] rad/s^2 or m/s^2
  double action_monitor_rate = 20;       // Hz
  Interpolation interpolation = Interpolation::splines;

  [[nodiscard]] bool commands(Kind kind) const { return commanded[index(kind)]; }
  [[nodiscard]] bool measures(Kind kind) const { return measured[index(kind)]; }
  [[nodiscard]] bool commands_only(Kind kind) const {
    return commands(kind) && command_interfaces.size() == 1;
  }
  // With velocity or effort alone the controller closes the position loop.
  [[nodiscard]] bool runs_pid() const { return commands_only(Kind::velocity) || commands_only(Kind::effort); }
};

// Settings that can be changed at run time.
struct Tuning {
  bool allow_partial_joints = false, allow_integration = false, allow_nonzero_velocity_at_end = false;
  double cmd_timeout = 0;           // s after the last point; 0: none
  std::vector<PidGains> gains;      // [joints]
  std::vector<double> feedforward;  // [joints] ff_velocity_scale
  Tolerances tolerances;            // defaults
};

// Declares every parameter. Throws InputError for invalid values, with their place in the YAML.
Settings declare_settings(ControllerContext& context);

// Reads the present parameters. `tuning` is unchanged if they are inconsistent.
Status read_tuning(const Parameters& parameters, const Settings& settings, Tuning& tuning);

// Refuses with the reason why this combination cannot be configured. `joint_of_command`: output, the index of
// each command joint in `joints`.
Status check_configuration(const Settings& settings, std::vector<std::size_t>& joint_of_command);

// Logs settings that are written but have no effect.
void warn_of_idle_settings(const ControllerContext& context, const Settings& settings, const Tuning& tuning);

}  // namespace doppel::jtc
