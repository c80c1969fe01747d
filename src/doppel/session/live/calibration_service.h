#pragma once
// The two-point calibration of arms that a running twin drives, for the page: /doppel/calibrate/measure,
// forget, write and undo, with the state on the latched topic /doppel/calibration. The computation and the
// corrections are those of `doppel calibrate` (review/calibration).

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"
#include "doppel/ros/bus/bus.h"
#include "doppel/scenario/schema/scenario.h"

namespace doppel {

struct CalibratedRobot {
  WorldRobot source;          // with its file
  std::vector<Joint> joints;  // that devices drive, as the running model has them
};

struct CalibrationServiceOptions {
  // The loop's thread.
  std::function<std::vector<CalibratedRobot>()> robots;
  // The loop's thread: what the machine reports now, rad or m; NaN: nothing.
  std::function<double(const std::string& name_space, const std::string& joint)> position;
  std::filesystem::path bundled_robots;
};

class DOPPEL_API CalibrationService {
 public:
  // The loop's thread, as all functions; the bus outlives the service.
  CalibrationService(Bus& bus, CalibrationServiceOptions options);
  ~CalibrationService();
  CalibrationService(const CalibrationService&) = delete;
  CalibrationService& operator=(const CalibrationService&) = delete;

  // Robots were added, removed or changed. Measurements of a joint that has changed are forgotten.
  void update();

 private:
  struct LoopPart;
  struct Shared;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace doppel
