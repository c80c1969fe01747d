#pragma once
// The file in which LeRobot keeps the calibration of an arm: for each motor the id, the drive mode, the
// homing offset and the recorded range, as JSON. Ticks are those that the servo reports, behind its homing
// offset; LeRobot's zero of an angle is the middle of the range.

#include <filesystem>
#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"

namespace doppel {

struct RecordedMotor {
  std::string motor;  // the joint's name
  int id = 0;
  int drive_mode = 0;  // 1: reversed
  int homing_offset = 0, range_min = 0, range_max = 0;
  SourceLocation where;
};

// `written`: the path as the user wrote it in the file `beside`: absolute, below ~, or relative to that file.
// Throws InputError: it cannot be read. Wrong entries are errors in `errors`, and are skipped.
std::vector<RecordedMotor> read_recorded_motors(const std::string& written, const SourceLocation& beside,
                                                Diagnostics& errors);

}  // namespace doppel
