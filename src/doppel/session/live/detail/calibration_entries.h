#pragma once
// The joints that can be calibrated, with their measurements and what follows from these. One thread.

#include <optional>
#include <string>
#include <vector>

#include "doppel/review/calibration/corrections.h"
#include "doppel/ros/messages/doppel_msgs.h"
#include "doppel/session/live/calibration_service.h"

namespace doppel {

struct CalibrationEntry {
  WorldRobot robot;
  Joint joint;
  std::vector<Measurement> measurements = {};
  std::optional<JointCorrection> result = {};
  std::string problem = {};
  bool written = false;
};

class CalibrationEntries {
 public:
  // Measurements of joints that are as before stay.
  void update(std::vector<CalibratedRobot> robots);

  // Throws InputError with the nearest name.
  [[nodiscard]] const CalibrationEntry& find(const std::string& name_space, const std::string& joint) const;
  // The robot's joints with these names, or, without names, all that have a result. Throws InputError:
  // there is none, or one has no result.
  [[nodiscard]] std::vector<const CalibrationEntry*> with_results(
      const std::string& name_space, const std::vector<std::string>& joints) const;
  // The measurements of a joint with another one, which replaces that of the same pose. Throws InputError:
  // they are too close together, or there are too many.
  [[nodiscard]] static std::vector<Measurement> with(const CalibrationEntry& entry, Measurement fresh);

  // Does nothing for a joint that does not exist any more.
  void keep(const std::string& name_space, const std::string& joint, Measurement fresh);
  // An empty name: all joints of the robot.
  void forget(const std::string& name_space, const std::string& joint);
  // Their measurements are of the model before the file has changed.
  void note_file(const std::string& name_space, const std::vector<std::string>& joints, bool written);

  void write(doppel_msgs::msg::Calibration& message) const;

 private:
  std::vector<CalibrationEntry> entries_;
};

}  // namespace doppel
