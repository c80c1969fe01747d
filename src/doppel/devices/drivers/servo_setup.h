#pragma once
// The setup of a component of servos: its <param>s, and config/hardware.yaml of its package, which wins,
// because it belongs to one machine and the description to all of its kind. docs/hardware.md lists the
// keys.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "doppel/control/hardware/hardware.h"
#include "doppel/devices/servos/servo_model.h"
#include "doppel/export.h"

namespace doppel {

// Registers of a servo that a calibration has written, in ticks.
struct RecordedCalibration {
  int homing_offset = 0;
  int range_min = 0, range_max = 0;  // the position limits, behind the homing offset
};

// The servo of a joint, and how it is mounted: shaft = direction * scale * joint + offset.
struct DOPPEL_API JointServo {
  std::string joint;
  int id = 0;                         // of the servo on its bus; of a line's board the channel
  const ServoModel* model = nullptr;  // nullptr: a hobby servo
  int direction = 1;
  double scale = 1;         // shaft per joint: a gear or a linkage between them
  double offset = 0;        // rad: the shaft's angle at the joint's zero; 0 is the middle of its travel
  bool calibrated = false;  // direction and offset were given, not assumed
  bool enabled = true;      // false: its torque stays off
  bool gripper = false;     // it is meant to stall

  // Hobby servos: pulses in microseconds at the ends of the travel, and their angle.
  double pulse_min = 500, pulse_max = 2500;
  double travel = 3.14159265358979;  // rad

  double lower = 0, upper = 0;                  // of the joint, within a recorded calibration
  double velocity = 0;                          // rad/s
  double effort = 0;                            // N m
  std::optional<RecordedCalibration> recorded;  // the zero of `shaft` is behind its homing offset
  SourceLocation source;

  [[nodiscard]] double shaft(double joint_position) const {
    return direction * scale * joint_position + offset;
  }
  [[nodiscard]] double joint_position(double shaft) const { return direction * (shaft - offset) / scale; }
};

enum class AtDeactivation { hold, relax, park };
enum class GentleMode { until_checked, always, never };

struct DOPPEL_API ServoSetup {
  std::string component;
  ServoProtocol protocol = ServoProtocol::feetech;
  std::string port;  // "auto": the only one that there is
  int rate = 0;      // bit/s
  std::vector<JointServo> joints;

  int max_lost_replies = 5;  // cycles in a row, after which the joints hold
  double fault_after = 0.5;  // s without an answer
  double torque = 1;         // share of the stall torque, after the ramp
  double gripper_torque = 0.5;
  double watchdog = 0.3;   // s of silence, of devices that have one
  bool fast_reads = true;  // Dynamixel's fast sync read
  AtDeactivation at_deactivation = AtDeactivation::hold;
  std::vector<std::pair<std::string, double>> park;  // joint positions
  GentleMode gentle = GentleMode::until_checked;
  bool confirm_pose = true;  // hobby servos: a person confirms the pose after each loss of power
  bool park_on_exit = false;
  std::filesystem::path file;  // hardware.yaml; empty: none was found
};

// The usual rate of a protocol, bit/s.
[[nodiscard]] DOPPEL_API int default_rate(ServoProtocol protocol);

// The plugin names of drivers of servos and their protocols.
struct ServoPlugin {
  std::string_view name;
  ServoProtocol protocol;
};
[[nodiscard]] DOPPEL_API std::span<const ServoPlugin> servo_plugins();
[[nodiscard]] DOPPEL_API bool is_servo_plugin(std::string_view plugin);

// Throws InputError with all errors at their places: unknown keys with the nearest one, units, ranges, an
// id used twice, a joint without an id, a speed limit that is missing. Assumptions are warnings: a
// direction or an offset that is not written.
[[nodiscard]] DOPPEL_API ServoSetup read_servo_setup(const HardwareDescription& description,
                                                     const Model& model, Diagnostics& diagnostics);

// The servo that drives a joint. Throws InputError with the nearest name.
[[nodiscard]] DOPPEL_API const JointServo& servo_named(const ServoSetup& setup, const std::string& joint);

// The file hardware.yaml of the package that contains a description; empty: there is none.
[[nodiscard]] DOPPEL_API std::filesystem::path hardware_file_of(const HardwareDescription& description);

}  // namespace doppel
