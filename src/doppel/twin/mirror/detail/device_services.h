#pragma once
// Services in the namespace of a robot, for a person who works at its devices:
//
//   /doppel/hardware/release (std_srvs/srv/Trigger)   the torque of all joints off, for a hand
//   /doppel/hardware/hold (std_srvs/srv/Trigger)      the devices active, where they are; after a release
//                                                     with the controllers of before
//   /doppel/hardware/release_joint (doppel_msgs/srv/ReleaseJoint)   of one joint, for a short time
//   /doppel/hardware/confirm_pose (doppel_msgs/srv/ConfirmPose)
//   /doppel/hardware/guide (doppel_msgs/srv/GuideJoint)      only with a hand at emulated devices

#include <string>
#include <vector>

#include "doppel/ros/bus/bus.h"
#include "doppel/twin/loop/twin_robot.h"

namespace doppel {

class DeviceServices {
 public:
  // On the node. `resting`: the controllers that run again when the joints hold; kept while the robot is
  // exchanged. All outlive the services. `guided`: there is a hand.
  DeviceServices(Node& node, TwinRobot& robot, std::vector<std::string>& resting, bool guided);

 private:
  Status release();
  Status release_component(const std::string& name);
  Status hold();

  TwinRobot& robot_;
  std::vector<std::string>& resting_;
};

}  // namespace doppel
