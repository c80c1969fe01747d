#pragma once
// LeRobot's calibration files: the angle of each servo's ticks. Two forms are read: the present
// one, a map from motor to {id, drive_mode, homing_offset, range_min, range_max}, and the older
// one with lists parallel to motor_names. Source: huggingface/lerobot, motors/motors_bus.py and
// the former robot_devices/motors/feetech.py.

#include <filesystem>
#include <string>
#include <vector>

#include "doppel/export.h"

namespace doppel {

struct DOPPEL_API LerobotMotor {
  std::string name;
  int id = 0;                        // 0: not written
  bool inverted = false;             // drive_mode
  int homing_offset = 0;             // ticks
  int range_min = 0, range_max = 0;  // ticks at the ends of the range that was swept
  bool older = false;

  // The joint angle by LeRobot's convention, rad. Present form: zero in the middle of the swept range; older
  // form: zero at the homing pose.
  [[nodiscard]] double angle(double ticks) const;
  // The angles at the two ends, rad, the smaller one first.
  [[nodiscard]] double lower() const;
  [[nodiscard]] double upper() const;
};

// Throw InputError: unreadable, no JSON, not a calibration, a range without width.
DOPPEL_API std::vector<LerobotMotor> read_lerobot_calibration(const std::filesystem::path& file);
DOPPEL_API std::vector<LerobotMotor> parse_lerobot_calibration(const std::string& json,
                                                               const std::string& name);

}  // namespace doppel
