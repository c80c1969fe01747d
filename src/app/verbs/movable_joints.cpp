#include "app/verbs/movable_joints.h"

#include <algorithm>

#include "doppel/base/core/names.h"
#include "doppel/control/hardware/hardware.h"
#include "doppel/scenario/schema/command_kind.h"

namespace doppel::app {
namespace {

using controller_manager_msgs::msg::ControllerState;

bool claims(const ControllerState& controller, const std::string& joint) {
  const std::vector<std::string> joints = joints_of(controller);
  return std::ranges::find(joints, joint) != joints.end();
}

// The joint does not exist, does not move, or follows another one.
void check_joint(const RobotWatch& robot, const std::string& name, double position) {
  const Model* model = robot.model();
  if (model == nullptr) return;
  const ModelJoint* joint = robot.find(name);
  if (joint == nullptr) {
    throw_usage_error(
        fmt::format("the robot has no joint '{}'{}", name, did_you_mean(name, model->driven_joint_names())),
        "'doppel topic echo /joint_states --once --field name' prints all of them");
  }
  if (!joint->scalar()) {
    throw_usage_error(fmt::format("the joint '{}' has no position that could be commanded", name));
  }
  if (!joint->mimics()) return;
  const ModelJoint& leader = model->joints[static_cast<std::size_t>(joint->mimic_leader)];
  throw_usage_error(fmt::format("the joint '{}' mimics '{}' and has no drive of its own", name, leader.name),
                    joint->mimic_multiplier == 0
                        ? ""
                        : fmt::format("move its leader: doppel move \"{}={:.6g}\"", leader.name,
                                      (position - joint->mimic_offset) / joint->mimic_multiplier));
}

std::vector<std::string> command_interfaces(Client& twin, const std::string& manager,
                                            const std::string& joint) {
  using controller_manager_msgs::srv::ListHardwareInterfaces;
  std::vector<std::string> out;
  for (const auto& interface :
       call<ListHardwareInterfaces>(twin, manager + "/list_hardware_interfaces").command_interfaces) {
    if (interface.name.starts_with(joint + "/") &&
        interface.name.find('/', joint.size() + 1) == std::string::npos)
      out.push_back(interface.name.substr(joint.size() + 1));
  }
  return out;
}

}  // namespace

bool moves(const ControllerState& controller, const std::string& joint) {
  const CommandKind kind = command_kind(controller.type);
  if (kind == CommandKind::none || !claims(controller, joint)) return false;
  if (kind != CommandKind::forward) return true;
  const std::vector<std::string>& interfaces = command_interfaces_of(controller);
  return std::ranges::find(interfaces, fmt::format("{}/{}", joint, kPosition)) != interfaces.end();
}

void check_controller(const std::vector<ControllerState>& controllers, const std::string& only) {
  std::vector<std::string> names;
  for (const ControllerState& controller : controllers) {
    if (command_kind(controller.type) != CommandKind::none) names.push_back(controller.name);
  }
  if (only.empty() || std::ranges::find(names, only) != names.end()) return;
  throw ClientError(
      fmt::format("there is no controller '{}' that moves joints{}", only, did_you_mean(only, names)));
}

void refuse_joint(Client& twin, const RobotWatch& robot, const std::string& manager,
                  const std::vector<ControllerState>& controllers, const std::string& joint, double position,
                  const std::string& only) {
  check_joint(robot, joint, position);
  for (const ControllerState& c : controllers) {
    if ((!only.empty() && c.name != only) || c.state == "active" || !moves(c, joint)) continue;
    throw ClientError(
        fmt::format("'{}' is moved by {}, which is {}\n  fix: doppel control set_controller_state {} active",
                    joint, c.name, c.state, c.name));
  }
  if (!only.empty()) throw ClientError(fmt::format("{} does not move '{}'", only, joint));
  for (const ControllerState& c : controllers) {
    if (c.state != "active" || !claims(c, joint)) continue;
    throw ClientError(fmt::format("'{}' is commanded by {} ({}), which takes no positions of joints", joint,
                                  c.name, c.type));
  }
  const std::vector<std::string> interfaces = command_interfaces(twin, manager, joint);
  if (interfaces.empty()) {
    throw ClientError(fmt::format(
        "'{}' has no command interface, so no controller can move it\n  fix: add a <joint> with a "
        "<command_interface> to the description's <ros2_control>",
        joint));
  }
  throw ClientError(fmt::format(
      "no controller commands '{}', which has the command interface{} {}\n  fix: add it to the joints of a "
      "controller in the controllers' file; 'doppel control list_controllers' lists what is loaded",
      joint, interfaces.size() == 1 ? "" : "s", fmt::join(interfaces, ", ")));
}

}  // namespace doppel::app
