#include "doppel/description/urdf/robot_description.h"

namespace doppel {

Eigen::Matrix3d Inertial::tensor() const {
  Eigen::Matrix3d I;
  I << ixx, ixy, ixz, ixy, iyy, iyz, ixz, iyz, izz;
  return I;
}

const Link* RobotDescription::find_link(std::string_view link_name) const {
  for (const Link& link : links) {
    if (link.name == link_name) return &link;
  }
  return nullptr;
}

const Joint* RobotDescription::find_joint(std::string_view joint_name) const {
  for (const Joint& joint : joints) {
    if (joint.name == joint_name) return &joint;
  }
  return nullptr;
}

bool has_direction(const Joint& joint) {
  return joint.axis.norm() > 1e-9;
}

bool is_scalar(const Joint& joint) {
  const bool one_number = joint.type == JointType::revolute || joint.type == JointType::continuous ||
                          joint.type == JointType::prismatic;
  return one_number && has_direction(joint);
}

const Joint* leader_of(const RobotDescription& robot, const Joint& joint) {
  if (!joint.mimic || !is_scalar(joint)) return nullptr;
  const Joint* const leader = robot.find_joint(joint.mimic->joint);
  if (leader == nullptr || !is_scalar(*leader)) return nullptr;
  const Joint* at = leader;
  for (std::size_t steps = 0; at != nullptr && at->mimic && steps <= robot.joints.size(); ++steps) {
    if (at == &joint) return nullptr;
    at = robot.find_joint(at->mimic->joint);
  }
  return leader;
}

}  // namespace doppel
