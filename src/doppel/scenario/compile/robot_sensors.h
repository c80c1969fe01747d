#pragma once
// The sensors of robots and models of a twin, from their descriptions to the engine's instances.

#include "doppel/scenario/sdf/sdf_world.h"
#include "doppel/sensors/models/sensor_frames.h"
#include "doppel/sensors/rigs/rig_sensor.h"

namespace doppel {

class CompiledRobot;

// Of a model of SDF: those in its links and joints, and plugins beside them that are sensors. Warnings: as find_sensors() of
// a robot.
DOPPEL_API RobotSensors find_sensors(const SdfModel& sdf, const Model& model, Diagnostics& diagnostics);

// A sensor of the robot in the engine, with the namespace and the frames of its topics.
DOPPEL_API RigSensor make_rig_sensor(const CompiledRobot& robot, const RobotSensor& sensor);

}  // namespace doppel
