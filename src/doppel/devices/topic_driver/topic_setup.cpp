#include "doppel/devices/topic_driver/topic_setup.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "doppel/base/core/names.h"
#include "doppel/control/hardware/hardware_params.h"
#include "doppel/devices/drivers/motion_guard.h"
#include "doppel/ros/bus/name_rules.h"

namespace doppel {
namespace {

constexpr std::array<std::string_view, 2> kPlugins{"doppel/Topic",
                                                   "topic_based_ros2_control/TopicBasedSystem"};
constexpr const char* kInitialCommands = "use_initial_states_as_initial_commands";
const std::vector<std::string> kComponentKeys{"joint_commands_topic",
                                              "joint_states_topic",
                                              "trigger_joint_command_threshold",
                                              "sum_wrapped_joint_states",
                                              kInitialCommands,
                                              "max_lost_replies",
                                              "fault_after",
                                              "max_delay",
                                              "ahead",
                                              "gentle"};
const std::vector<std::string> kJointKeys{"gripper", "mimic", "multiplier"};
const std::vector<std::string> kStates{kPosition, kVelocity, kEffort};

void read_component(const HardwareDescription& description, TopicSetup& out, Diagnostics& errors,
                    Diagnostics& diagnostics) {
  HardwareParams params(fmt::format("hardware '{}'", description.name),
                        placed_params(description.params, description.plugin_source), kComponentKeys, errors);
  out.commands = params.text("joint_commands_topic", out.commands);
  out.states = params.text("joint_states_topic", out.states);
  for (const auto& [key, name] :
       {std::pair("joint_commands_topic", out.commands), std::pair("joint_states_topic", out.states)}) {
    if (const Status valid = check_topic_name(name); !valid)
      params.report_problem(key, fmt::format("<param> '{}': {}", key, valid.why()));
  }
  if (out.commands == out.states)
    params.report_problem("joint_states_topic",
                          fmt::format("commands and states have the same topic '{}'", out.states));
  out.threshold = params.number("trigger_joint_command_threshold", out.threshold, 0, 0.1);
  out.unwraps = params.flag("sum_wrapped_joint_states", out.unwraps);
  out.max_lost_replies = params.whole("max_lost_replies", out.max_lost_replies, 1, 1000);
  out.fault_after = params.number("fault_after", out.fault_after, 0.02, 10);
  out.max_delay = params.number("max_delay", out.max_delay, 0.001, 10);
  out.ahead = params.number("ahead", out.ahead, 0.02, 2);
  out.gentle = params.choice("gentle", {"never", "always"}, 0) == 1;
  if (params.has(kInitialCommands) && !params.flag(kInitialCommands, false))
    diagnostics.note("hardware.parameter", params.where(kInitialCommands),
                     fmt::format("<param> '{}' has no effect: the first commands are always the states",
                                 kInitialCommands));
}

void check_interfaces(const HardwareJointDescription& joint, Diagnostics& errors) {
  for (const HardwareInterfaceDescription& one : joint.command_interfaces) {
    if (one.name == kPosition) continue;
    errors.error(
        "hardware.interface", one.source,
        fmt::format("joints behind topics have no {} command; '{}' can have position", one.name, joint.name),
        "write <command_interface name=\"position\"/>");
  }
  for (const HardwareInterfaceDescription& one : joint.state_interfaces) {
    if (std::ranges::find(kStates, one.name) != kStates.end()) continue;
    errors.error("hardware.interface", one.source,
                 fmt::format("sensor_msgs/JointState has no {} of '{}'{}", one.name, joint.name,
                             did_you_mean(one.name, kStates)),
                 "position, velocity and effort can be read");
  }
}

void read_joint(const HardwareJointDescription& joint, const Model& model, TopicSetup& out,
                Diagnostics& errors) {
  const int index = model.find_joint(joint.name);
  if (index < 0) {
    std::vector<std::string> names;
    for (const ModelJoint& one : model.joints) names.push_back(one.name);
    return errors.error(
        "hardware.unknown_joint", joint.source,
        fmt::format("the robot has no joint '{}'{}", joint.name, did_you_mean(joint.name, names)));
  }
  HardwareParams params(fmt::format("joint '{}'", joint.name), placed_params(joint.params, joint.source),
                        kJointKeys, errors);
  const ModelJoint& limits = model.joints[static_cast<std::size_t>(index)];
  TopicJoint one;
  one.name = joint.name;
  // A mimic's leader is in the description of the robot.
  one.commanded = !joint.command_interfaces.empty() && !limits.mimics() && !params.has("mimic");
  one.gripper = params.flag("gripper", looks_like_gripper(joint.name));
  one.lower = limits.lower;
  one.upper = limits.upper;
  one.velocity = limits.velocity;
  one.effort = limits.effort;
  if (one.commanded && !(std::isfinite(one.velocity) && one.velocity > 0))
    errors.error(
        "hardware.no_velocity_limit", joint.source,
        fmt::format("the joint '{}' has no speed limit, so that nothing bounds its motion", joint.name),
        "write velocity=... into its <limit>");
  check_interfaces(joint, errors);
  out.joints.push_back(std::move(one));
}

}  // namespace

std::span<const std::string_view> topic_plugins() {
  return kPlugins;
}

bool is_topic_plugin(std::string_view name) {
  return std::ranges::find(kPlugins, name) != kPlugins.end();
}

TopicSetup read_topic_setup(const HardwareDescription& description, const Model& model,
                            Diagnostics& diagnostics) {
  TopicSetup out;
  out.component = description.name;
  Diagnostics errors;
  read_component(description, out, errors, diagnostics);
  for (const HardwareJointDescription& joint : description.joints) read_joint(joint, model, out, errors);
  errors.throw_if_errors();
  return out;
}

}  // namespace doppel
