#pragma once
// One typed correction of a description: its action, its target, the reason, the evidence, and the values
// of its target when it was made. Operations work on the expanded XML tree, so that elements unknown to
// doppel are preserved.

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "doppel/base/core/source_location.h"
#include "doppel/export.h"

namespace doppel {

// Negates the joint's axis.
struct FlipAxis {
  std::string joint;
};
struct SetAxis {
  std::string joint;
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();  // in the joint frame
};
// Rotates the joint's frame: R_new = R_old R_rpy, R_rpy by URDF's convention (rad, fixed axes x y z).
struct RotateFrame {
  std::string joint;
  Eigen::Vector3d rpy = Eigen::Vector3d::Zero();
};
// Writes a measured zero into the origin: R_new = R_old R_axis(-offset), offset in rad, so that the pose
// at angle s is the former one at s - offset. For a prismatic joint p_new = p_old - R_old axis offset,
// offset in m.
struct BakeZero {
  std::string joint;
  double offset = 0;
};
struct SetOrigin {  // of a joint
  std::string joint;
  std::optional<Eigen::Vector3d> xyz, rpy;  // m, rad
};
struct SetLimit {
  std::string joint;
  std::optional<double> lower, upper, effort, velocity;  // rad or m, N m or N, rad/s or m/s
};
struct SetDynamics {
  std::string joint;
  std::optional<double> damping, friction;  // N m s/rad or N s/m; N m or N
};
// The servo of a joint as an identification found it; only given values are written. Effort and velocity are
// those of <limit>, viscous and friction those of <dynamics>, the others are attributes of <doppel:servo> in
// the <gazebo> of the joint. SI units of a revolute, or of a prismatic joint.
struct SetServo {
  std::string joint;
  std::optional<double> stiffness, damping, armature;  // N m/rad, N m s/rad, kg m^2
  std::optional<double> friction, viscous;             // N m (Coulomb), N m s/rad
  std::optional<double> effort, velocity;              // N m, rad/s
  std::optional<double> delay;                         // s
  std::optional<double> backlash, resolution;          // rad: the whole play, one step of the measurement
  std::optional<double> rms;                           // rad, of the identification's residuals
};
// The values of SetServo: the key in files, the member, the fact that it writes, the units.
struct ServoField {
  const char* key;
  std::optional<double> SetServo::*value;
  const char* fact;
  const char *angular, *linear;
};
DOPPEL_API const std::vector<ServoField>& servo_fields();
struct SetJointType {
  std::string joint, type;
};
// Only given values are written; the tensor is about the centre of mass, in the axes of <inertial>'s origin.
struct SetInertia {
  std::string link;
  std::optional<double> mass;                // kg
  std::optional<Eigen::Vector3d> com;        // m, in the link frame
  std::map<std::string, double> components;  // "ixx" ... "izz", kg m^2
};
// Computes the inertia of the link's visual (or collision) shapes as solids of constant density; the mass is
// the present one, or given, or from the density.
struct ComputeInertia {
  std::string link;
  std::optional<double> mass, density;  // kg, kg/m^3
};
// Scales all masses and tensors by one factor to the total mass `total`.
struct ScaleMasses {
  double total = 0;  // kg
};
// Adds a link `world` with a fixed joint `world_to_<root>`.
struct AttachToWorld {
  std::string link;                                                              // empty: the root
  Eigen::Vector3d xyz = Eigen::Vector3d::Zero(), rpy = Eigen::Vector3d::Zero();  // m, rad
};
struct AddMimic {
  std::string joint, leader;
  double multiplier = 1, offset = 0;  // q = multiplier * q_leader + offset; offset in rad or m
};
struct ReplaceCollision {
  std::string link;
  std::string by;  // "hull", "box", "decomposition", "none"
};
struct SetMeshScale {
  std::string link;
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();
};
struct Rename {
  std::string kind;  // "link", "joint", "robot"
  std::string from, to;
};
struct AddRos2Control {
  std::string name, plugin;
  std::vector<std::string> joints, command_interfaces, state_interfaces;
  std::vector<std::pair<std::string, std::string>> params;
  std::vector<std::pair<std::string, double>> initial_values;  // joint -> position at the start; rad or m
};
struct Remove {
  std::string kind;  // one of remove_kinds(); with a link its joint and all references to them are removed
  std::string name;
};
// The kinds that can be removed: "link", "joint", "mimic" (of a joint), "collision" (all of
// a link), "ros2_control"...
DOPPEL_API const std::vector<std::string>& remove_kinds();

using OperationAction =
    std::variant<FlipAxis, SetAxis, RotateFrame, BakeZero, SetOrigin, SetLimit, SetDynamics, SetServo,
                 SetJointType, SetInertia, ComputeInertia, ScaleMasses, AttachToWorld, AddMimic,
                 ReplaceCollision, SetMeshScale, Rename, AddRos2Control, Remove>;

// A value of more than one turn. `unit`: as written, "rad" (or deg), "m" (or mm), or empty.
struct LargeAngle {
  std::string key;  // "offset", "upper", "rpy"
  double value = 0;
  std::string unit;
};

struct Operation {
  OperationAction action;
  std::vector<LargeAngle> beyond_a_turn;
  std::string why;
  std::vector<std::string> evidence;  // measurements, datasheets, in words
  // The fingerprint: the values that the operation depends on, when it was made: "axis" -> "1 0 0". Numbers
  // are compared by value.
  std::vector<std::pair<std::string, std::string>> was;
  SourceLocation where;  // in the overlay's file
};

// "flip_axis", "rename_joint", "remove_mimic": the key in the overlay's file.
DOPPEL_API std::string operation_name(const OperationAction& action);
// "joint 'Revolute 2'", "link 'arm'", "the robot"
DOPPEL_API std::string operation_target(const OperationAction& action);
// The value of that key in the file: "Revolute 2"; empty for the whole robot.
DOPPEL_API std::string target_name(const OperationAction& action);
DOPPEL_API std::string target_kind(
    const OperationAction& action);  // "joint", "link", "robot", "ros2_control"...
// One line for messages: "set the limit of joint 'Revolute 1': velocity 5.2 rad/s"
DOPPEL_API std::string describe(const OperationAction& action);

}  // namespace doppel
