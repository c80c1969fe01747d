#pragma once
// The one writer of a Model as MJCF: bodies with their inertias, joints, shapes and couplings. It is used for
// two documents: that of the MuJoCo engine (physics/engines/mujoco/engine_model.h: names by index, drives and damping outside
// of the text) and that of `convert --to mjcf` (review/conversion/mjcf_export.h: the user's names, meshes, actuators).
// MjcfNaming provides what differs between them. Source: mujoco.readthedocs.io/en/2.2.2/XMLreference.html.

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/base/math/mass_properties.h"
#include "doppel/base/xml/xml.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel {

// MuJoCo's quaternions are w x y z, doppel's x y z w.
DOPPEL_API Eigen::Quaterniond quaternion_from_mujoco(const double* wxyz);
DOPPEL_API void quaternion_to_mujoco(const Eigen::Quaterniond& quaternion, double* wxyz);

struct PrincipalInertia {
  Eigen::Vector3d moments = Eigen::Vector3d::Zero();   // kg m^2
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  // columns, in the tensor's axes; right-handed
};
// MuJoCo allows no rounding in the triangle inequality, which point masses and rods meet with equality; where
// necessary the smaller moments are raised by a billionth of the largest.
DOPPEL_API PrincipalInertia principal_inertia(const Eigen::Matrix3d& I);

// The parts of a document that differ between the two uses.
class DOPPEL_API MjcfNaming {
 public:
  virtual ~MjcfNaming() = default;
  [[nodiscard]] virtual std::string body_name(int link) const = 0;
  // `part`: "" for a joint of one degree of freedom; "x", "y", "angle" of a planar one; "x", "y", "z", "turn"
  // of a floating one.
  [[nodiscard]] virtual std::string joint_name(int joint, std::string_view part) const = 0;
  // Mass properties of the body alone, in the link frame; nullopt: no <inertial>.
  [[nodiscard]] virtual std::optional<MassProperties> inertia(int link) const = 0;
  // True if the position limits of a joint are written as MuJoCo limits.
  [[nodiscard]] virtual bool limits(const ModelJoint& /*joint*/) const { return true; }
  // True if a floating joint is a <freejoint>, which MuJoCo allows only on children of the world.
  [[nodiscard]] virtual bool free_joint(int /*joint*/) const { return false; }
  // Further attributes of a degree of freedom: damping, friction.
  virtual void complete(const ModelJoint& joint, XmlNode& dof) const = 0;
  virtual void add_shapes(int link, XmlNode& body) = 0;
};

class DOPPEL_API MjcfBodies {
 public:
  // Both outlive the writer.
  MjcfBodies(const Model& model, MjcfNaming& terms);

  // The tree from the root link, which is at X_WR.
  XmlNode tree(const Pose& X_WR) { return body(0, X_WR, -1); }
  // The root link's shapes and the bodies below it, where that link is MuJoCo's world body.
  void fill_world(XmlNode& world) { fill(0, world); }

 private:
  XmlNode body(int link, const Pose& X_PL, int joint);
  void fill(int link, XmlNode& body);
  void add_joint(int index, XmlNode& body) const;
  [[nodiscard]] XmlNode dof(int joint, std::string_view part, const char* type,
                            const Eigen::Vector3d& axis) const;

  const Model& model_;
  MjcfNaming& naming_;
  std::vector<std::vector<int>> children_;  // joints below each link
};

// Every mimic joint as a <joint> of <equality>.
DOPPEL_API std::vector<XmlNode> mjcf_couplings(const Model& model, const MjcfNaming& terms);

// type and size of a <geom>; its pose follows by mjcf_place().
DOPPEL_API void mjcf_size(XmlNode& geom, const Box& box);
DOPPEL_API void mjcf_size(XmlNode& geom, const Cylinder& cylinder);
DOPPEL_API void mjcf_size(XmlNode& geom, const Capsule& capsule);
DOPPEL_API void mjcf_size(XmlNode& geom, const Sphere& sphere);
DOPPEL_API void mjcf_size(XmlNode& geom, const Ellipsoid& ellipsoid);

// pos and quat, left out where they are the identity.
DOPPEL_API void mjcf_place(XmlNode& node, const Pose& X);

// "lower upper", in rad or m.
DOPPEL_API std::string mjcf_range(double lower, double upper);

// The pose of each link in the topmost link that it is rigidly joined to (`groups`: rigid_groups()). MuJoCo
// requires a mass on every body that moves by itself, whichever of these links has it.
DOPPEL_API std::vector<Pose> poses_in_groups(const Model& model, const std::vector<int>& groups);

}  // namespace doppel
