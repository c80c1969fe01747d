#pragma once
// Joints of SDF as joints of a description. What a description does not have is composed: ball, universal, screw and
// revolute2 joints of two or three joints at one point.

#include <string>
#include <vector>

#include "doppel/description/urdf/robot_description.h"
#include "doppel/scenario/sdf/detail/sdf_elements.h"

namespace doppel::sdf {

struct JointAxis {
  Eigen::Vector3d a_J{0, 0, 1};  // unit, in the joint frame
  JointLimits limits;
  bool bounded = false;
  double damping = 0, friction = 0;
  std::optional<double> stop_stiffness;
  std::optional<Mimic> mimic;
  SourceLocation source;
};

// The axes' frames are resolved by the caller: R_JE rotates from the frame that an axis is expressed in to the joint's.
JointAxis read_axis(const XmlNode& axis, const Eigen::Matrix3d& R_JE, Elements& elements);

struct JointSpec {
  std::string name, type;
  std::string up, down;          // links of the description
  Pose X_UJ = Pose::Identity();  // joint frame in the upper link
  Pose X_JD = Pose::Identity();  // lower link in the joint frame
  bool reversed = false;         // the lower link is SDF's parent
  JointAxis axis, axis2;
  double screw_pitch = 0;  // m per revolution
  double lower_mass = 1;   // kg, of the lower link
  SourceLocation source;
};

// The joints and the massless or light links between them.
struct ComposedJoint {
  std::vector<Joint> joints;
  std::vector<Link> links;
};
ComposedJoint compose_joint(const JointSpec& spec, Elements& elements);

}  // namespace doppel::sdf
