// <ros2_control>: the joints, sensors and interfaces of each component, compared with the rest of the
// description. Errors and warnings are those of ros2_control itself (Jazzy: component_parser.cpp and
// resource_manager.cpp).
#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "doppel/base/core/names.h"
#include "doppel/review/audit/detail/ros_rules.h"

namespace doppel::audit_rules {
namespace {

using Hardware = HardwareDescription;
using HardwareJoint = HardwareJointDescription;
using Interface = HardwareInterfaceDescription;

const Names kInterfaces{"position", "velocity", "acceleration", "effort"};

// Common misnomers of the four interfaces.
std::string_view meant_by(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 9> kOther{
      {{"torque", "effort"},
       {"force", "effort"},
       {"speed", "velocity"},
       {"angle", "position"},
       {"pos", "position"},
       {"vel", "velocity"},
       {"eff", "effort"},
       {"acc", "acceleration"},
       {"angular_velocity", "velocity"}}};
  for (const auto& [word, meant] : kOther) {
    if (word == name) return meant;
  }
  return "";
}

std::string subject_of(const HardwareJoint& joint) {
  return fmt::format("joint '{}' of <ros2_control>", joint.name);
}

// ros2_control reads <joint name="..." mimic="false">: this component drives a joint that mimics in the URDF.
bool mimic_switched_off(const XmlNode* component, const std::string& joint) {
  if (component == nullptr) return false;
  for (const XmlNode& child : component->children) {
    const XmlAttribute* name = child.is("joint") ? child.find("name") : nullptr;
    if (name == nullptr || name->value != joint) continue;
    const XmlAttribute* mimic = child.find("mimic");
    return mimic != nullptr && mimic->value == "false";
  }
  return false;
}

void check_against_urdf(const AuditInput& in, const HardwareJoint& joint, const XmlNode* component,
                        Findings& out) {
  const Joint* urdf = in.robot.find_joint(joint.name);
  if (urdf == nullptr) {
    out.add("ros2_control.unknown_joint", subject_of(joint), joint.source,
            fmt::format("the robot has no joint '{}'{}", joint.name,
                        did_you_mean(joint.name, joint_names(in.robot))),
            "use the joint name of the URDF, or remove the entry");
    return;
  }
  if (urdf->type == JointType::fixed) {
    const bool commanded = offers_commands(joint);
    out.add("ros2_control.fixed_joint", commanded ? Severity::warning : Severity::note, subject_of(joint),
            joint.source,
            fmt::format("'{}' is a fixed joint{}", joint.name,
                        commanded ? ", so there is nothing to command" : "; it has no state"),
            "remove it from <ros2_control>, or make the joint revolute or prismatic");
    return;
  }
  if (urdf->mimic && offers_commands(joint) && !mimic_switched_off(component, joint.name)) {
    out.add("ros2_control.mimic_commanded", subject_of(joint), joint.source,
            fmt::format("'{}' mimics '{}' and has a command interface of its own", joint.name,
                        urdf->mimic->joint),
            fmt::format("remove its <command_interface>; it mimics '{}' automatically", urdf->mimic->joint));
  }
}

void check_interface_names(const HardwareJoint& joint, bool simulated, Findings& out) {
  for (const auto* list : {&joint.command_interfaces, &joint.state_interfaces}) {
    const char* what = list == &joint.command_interfaces ? "command" : "state";
    for (const Interface& interface : *list) {
      if (contains(kInterfaces, interface.name)) continue;
      std::string meant(meant_by(interface.name));
      const bool other_word = !meant.empty();
      if (meant.empty()) {
        for (const std::string& name : kInterfaces) {
          if (edit_distance(interface.name, name) <= 2 && interface.name.size() + 2 >= name.size())
            meant = name;
        }
      }
      if (meant.empty()) continue;
      // A driver may have interfaces of any other name; a typo is always a fault.
      out.add("ros2_control.interface_name", other_word && !simulated ? Severity::note : Severity::warning,
              subject_of(joint), interface.source,
              fmt::format("the {} interface '{}' is not one of position, velocity, acceleration, effort; did "
                          "you mean '{}'?",
                          what, interface.name, meant),
              fmt::format("write name=\"{}\"", meant));
    }
  }
}

// A joint's state may come from another component, as from an encoder on the output side.
bool has_state(const RobotDescription& robot, const std::string& joint) {
  return std::any_of(robot.hardware.begin(), robot.hardware.end(), [&](const Hardware& hardware) {
    return std::any_of(hardware.joints.begin(), hardware.joints.end(), [&](const HardwareJoint& other) {
      return other.name == joint && !other.state_interfaces.empty();
    });
  });
}

void check_completeness(const AuditInput& in, const HardwareJoint& joint, Findings& out) {
  if (joint.state_interfaces.empty() && joint.command_interfaces.empty()) {
    out.add("ros2_control.no_interface", subject_of(joint), joint.source,
            "it has neither a command nor a state interface",
            "add the interfaces of the hardware, or remove it");
  } else if (!has_state(in.robot, joint.name)) {
    out.add("ros2_control.no_state", subject_of(joint), joint.source,
            "it has a command interface, but no state interface", "add <state_interface name=\"position\"/>");
  }
}

const Interface* find_interface(const std::vector<Interface>& list, std::string_view name) {
  const auto found = std::find_if(list.begin(), list.end(), [&](const auto& i) { return i.name == name; });
  return found == list.end() ? nullptr : &*found;
}

void check_limits(const HardwareJoint& joint, const Joint& urdf, Findings& out) {
  for (const Interface& interface : joint.command_interfaces) {
    if (interface.min && interface.max && *interface.min > *interface.max) {
      out.add("ros2_control.limits_crossed", subject_of(joint), interface.source,
              fmt::format("the {} command's min {:g} is above its max {:g}", interface.name, *interface.min,
                          *interface.max),
              "exchange them");
    }
    const bool own = interface.min && interface.max;
    const bool position = interface.name == "position" && urdf.type != JointType::continuous &&
                          (!urdf.limits || !urdf.limits->has_position);
    const bool velocity = interface.name == "velocity" && (!urdf.limits || !urdf.limits->velocity);
    const bool effort = interface.name == "effort" && (!urdf.limits || !urdf.limits->effort);
    if (own || !(position || velocity || effort)) continue;
    out.add("ros2_control.no_limits", subject_of(joint), interface.source,
            fmt::format(
                "the {0} command has no bounds: neither min and max here nor the {0} of the joint's <limit>",
                interface.name),
            "write the joint's <limit>, which all tools read");
  }
}

void check_initial_value(const HardwareJoint& joint, const Joint& urdf, Findings& out) {
  const Interface* position = find_interface(joint.state_interfaces, "position");
  if (position == nullptr || !position->initial_value || !urdf.limits || !urdf.limits->has_position) return;
  if (urdf.type == JointType::continuous || urdf.limits->lower > urdf.limits->upper) return;
  const double value = *position->initial_value;
  if (value >= urdf.limits->lower - 1e-6 && value <= urdf.limits->upper + 1e-6) return;
  // Two limits of 0 are reported by the rules on limits.
  if (urdf.limits->lower == 0 && urdf.limits->upper == 0) return;
  out.add("ros2_control.initial_value", subject_of(joint), position->source,
          fmt::format("it starts at {:g}, outside its limits {:g} .. {:g}", value, urdf.limits->lower,
                      urdf.limits->upper),
          "choose an initial_value inside the limits");
}

// Within one hardware manager every "joint/interface" exists once.
void check_duplicates(const AuditInput& in, Findings& out) {
  std::map<std::string, const Hardware*> components;
  std::map<std::string, std::pair<const Hardware*, SourceLocation>> seen;
  std::set<std::string> reported;
  for (const Hardware& hardware : in.robot.hardware) {
    const auto [first, fresh] = components.emplace(hardware.name, &hardware);
    if (!fresh && !hardware.name.empty()) {
      out.add("ros2_control.duplicate_component", fmt::format("<ros2_control> '{}'", hardware.name),
              hardware.source,
              fmt::format("another component has this name, at {}", first->second->source.place()),
              "give each <ros2_control> a name of its own");
    }
    for (const auto* list : {&hardware.joints, &hardware.sensors, &hardware.gpios}) {
      for (const HardwareJoint& joint : *list) {
        const auto note = [&](const char* kind, const Interface& interface) {
          const std::string full = fmt::format("{} {}/{}", kind, joint.name, interface.name);
          const auto [before, is_new] = seen.emplace(full, std::pair{&hardware, interface.source});
          if (is_new || joint.name.empty() || !reported.insert(joint.name).second) return;
          out.add("ros2_control.duplicate_interface", subject_of(joint), interface.source,
                  fmt::format("the {} interface '{}/{}' is exported twice; the other is at {}{}", kind,
                              joint.name, interface.name, before->second.second.place(),
                              before->second.first == &hardware
                                  ? ""
                                  : fmt::format(", of '{}'", before->second.first->name)),
                  "keep it in one component only");
        };
        for (const Interface& interface : joint.command_interfaces) note("command", interface);
        for (const Interface& interface : joint.state_interfaces) note("state", interface);
      }
    }
  }
}

void check_undriven(const AuditInput& in, Findings& out) {
  std::set<std::string> known;
  bool any_commands = false;
  for (const Hardware& hardware : in.robot.hardware) {
    for (const HardwareJoint& joint : hardware.joints) {
      known.insert(joint.name);
      any_commands = any_commands || offers_commands(joint);
    }
  }
  if (!any_commands) return;
  Names missing;
  SourceLocation where;
  for (const Joint& joint : in.robot.joints) {
    if (!driven_kind(joint) || joint.mimic || known.contains(joint.name)) continue;
    if (missing.empty()) where = joint.source;
    missing.push_back(joint.name);
  }
  if (missing.empty()) return;
  out.add("ros2_control.undriven_joint",
          missing.size() == 1 ? fmt::format("joint '{}'", missing[0]) : "the robot", where,
          fmt::format("no component of <ros2_control> has {}, which {}", quoted_list(missing),
                      missing.size() == 1 ? "can move" : "can all move"),
          "add them with their interfaces; a joint without an actuator gets only state interfaces, or "
          "becomes fixed");
}

void check_component(const AuditInput& in, const Hardware& hardware, const XmlNode* node, Findings& out) {
  const bool simulated = find_simulator_plugin(hardware.plugin) != nullptr;
  for (const HardwareJoint& joint : hardware.joints) {
    if (joint.name.empty()) continue;
    check_against_urdf(in, joint, node, out);
    check_interface_names(joint, simulated, out);
    check_completeness(in, joint, out);
    const Joint* urdf = in.robot.find_joint(joint.name);
    if (urdf == nullptr || !moves(*urdf)) continue;
    check_limits(joint, *urdf, out);
    check_initial_value(joint, *urdf, out);
  }
}

}  // namespace

void check_ros2_control(const AuditInput& in, Findings& out) {
  const auto nodes = hardware_nodes(in);
  for (std::size_t i = 0; i < in.robot.hardware.size(); ++i) {
    check_component(in, in.robot.hardware[i], i < nodes.size() ? nodes[i] : nullptr, out);
  }
  check_duplicates(in, out);
  check_undriven(in, out);
  check_hardware(in, out);
  check_gazebo(in, out);
  check_arguments(in, out);
}

}  // namespace doppel::audit_rules
