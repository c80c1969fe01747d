#pragma once
// The plugins and elements of Gazebo by which a description asks for attachments: a detachable joint of gz-sim, a vacuum
// gripper and a <gripper> of Gazebo Classic. Sources: gz-sim's DetachableJoint, gazebo_ros_pkgs'
// gazebo_ros_vacuum_gripper (ROS 1 and 2), SDFormat's <gripper>.

#include <string>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"

namespace doppel {

// Fixes a link of another model at the start, and by topic.
struct DetachableJoint {
  std::string parent_link, child_model, child_link;
  std::string attach_topic, detach_topic, output_topic;  // std_msgs: Empty, Empty, String
};

// Fixes what is near its link while it is switched on.
struct VacuumGripper {
  std::string link;
  double reach = 0.05;                  // m, between the origins of the two links
  std::string switch_service;           // std_srvs/SetBool; empty: on_service and off_service
  std::string on_service, off_service;  // std_srvs/Empty
  std::string grasping_topic;           // std_msgs/Bool
};

// Fixes what two of its links hold to the palm.
struct GripperCheck {
  std::string palm;
  std::vector<std::string> links;
  int attach_steps = 20, detach_steps = 40, min_contacts = 2;
};

struct AttachmentPlugins {
  std::vector<DetachableJoint> joints;
  std::vector<VacuumGripper> vacuums;
  std::vector<GripperCheck> grippers;
};

// `name`: of the instance in the world. What cannot be used is a warning at its place.
DOPPEL_API AttachmentPlugins attachment_plugins_of(const RobotDescription& description,
                                                   const std::string& name, Diagnostics& diagnostics);

}  // namespace doppel
