#include "doppel/physics/mjcf/mjcf.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "doppel/base/math/decimals.h"
#include "doppel/base/xml/element.h"
#include "doppel/robot/kinematics/kinematics.h"

namespace doppel {
namespace {

std::string quaternion_text(const Eigen::Matrix3d& R) {
  double q[4];
  quaternion_to_mujoco(Eigen::Quaterniond(R), q);
  return decimal(q[0]) + " " + decimal(q[1]) + " " + decimal(q[2]) + " " + decimal(q[3]);
}

XmlNode inertial_of(const MassProperties& body) {
  const PrincipalInertia principal = principal_inertia(body.I);
  return element("inertial", {{"pos", decimals(body.com)},
                              {"quat", quaternion_text(principal.axes)},
                              {"mass", decimal(body.mass)},
                              {"diaginertia", decimals(principal.moments)}});
}

void add_size(XmlNode& geom, const char* type, std::string size) {
  add_attribute(geom, "type", type);
  add_attribute(geom, "size", std::move(size));
}

}  // namespace

Eigen::Quaterniond quaternion_from_mujoco(const double* wxyz) {
  return {wxyz[0], wxyz[1], wxyz[2], wxyz[3]};
}

void quaternion_to_mujoco(const Eigen::Quaterniond& quaternion, double* wxyz) {
  wxyz[0] = quaternion.w();
  wxyz[1] = quaternion.x();
  wxyz[2] = quaternion.y();
  wxyz[3] = quaternion.z();
}

PrincipalInertia principal_inertia(const Eigen::Matrix3d& I) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(I);
  PrincipalInertia out{eigen.eigenvalues(), eigen.eigenvectors()};
  const double excess = out.moments[2] - (out.moments[0] + out.moments[1]);
  if (excess > -1e-9 * out.moments[2])
    out.moments.head<2>().array() += 0.5 * std::max(excess, 0.0) + 1e-9 * out.moments[2];
  if (out.axes.determinant() < 0) out.axes.col(0) *= -1;
  return out;
}

MjcfBodies::MjcfBodies(const Model& model, MjcfNaming& terms) : model_(model), naming_(terms) {
  children_.resize(model.links.size());
  for (std::size_t i = 0; i < model.joints.size(); ++i)
    children_[static_cast<std::size_t>(model.joints[i].parent_link)].push_back(static_cast<int>(i));
}

XmlNode MjcfBodies::body(int link, const Pose& X_PL, int joint) {
  XmlNode out = element("body", {{"name", naming_.body_name(link)}});
  mjcf_place(out, X_PL);
  if (joint >= 0) add_joint(joint, out);
  if (const auto inertia = naming_.inertia(link)) out.children.push_back(inertial_of(*inertia));
  fill(link, out);
  return out;
}

void MjcfBodies::fill(int link, XmlNode& body_of_link) {
  naming_.add_shapes(link, body_of_link);
  for (const int child : children_[static_cast<std::size_t>(link)]) {
    const ModelJoint& joint = model_.joints[static_cast<std::size_t>(child)];
    body_of_link.children.push_back(body(joint.child_link, joint.X_PJ, child));
  }
}

void MjcfBodies::add_joint(int index, XmlNode& body_of_joint) const {
  const ModelJoint& joint = model_.joints[static_cast<std::size_t>(index)];
  std::vector<XmlNode>& out = body_of_joint.children;
  switch (joint.type) {
    case JointType::fixed:
      return;
    case JointType::revolute:
    case JointType::continuous:
      out.push_back(dof(index, "", "hinge", joint.axis));
      return;
    case JointType::prismatic:
      out.push_back(dof(index, "", "slide", joint.axis));
      return;
    case JointType::planar: {
      const Eigen::Matrix<double, 3, 2> directions = planar_directions(joint.axis);
      out.push_back(dof(index, "x", "slide", directions.col(0)));
      out.push_back(dof(index, "y", "slide", directions.col(1)));
      out.push_back(dof(index, "angle", "hinge", joint.axis));
      return;
    }
    case JointType::floating:
      if (naming_.free_joint(index)) {
        out.push_back(element("freejoint", {{"name", naming_.joint_name(index, "")}}));
        return;
      }
      for (int axis = 0; axis < 3; ++axis) {
        out.push_back(
            element("joint", {{"name", naming_.joint_name(index, std::string_view("xyz").substr(axis, 1))},
                              {"type", "slide"},
                              {"axis", decimals(Eigen::Vector3d::Unit(axis))}}));
      }
      out.push_back(element("joint", {{"name", naming_.joint_name(index, "turn")}, {"type", "ball"}}));
      return;
  }
}

