#include "doppel/description/overlay/operation.h"

#include <fmt/format.h>

#include <numbers>

#include "doppel/description/overlay/detail/overlay.h"

namespace doppel {
namespace {

using namespace overlay_detail;

std::string degrees(double rad) {
  return fmt::format("{:.6g} deg", rad * 180 / std::numbers::pi);
}

std::string degrees(const Eigen::Vector3d& rpy) {
  const Eigen::Vector3d d = rpy * (180 / std::numbers::pi);
  return fmt::format("{:.6g} {:.6g} {:.6g} deg", d.x(), d.y(), d.z());
}

void say(std::string& out, std::string_view name, const std::optional<double>& value) {
  if (value) out += fmt::format("{}{} {}", out.empty() ? "" : ", ", name, number_text(*value));
}

std::string settings(const SetLimit& a) {
  std::string out;
  say(out, "lower", a.lower);
  say(out, "upper", a.upper);
  say(out, "effort", a.effort);
  say(out, "velocity", a.velocity);
  return out;
}

std::string settings(const SetDynamics& a) {
  std::string out;
  say(out, "damping", a.damping);
  say(out, "friction", a.friction);
  return out;
}

std::string settings(const SetServo& a) {
  std::string out;
  for (const ServoField& field : servo_fields()) say(out, field.key, a.*field.value);
  return out;
}

std::string settings(const SetInertia& a) {
  std::string out;
  if (a.mass) out = fmt::format("mass {} kg", number_text(*a.mass));
  if (a.com) out += fmt::format("{}com {} m", out.empty() ? "" : ", ", vector_text(*a.com));
  for (const auto& [name, value] : a.components) say(out, name, value);
  return out;
}

std::string settings(const SetOrigin& a) {
  std::string out;
  if (a.xyz) out = fmt::format("xyz {} m", vector_text(*a.xyz));
  if (a.rpy) out += fmt::format("{}rpy {} rad", out.empty() ? "" : ", ", vector_text(*a.rpy));
  return out;
}

std::string density_or_mass(const ComputeInertia& a) {
  if (a.mass) return fmt::format(" and a mass of {} kg", number_text(*a.mass));
  if (a.density) return fmt::format(" at {} kg/m^3", number_text(*a.density));
  return " and its mass";
}

std::string sentence(const OperationAction& action, const std::string& of) {
  return std::visit(
      Overloaded{
          [&](const FlipAxis&) { return "flip the axis of " + of; },
          [&](const SetAxis& a) { return fmt::format("set the axis of {} to {}", of, vector_text(a.axis)); },
          [&](const RotateFrame& a) {
            return fmt::format("rotate the frame of {} by rpy {}", of, degrees(a.rpy));
          },
          [&](const BakeZero& a) {
            return fmt::format("bake a zero of {:.6g} ({}) into {}", a.offset, degrees(a.offset), of);
          },
          [&](const SetOrigin& a) { return fmt::format("set the origin of {}: {}", of, settings(a)); },
          [&](const SetLimit& a) { return fmt::format("set the limit of {}: {}", of, settings(a)); },
          [&](const SetDynamics& a) { return fmt::format("set the dynamics of {}: {}", of, settings(a)); },
          [&](const SetServo& a) { return fmt::format("set the servo of {}: {}", of, settings(a)); },
          [&](const SetJointType& a) { return fmt::format("make {} {}", of, a.type); },
          [&](const SetInertia& a) { return fmt::format("set the inertia of {}: {}", of, settings(a)); },
          [&](const ComputeInertia& a) {
            return fmt::format("compute the inertia of {} from its shapes{}", of, density_or_mass(a));
          },
          [&](const ScaleMasses& a) {
            return fmt::format("scale all masses to a total of {} kg", number_text(a.total));
          },
          [&](const AttachToWorld&) { return fmt::format("attach {} to a link 'world'", of); },
          [&](const AddMimic& a) {
            return fmt::format("let {} mimic '{}', multiplier {}, offset {}", of, a.leader,
                               number_text(a.multiplier), number_text(a.offset));
          },
          [&](const ReplaceCollision& a) {
            if (a.by == "none") return "drop the collision shapes of " + of;
            return fmt::format("replace the collision shapes of {} by {} {}", of,
                               a.by == "decomposition" ? "their" : "a", a.by);
          },
          [&](const SetMeshScale& a) {
            return fmt::format("scale the meshes of {} by {}", of, vector_text(a.scale));
          },
          [&](const Rename& a) { return fmt::format("rename {} to '{}'", of, a.to); },
          [&](const AddRos2Control& a) {
            return fmt::format("add the ros2_control block '{}' for {} joints, driven by {}", a.name,
                               a.joints.size(), a.plugin);
          },
          [&](const Remove& a) {
            if (target_kind(a) == a.kind) return "remove " + of;
            return fmt::format("remove the {} of {}", a.kind, of);
          },
      },
      action);
}

}  // namespace

const std::vector<ServoField>& servo_fields() {
  static const std::vector<ServoField> kFields{
      {"stiffness", &SetServo::stiffness, "stiffness", "N m/rad", "N/m"},
      {"damping", &SetServo::damping, "servo_damping", "N m s/rad", "N s/m"},
      {"armature", &SetServo::armature, "armature", "kg m^2", "kg"},
      {"friction", &SetServo::friction, "friction", "N m", "N"},
      {"viscous", &SetServo::viscous, "damping", "N m s/rad", "N s/m"},
      {"effort", &SetServo::effort, "effort", "N m", "N"},
      {"velocity", &SetServo::velocity, "velocity", "rad/s", "m/s"},
      {"delay", &SetServo::delay, "delay", "s", "s"},
      {"backlash", &SetServo::backlash, "backlash", "rad", "m"},
      {"resolution", &SetServo::resolution, "resolution", "rad", "m"},
      {"rms", &SetServo::rms, "rms", "rad", "m"}};
  return kFields;
}

const std::vector<std::string>& remove_kinds() {
  static const std::vector<std::string> kKinds{
      "link",     "joint",     "mimic",  "limit",        "dynamics", "safety_controller",
      "inertial", "collision", "visual", "ros2_control", "gazebo",   "transmission"};
  return kKinds;
}

std::string operation_name(const OperationAction& action) {
  return std::visit(Overloaded{
                        [](const FlipAxis&) -> std::string { return "flip_axis"; },
                        [](const SetAxis&) -> std::string { return "set_axis"; },
                        [](const RotateFrame&) -> std::string { return "rotate_frame"; },
                        [](const BakeZero&) -> std::string { return "bake_zero"; },
                        [](const SetOrigin&) -> std::string { return "set_origin"; },
                        [](const SetLimit&) -> std::string { return "set_limit"; },
                        [](const SetDynamics&) -> std::string { return "set_dynamics"; },
                        [](const SetServo&) -> std::string { return "set_servo"; },
                        [](const SetJointType&) -> std::string { return "set_joint_type"; },
                        [](const SetInertia&) -> std::string { return "set_inertia"; },
                        [](const ComputeInertia&) -> std::string { return "compute_inertia"; },
                        [](const ScaleMasses&) -> std::string { return "scale_masses"; },
                        [](const AttachToWorld&) -> std::string { return "attach_to_world"; },
                        [](const AddMimic&) -> std::string { return "add_mimic"; },
                        [](const ReplaceCollision&) -> std::string { return "replace_collision"; },
                        [](const SetMeshScale&) -> std::string { return "set_mesh_scale"; },
                        [](const Rename& a) { return "rename_" + a.kind; },
                        [](const AddRos2Control&) -> std::string { return "add_ros2_control"; },
                        [](const Remove& a) { return "remove_" + a.kind; },
                    },
                    action);
}

std::string target_kind(const OperationAction& action) {
  return std::visit(Overloaded{
                        [](const SetInertia&) -> std::string { return "link"; },
                        [](const ComputeInertia&) -> std::string { return "link"; },
                        [](const AttachToWorld&) -> std::string { return "link"; },
                        [](const ReplaceCollision&) -> std::string { return "link"; },
                        [](const SetMeshScale&) -> std::string { return "link"; },
                        [](const ScaleMasses&) -> std::string { return "robot"; },
                        [](const Rename& a) { return a.kind; },
                        [](const AddRos2Control&) -> std::string { return "ros2_control"; },
                        [](const Remove& a) -> std::string {
                          if (a.kind == "inertial" || a.kind == "collision" || a.kind == "visual")
                            return "link";
                          if (a.kind == "mimic" || a.kind == "limit" || a.kind == "dynamics" ||
                              a.kind == "safety_controller")
                            return "joint";
                          return a.kind;
                        },
                        [](const auto&) -> std::string { return "joint"; },
                    },
                    action);
}

std::string target_name(const OperationAction& action) {
  return std::visit(Overloaded{
                        [](const SetInertia& a) { return a.link; },
                        [](const ComputeInertia& a) { return a.link; },
                        [](const AttachToWorld& a) { return a.link; },
                        [](const ReplaceCollision& a) { return a.link; },
                        [](const SetMeshScale& a) { return a.link; },
                        [](const ScaleMasses&) { return std::string(); },
                        [](const Rename& a) { return a.from; },
                        [](const AddRos2Control& a) { return a.name; },
                        [](const Remove& a) { return a.name; },
                        [](const auto& a) { return a.joint; },
                    },
                    action);
}

std::string operation_target(const OperationAction& action) {
  const std::string kind = target_kind(action), name = target_name(action);
  if (kind == "robot") return "the robot";
  if (kind == "link" && name.empty()) return "the root link";
  return fmt::format("{} '{}'", kind, name);
}

std::string describe(const OperationAction& action) {
  return sentence(action, operation_target(action));
}

namespace overlay_detail {

void set_target(OperationAction& action, const std::string& name) {
  std::visit(Overloaded{
                 [&](SetInertia& a) { a.link = name; },
                 [&](ComputeInertia& a) { a.link = name; },
                 [&](AttachToWorld& a) { a.link = name; },
                 [&](ReplaceCollision& a) { a.link = name; },
                 [&](SetMeshScale& a) { a.link = name; },
                 [](ScaleMasses&) {},
                 [&](Rename& a) { a.from = name; },
                 [&](AddRos2Control& a) { a.name = name; },
                 [&](Remove& a) { a.name = name; },
                 [&](auto& a) { a.joint = name; },
             },
             action);
}

}  // namespace overlay_detail
}  // namespace doppel
