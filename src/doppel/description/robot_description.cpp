#include "doppel/description/robot_description.h"

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

}  // namespace doppel
