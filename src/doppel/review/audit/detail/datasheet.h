#pragma once
// The properties of an actuator in its datasheet: YAML with units written out, converted to SI here. And
// which actuator drives which joint of an arm. Format: docs/datasheets.md.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "doppel/base/core/source_location.h"

namespace doppel {

// A value that the sheet gives at one supply voltage.
struct RatedValue {
  double voltage = 0;   // V
  double value = 0;     // SI: N m or N; rad/s or m/s
  std::string written;  // "36 kg cm at 5 V"
};

struct ActuatorSheet {
  std::string name;                                     // "DS3240"
  bool linear = false;                                  // N, m/s, m in place of N m, rad/s, rad
  std::vector<RatedValue> stall_torque, no_load_speed;  // by rising voltage
  std::optional<double> travel;                         // rad or m, from stop to stop
  std::optional<double> gear_reduction;                 // motor turns for one of the output
  std::optional<double> mass;                           // kg
  std::optional<double> resolution;                     // rad or m, at the output, as the next ones
  std::optional<double> backlash;                       // the whole play
  std::optional<double> noise;                          // standard deviation of the position at rest
  std::string source;                                   // title, URL and date, for people
  std::filesystem::path file;
};

// At `voltage` interpolated between the sheet's rows, beyond them the nearest row's; without a voltage the
// largest in the sheet. Nothing where the sheet has no rows.
std::optional<RatedValue> rated(const std::vector<RatedValue>& rows, std::optional<double> voltage);

struct JointDrive {
  std::string joint;
  ActuatorSheet actuator;
  std::optional<double> voltage;  // V
  double reduction = 1;           // outside the actuator: turns of its output for one of the joint
  int count = 1;                  // actuators that work in parallel
  SourceLocation source;
};

struct Datasheet {
  std::string name;
  std::vector<JointDrive> drives;         // of an arm's file
  std::optional<ActuatorSheet> actuator;  // of a single actuator's: every driven joint has it
  std::filesystem::path file;
};

// `name` is a file, or the name of a sheet in `library` ("ds3240", in any case of letters). Throws
// InputError with file:line:column: unreadable, unknown keys and units (with the nearest), an actuator that
// is not in the library.
Datasheet load_datasheet(const std::filesystem::path& name, const std::filesystem::path& library);

}  // namespace doppel
