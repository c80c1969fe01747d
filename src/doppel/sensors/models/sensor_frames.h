#pragma once
// The sensors of a robot as its description has them, with the frames that their messages name.

#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/gazebo/sensor_description.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel {

// A frame of TF that the description has no link for.
struct FixedFrame {
  std::string name, parent;  // parent: a link
  Pose X_PF = Pose::Identity();
};

struct RobotSensor {
  SensorDescription description;
  int link = 0;                  // in the model
  std::string frame;             // of its messages, without a prefix
  Pose X_LF = Pose::Identity();  // that frame in the link
};

struct RobotSensors {
  std::vector<RobotSensor> sensors;
  std::vector<FixedFrame> frames;
};

// x to the right, y down, z forward, in a frame with x forward and z up (REP 103).
DOPPEL_API Pose optical_axes();

// Data are in the axes of the frame that is named. A sensor with a pose of its own has its own frame, `<sensor>_frame`;
// pictures have an optical one, `<link>_optical_frame`, unless the description has one. A frame that the user names is
// kept. Warnings: those of read_sensors(), and "sensor.frame": pictures in a frame that is not optical, or a frame that is
// not in TF.
DOPPEL_API RobotSensors find_sensors(const RobotDescription& robot, const Model& model,
                                     Diagnostics& diagnostics);

// The same for sensors that were read elsewhere, such as those of a model of SDF; those on no link of the model are left out.
DOPPEL_API RobotSensors place_sensors(std::vector<SensorDescription> described, const Model& model,
                                      Diagnostics& diagnostics);

}  // namespace doppel