XmlNode MjcfBodies::dof(int index, std::string_view part, const char* type,
                        const Eigen::Vector3d& axis) const {
  const ModelJoint& joint = model_.joints[static_cast<std::size_t>(index)];
  XmlNode out =
      element("joint", {{"name", naming_.joint_name(index, part)}, {"type", type}, {"axis", decimals(axis)}});
  if (std::isfinite(joint.lower) && std::isfinite(joint.upper) && naming_.limits(joint)) {
    add_attribute(out, "limited", "true");
    // MuJoCo rejects an empty range; a joint with equal limits has a very small one.
    add_attribute(out, "range", mjcf_range(joint.lower, std::max(joint.upper, joint.lower + 1e-6)));
  }
  naming_.complete(joint, out);
  return out;
}

std::vector<XmlNode> mjcf_couplings(const Model& model, const MjcfNaming& terms) {
  std::vector<XmlNode> out;
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const ModelJoint& joint = model.joints[i];
    if (!joint.scalar() || !joint.mimics()) continue;
    out.push_back(
        element("joint", {{"joint1", terms.joint_name(static_cast<int>(i), "")},
                          {"joint2", terms.joint_name(joint.mimic_leader, "")},
                          {"polycoef", mjcf_range(joint.mimic_offset, joint.mimic_multiplier) + " 0 0 0"}}));
  }
  return out;
}

void mjcf_size(XmlNode& geom, const Box& box) {
  add_size(geom, "box", decimals(0.5 * box.size));
}
void mjcf_size(XmlNode& geom, const Cylinder& cylinder) {
  add_size(geom, "cylinder", mjcf_range(cylinder.radius, 0.5 * cylinder.length));
}
void mjcf_size(XmlNode& geom, const Capsule& capsule) {
  add_size(geom, "capsule", mjcf_range(capsule.radius, 0.5 * capsule.length));
}
void mjcf_size(XmlNode& geom, const Sphere& sphere) {
  add_size(geom, "sphere", decimal(sphere.radius));
}
void mjcf_size(XmlNode& geom, const Ellipsoid& ellipsoid) {
  add_size(geom, "ellipsoid", decimals(ellipsoid.radii));
}

void mjcf_place(XmlNode& node, const Pose& X) {
  if (X.translation() != Eigen::Vector3d::Zero()) add_attribute(node, "pos", decimals(X.translation()));
  if (X.linear() != Eigen::Matrix3d::Identity()) add_attribute(node, "quat", quaternion_text(X.linear()));
}

std::string mjcf_range(double lower, double upper) {
  return decimal(lower) + " " + decimal(upper);
}

std::vector<Pose> poses_in_groups(const Model& model, const std::vector<int>& groups) {
  std::vector<Pose> out(model.links.size(), Pose::Identity());
  for (std::size_t i = 0; i < model.links.size(); ++i) {
    if (groups[i] == static_cast<int>(i)) continue;
    const ModelJoint& joint = model.joints[static_cast<std::size_t>(model.links[i].joint)];
    out[i] = out[static_cast<std::size_t>(joint.parent_link)] * joint.X_PJ;
  }
  return out;
}

}  // namespace doppel
