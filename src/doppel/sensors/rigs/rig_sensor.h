#pragma once
// Types that the rigs of sensors share: a sensor on an instance, and the options and status of a rig.

#include <cstdint>
#include <string>

#include "doppel/base/core/time.h"
#include "doppel/description/gazebo/sensor_description.h"
#include "doppel/ros/messages/doppel_msgs.h"

namespace doppel {

// A sensor of an instance. Its data are in the axes of the frame that its messages name.
struct RigSensor {
  SensorDescription description;
  std::string instance;  // in the engine
  int link = 0;
  std::string name_space;  // of its topics: "left"; empty: none
  std::string frame;       // header.frame_id
  Pose X_LF =
      Pose::Identity();      // that frame in the link; for pictures the optical frame, or what the user named
  std::string frame_prefix;  // of the robot's links in header.frame_id: "left/"; empty: none
  std::string origin_frame = {};                     // of TF, fixed to the link
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  // of the sensor itself in that frame, m
  std::uint64_t revision = 0;                        // another one when an edit has changed a value
};

// But for the revision.
inline bool same_values(const RigSensor& a, const RigSensor& b) {
  return a.description == b.description && a.instance == b.instance && a.link == b.link &&
         a.name_space == b.name_space && a.frame == b.frame && a.X_LF == b.X_LF &&
         a.frame_prefix == b.frame_prefix && a.origin_frame == b.origin_frame && a.origin == b.origin;
}

struct RigOptions {
  std::uint64_t seed = 0;
  bool lockstep = false;  // the loop waits for every sample
  int threads = 1;        // that make samples of light
  Duration step{};        // of the engine; the rigs set it
};

struct RigStatus {
  doppel_msgs::msg::Sensor sensor;
  std::uint64_t hash = 0;  // over all bytes published so far
};

}  // namespace doppel
