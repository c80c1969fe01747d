#pragma once
// Forward kinematics. None of these functions allocates or throws; sizes of q [nq] (rad, m) and
// v are preconditions.

#include <span>

#include "doppel/export.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel {

using ConstVector = Eigen::Ref<const Eigen::VectorXd>;

// X_JC, the child link in the joint frame, at configuration q: R_axis(q) or a translation along the axis.
DOPPEL_API Pose joint_transform(const ModelJoint& joint, const ConstVector& q);

// The two unit vectors along which a planar joint slides, in the joint frame: x and y of the frame that
// results from the shortest rotation of z to the axis; for the axis z they are x and y.
DOPPEL_API Eigen::Matrix<double, 3, 2> planar_directions(const Eigen::Vector3d& axis);

// X_PC, the child link in the parent link: X_PJ * joint_transform.
DOPPEL_API Pose parent_to_child(const ModelJoint& joint, const ConstVector& q);

// Fills data.X_WL. Source: Featherstone, Rigid Body Dynamics Algorithms, 2008, ch. 4.
DOPPEL_API void forward_kinematics(const Model& model, Data& data, const ConstVector& q);

// The geometric Jacobian of a point fixed to a link, [6, nv]: rows angular then linear velocity, in world
// axes; the point p_LoP_L in link coordinates, m. Precondition: forward_kinematics for the same q. The
// caller resizes J.
DOPPEL_API void jacobian(const Model& model, const Data& data, int link, const Eigen::Vector3d& p_LoP_L,
                         Eigen::Ref<Eigen::Matrix<double, 6, Eigen::Dynamic>> J);

// X_AB at the configuration of the last forward_kinematics.
DOPPEL_API Pose relative_pose(const Data& data, int link_A, int link_B);

}  // namespace doppel
