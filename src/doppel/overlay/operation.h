#pragma once
// One small typed correction to a description: what it does, to what, why, on what evidence, and what its
// target looked like when it was made. Operations work on the expanded XML tree, so that whatever doppel does
// not know itself stays as it was.

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "doppel/core/source_location.h"
#include "doppel/export.h"

namespace doppel {

// Negates the joint's axis: it turns the other way.
struct FlipAxis {
  std::string joint;
};
struct SetAxis {
  std::string joint;
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();  // in the joint frame
};
// Turns the joint's frame: R_new = R_old R_rpy, R_rpy by URDF's convention (rad, fixed axes x y z).
struct RotateFrame {
  std::string joint;
  Eigen::Vector3d rpy = Eigen::Vector3d::Zero();
};
// Bakes a measured zero: R_new = R_old R_axis(-offset), so that the model at angle s looks as it did at
// s - offset. rad. A prismatic joint slides: p_new = p_old - R_old axis offset, m.
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
  std::optional<double> lower, upper, effort, velocity;  // rad or m, N m or N, per second
};
struct SetDynamics {
  std::string joint;
  std::optional<double> damping, friction;
};
struct SetJointType {
  std::string joint, type;
};
// Only what is given is written; the tensor is about the centre of mass, in the axes of <inertial>'s origin.
struct SetInertia {
  std::string link;
  std::optional<double> mass;                // kg
  std::optional<Eigen::Vector3d> com;        // m, in the link frame
  std::map<std::string, double> components;  // "ixx" ... "izz", kg m^2
};
// From the link's visual (or collision) shapes, solid and of even density; the mass as it stands, or given,
// or from the density.
struct ComputeInertia {
  std::string link;
  std::optional<double> mass, density;  // kg, kg/m^3
};
// All masses and tensors by one factor, so that the robot weighs `total`.
struct ScaleMasses {
  double total = 0;  // kg
};
// A link `world` with a fixed joint `world_to_<root>`.
struct AttachToWorld {
  std::string link;  // empty: the root
  Eigen::Vector3d xyz = Eigen::Vector3d::Zero(), rpy = Eigen::Vector3d::Zero();
};
struct AddMimic {
  std::string joint, leader;
  double multiplier = 1, offset = 0;
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
  std::string kind;  // one of remove_kinds(); a link goes with its joint and all that refers to them
  std::string name;
};
// What can be removed: "link", "joint", "mimic" (of a joint), "collision" (all of a link), "ros2_control"...
DOPPEL_API const std::vector<std::string>& remove_kinds();

using OperationAction =
    std::variant<FlipAxis, SetAxis, RotateFrame, BakeZero, SetOrigin, SetLimit, SetDynamics, SetJointType,
                 SetInertia, ComputeInertia, ScaleMasses, AttachToWorld, AddMimic, ReplaceCollision,
                 SetMeshScale, Rename, AddRos2Control, Remove>;

// A setting of more than one turn: `unit` is what it was written in, "rad" (or deg), "m" (or mm), or nothing.
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
  // What the operation depends on, as it was: "axis" -> "1 0 0". Compared by number where both are numbers.
  std::vector<std::pair<std::string, std::string>> was;
  SourceLocation where;  // in the overlay's file
};

// "flip_axis", "rename_joint", "remove_mimic": as the overlay's file writes it.
DOPPEL_API std::string operation_name(const OperationAction& action);
// "joint 'Revolute 2'", "link 'arm'", "the robot"
DOPPEL_API std::string operation_target(const OperationAction& action);
// What stands behind the operation's name in the file: "Revolute 2"; empty where it is about the whole robot.
DOPPEL_API std::string target_name(const OperationAction& action);
DOPPEL_API std::string target_kind(
    const OperationAction& action);  // "joint", "link", "robot", "ros2_control"...
// One line for people: "set the limit of joint 'Revolute 1': velocity 5.2 rad/s"
DOPPEL_API std::string describe(const OperationAction& action);

}  // namespace doppel
