#pragma once
// Which simulated sensor each <sensor> of a <ros2_control> reads: the one of the same name in the description, or else
// one at the link or joint that its <param name="frame_id|link|joint"> names. Conventions: gz_ros2_control's equal names,
// ros2_control's semantic components for the names of interfaces.

#include <optional>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"
#include "doppel/robot/kinematics/model.h"
#include "doppel/sensors/models/sensor_frames.h"

namespace doppel {

// A value of one of the bound sensors.
struct SensorValue {
  std::size_t sensor = 0, value = 0;  // in SensorBindings::sensors, in reading_names() of it
};

struct DOPPEL_API SensorBindings {
  std::vector<RobotSensor> sensors;
  // [sensors of the component][its state interfaces]; nullopt: bound to nothing.
  std::vector<std::vector<std::optional<SensorValue>>> values;
  // "ros2_control.sensor_unbound": errors, the interfaces that read NaN, with what to write; warnings, those that keep their
  // initial_value.
  Diagnostics unbound;
};

// `sensors`: of the description, on the links of `model`.
DOPPEL_API SensorBindings bind_sensors(const HardwareDescription& hardware, const Model& model,
                                       const RobotSensors& sensors);

}  // namespace doppel
