#pragma once
// What the datasheets of a robot's actuators say about how precisely its joints are held.

#include <map>
#include <string>

#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"
#include "doppel/review/audit/audit.h"

namespace doppel {

// At the joint, rad or m; 0: the sheet does not say.
struct DOPPEL_API DrivePrecision {
  std::string actuator;   // "STS3215"
  double resolution = 0;  // the step of the measured position
  double backlash = 0;    // the whole play of the gears
  double noise = 0;       // standard deviation of the position in which the drive comes to rest

  [[nodiscard]] bool any() const { return resolution > 0 || backlash > 0 || noise > 0; }
};

// By joint, of the datasheet with which check_datasheet compares limits: that of the options, or the
// package's config/actuators.yaml. A package's sheet that is not valid, which is a finding of the audit,
// gives none. Throws InputError for the sheet of the options.
DOPPEL_API std::map<std::string, DrivePrecision> drive_precision(const RobotDescription& robot,
                                                                 const AuditOptions& options);

}  // namespace doppel
