#pragma once
// The elements of each kind of sensor. Source: SDFormat 1.11.

#include "doppel/description/gazebo/detail/sensor_values.h"
#include "doppel/description/gazebo/sensor_description.h"

namespace doppel {

void read_camera(const SensorValues& values, SensorDescription& out);
// After the plugins, which have distortions, too: a lens without a finite focal length above 0 is replaced.
void check_lenses(const SensorValues& values, SensorDescription& sensor);
void read_lidar(const SensorValues& values, SensorDescription& out);
void read_sonar(const SensorValues& values, SensorDescription& out);
void read_imu(const SensorValues& values, SensorDescription& out);
void read_force_torque(const SensorValues& values, SensorDescription& out);
void read_contact(const SensorValues& values, SensorDescription& out);
void read_environment(const SensorValues& values, SensorDescription& out);

}  // namespace doppel
