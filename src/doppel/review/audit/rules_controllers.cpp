// The controllers' YAML compared with the description, in both directions. A controller that doppel has is
// initialised as by `doppel up`, on a bus of its own, so that both report the same faults of its parameters.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "doppel/base/core/names.h"
#include "doppel/control/controllers/builtin.h"
#include "doppel/control/manager/distro_differences.h"
#include "doppel/review/audit/detail/controllers.h"
#include "doppel/review/audit/detail/ros_rules.h"

namespace doppel::audit_rules {
namespace {

constexpr double kPhysicsRate = 1000;  // Hz, doppel's and Gazebo's usual step

void check_types(const ControllersFile& file, const ControllerRegistry& registry, Findings& out) {
  Names known = registry.names();
  for (const ControllerTypeRow& row : ros2_controller_types()) known.emplace_back(row.type);
  for (const DeclaredController& c : file.controllers) {
    if (c.type.empty()) {
      out.add("controllers.no_type", c.subject(), c.where, fmt::format("'{}' has no type", c.name),
              fmt::format("write {}: {{type: ...}} below controller_manager", c.name));
      continue;
    }
    if (contains(known, c.type)) continue;
    const auto near = std::find_if(known.begin(), known.end(),
                                   [&](const std::string& name) { return edit_distance(name, c.type) <= 3; });
    if (near == known.end()) continue;  // a user's own controller
    out.add("controllers.unknown_type", c.subject(), c.where,
            fmt::format("there is no controller type '{}'; did you mean '{}'?", c.type, *near),
            fmt::format("write type: {}", *near));
  }
}

void check_sections(const ControllersFile& file, Findings& out) {
  Names without, declared;
  for (const DeclaredController& c : file.controllers) {
    declared.push_back(c.name);
    if (c.parameters.all().empty() && !c.has_other_files) without.push_back(c.name);
  }
  for (const auto& [section, where] : file.other_sections) {
    const auto near = nearest_name(section, without);
    if (!near) continue;
    std::erase(without, *near);
    out.add("controllers.section_of_nobody", fmt::format("section '{}'", section), where,
            fmt::format("this section belongs to no controller, and '{}' has no section; did you mean '{}'?",
                        *near, *near),
            "give both the same name");
  }
  for (const DeclaredController& c : file.controllers) {
    const bool needs = c.type.find("Trajectory") != std::string::npos ||
                       c.type.find("Group") != std::string::npos ||
                       c.type.find("Forward") != std::string::npos;
    if (!needs || !contains(without, c.name)) continue;
    out.add("controllers.no_section", c.subject(), c.where,
            fmt::format("'{}' is declared, but has no section with parameters", c.name),
            fmt::format("add {}: {{ros__parameters: {{joints: [...]}}}}", c.name));
  }
}

class JointCheck {
 public:
  JointCheck(const AuditInput& in, const ControllersFile& file, Findings& out)
      : in_(in), file_(file), out_(out), names_(joint_names(in.robot)) {}

  void check(const DeclaredController& c) {
    certain_ = file_.named && mostly_known(c);
    for (const char* parameter :
         {"joints", "command_joints", "dof_names", "joint", "left_wheel_names", "right_wheel_names"}) {
      // A broadcaster lists joints with a state, which may be any joint.
      const bool commands = !c.broadcasts();
      check_list(c, parameter, commands);
    }
  }

 private:
  void check_list(const DeclaredController& c, const char* parameter, bool commands) {
    std::set<std::string> seen;
    for (const auto& [name, where] : c.texts(parameter)) {
      const std::string text = fmt::format("'{}' of '{}'", parameter, c.name);
      if (!seen.insert(name).second) {
        add("controllers.joint_twice", c, where, fmt::format("{} lists '{}' twice", text, name),
            "remove one of them");
        continue;
      }
      const Joint* joint = in_.robot.find_joint(name);
      if (joint == nullptr) {
        // Chained controllers name another controller's interface: "other/joint".
        if (name.find('/') != std::string::npos) continue;
        add("controllers.unknown_joint", c, where,
            fmt::format("{} lists '{}', which the robot does not have{}", text, name,
                        did_you_mean(name, names_)),
            "use the joint name of the URDF");
      } else if (commands && !moves(*joint)) {
        add("controllers.fixed_joint", c, where, fmt::format("{} lists '{}', which is fixed", text, name),
            "remove it from the list");
      } else if (commands && joint->mimic) {
        out_.add("controllers.mimic_joint", c.subject(), where,
                 fmt::format("{} lists '{}', which mimics '{}' and has no actuator", text, name,
                             joint->mimic->joint),
                 fmt::format("remove it; it mimics '{}' automatically", joint->mimic->joint));
      }
    }
  }

  // A controller with few joints of this robot belongs to another variant of it.
  [[nodiscard]] bool mostly_known(const DeclaredController& c) const {
    const auto joints = c.driven_joints();
    const auto known = std::count_if(joints.begin(), joints.end(), [&](const std::string& name) {
      return in_.robot.find_joint(name) != nullptr;
    });
    return 2 * known >= static_cast<std::ptrdiff_t>(joints.size());
  }

  // A file that was only found beside the description may belong to a variant of the robot as well.
  void add(const char* rule, const DeclaredController& c, const SourceLocation& where, std::string message,
           std::string fix) {
    if (certain_)
      out_.add(rule, c.subject(), where, std::move(message), std::move(fix));
    else
      out_.add(rule, Severity::warning, c.subject(), where, std::move(message), std::move(fix));
  }

  const AuditInput& in_;
  const ControllersFile& file_;
  Findings& out_;
  Names names_;
  bool certain_ = false;  // the controller is this robot's
};

// The interfaces of the hardware: "joint/interface" -> where.
struct Offer {
  std::set<std::string> commands, states;
};

Offer offer_of(const RobotDescription& robot) {
  Offer out;
  for (const HardwareDescription& hardware : robot.hardware) {
    for (const auto* list : {&hardware.joints, &hardware.sensors, &hardware.gpios}) {
      for (const HardwareJointDescription& joint : *list) {
        for (const auto& i : joint.command_interfaces) out.commands.insert(joint.name + "/" + i.name);
        for (const auto& i : joint.state_interfaces) out.states.insert(joint.name + "/" + i.name);
      }
    }
  }
  return out;
}

// "; it offers 'velocity'", "; 'j1' offers 'positon', 'j3' offers 'velocity'"; empty: they offer nothing.
std::string offers_text(const std::set<std::string>& offered, const Names& joints) {
  std::vector<std::pair<Names, Names>> groups;  // what is offered, by whom
  for (const std::string& joint : joints) {
    Names interfaces;
    for (const std::string& full : offered) {
      if (full.starts_with(joint + "/")) interfaces.push_back(full.substr(joint.size() + 1));
    }
    const auto same = std::find_if(groups.begin(), groups.end(),
                                   [&](const auto& group) { return group.first == interfaces; });
    if (same == groups.end())
      groups.push_back({interfaces, {joint}});
    else
      same->second.push_back(joint);
  }
  std::vector<std::string> out;
  for (const auto& [interfaces, holders] : groups) {
    const std::string what = interfaces.empty() ? "nothing" : quoted_list(interfaces);
    const bool one = holders.size() == 1;
    if (groups.size() > 1)
      out.push_back(fmt::format("{} {} {}", quoted_list(holders), one ? "offers" : "offer", what));
    else if (!interfaces.empty())
      out.push_back(fmt::format("{} {}", one ? "it exports" : "they export", what));
  }
  return out.empty() ? "" : fmt::format("; {}", fmt::join(out, ", "));
}

void check_interfaces(const AuditInput& in, const ControllersFile& file, const DeclaredController& c,
                      const Offer& offer, Findings& out) {
  for (const bool commands : {true, false}) {
    const char* kind = commands ? "command" : "state";
    const auto& offered = commands ? offer.commands : offer.states;
    for (const auto& [interface, where] : c.interfaces(commands)) {
      Names missing;
      for (const std::string& name : c.driven_joints()) {
        const Joint* joint = in.robot.find_joint(name);
        const bool silent = joint == nullptr || !moves(*joint) || (commands && joint->mimic);
        if (!silent && !offered.contains(name + "/" + interface)) missing.push_back(name);
      }
      if (missing.empty()) continue;
      out.add(commands ? "controllers.command_interface" : "controllers.state_interface",
              file.named ? Severity::error : Severity::warning, c.subject(), where,
              fmt::format("it requires the {} interface '{}' of {}, which <ros2_control> does not export{}",
                          kind, interface, quoted_list(missing), offers_text(offered, missing)),
              fmt::format("add <{}_interface name=\"{}\"/> to the joint, or use another interface", kind,
                          interface));
    }
  }
}

void check_idle_gains(const AuditInput& in, const DeclaredController& c, Findings& out) {
  if (c.type != "joint_trajectory_controller/JointTrajectoryController") return;
  const auto commands = c.interfaces(true);
  if (commands.empty()) return;
  const bool pid = commands.size() == 1 && (commands[0].first == "velocity" || commands[0].first == "effort");
  if (pid) return;
  Names joints, listed;
  for (const auto& [name, where] : commands) listed.push_back(name);
  SourceLocation where;
  for (const ParameterOverride& o : c.parameters.all()) {
    if (!o.name.starts_with("gains.")) continue;
    const std::size_t end = o.name.rfind('.');
    const std::string key = o.name.substr(end + 1);
    const auto* number = std::get_if<double>(&o.value);
    const auto* whole = std::get_if<std::int64_t>(&o.value);
    const bool set = (number != nullptr && *number != 0) || (whole != nullptr && *whole != 0);
    if (!set || (key != "p" && key != "i" && key != "d" && !key.starts_with("ff_velocity"))) continue;
    const std::string joint = end > 6 ? o.name.substr(6, end - 6) : "";
    if (joints.empty()) where = o.source;
    if (!contains(joints, joint)) joints.push_back(joint);
  }
  if (joints.empty()) return;
  const bool simulated = std::any_of(in.robot.hardware.begin(), in.robot.hardware.end(), [](const auto& h) {
    return find_simulator_plugin(h.plugin) != nullptr;
  });
  out.add(
      "controllers.idle_gains", c.subject(), where,
      fmt::format(
          "the gains of {} have no effect: with command_interfaces [{}] no PID runs. {}", quoted_list(joints),
          fmt::join(listed, ", "),
          simulated ? "The stiffness is set by the simulator: in Gazebo by position_proportional_gain of its "
                      "plugin, in doppel by the servo model, computed from the inertia carried by the joint"
                    : "The stiffness is set by the servo or the driver's own loop"),
      "remove the gains, or command only velocity or only effort");
}

void check_rates(const ControllersFile& file, Findings& out) {
  const double rate = file.update_rate;
  if (rate > kPhysicsRate) {
    out.add("controllers.rate_above_physics", Severity::warning, "controller_manager", file.rate_where,
            fmt::format("update_rate {:g} Hz is above the physics rate of {:g} Hz", rate, kPhysicsRate),
            "choose a rate that divides the physics rate");
  } else if (rate > 0 && std::abs(std::round(kPhysicsRate / rate) * rate - kPhysicsRate) > 1e-6) {
    out.add("controllers.rate_uneven", "controller_manager", file.rate_where,
            fmt::format("update_rate {:g} Hz does not divide the usual physics rate of {:g} Hz; it runs at "
                        "{:.5g} Hz in simulation",
                        rate, kPhysicsRate, kPhysicsRate / std::round(kPhysicsRate / rate)),
            "choose 50, 100, 125, 200, 250, 500 or 1000");
  }
  for (const DeclaredController& c : file.controllers) {
    const auto own = c.number("update_rate");
    if (!own || own->first <= 0 || rate <= 0) continue;
    if (own->first > rate) {
      out.add(
          "controllers.rate_above_manager", c.subject(), own->second,
          fmt::format("its update_rate {:g} Hz is above the controller manager's {:g} Hz", own->first, rate),
          fmt::format("choose at most {:g}, or raise the manager's rate", rate));
    } else if (std::abs(std::round(rate / own->first) * own->first - rate) > 1e-6) {
      out.add("controllers.rate_uneven", c.subject(), own->second,
              fmt::format("its update_rate {:g} Hz does not divide the controller manager's {:g} Hz",
                          own->first, rate),
              fmt::format("choose {:g} divided by an integer", rate));
    }
  }
}

// In ROS 2 one active controller claims an interface; the YAML does not show which ones are started.
void check_claims(const ControllersFile& file, Findings& out) {
  std::map<std::string, const DeclaredController*> holder;
  std::set<std::pair<const DeclaredController*, const DeclaredController*>> reported;
  for (const DeclaredController& c : file.controllers) {
    for (const auto& [interface, where] : c.interfaces(true)) {
      for (const std::string& joint : c.driven_joints()) {
        const auto [first, fresh] = holder.emplace(joint + "/" + interface, &c);
        if (fresh || first->second == &c || !reported.insert({first->second, &c}).second) continue;
        out.add("controllers.shared_claim", c.subject(), where,
                fmt::format("it claims '{}/{}', and so does '{}'; only one of them can be active", joint,
                            interface, first->second->name),
                "activate one of them and load the other inactive; `doppel up` takes --activate");
      }
    }
  }
}

void check_uncontrolled(const AuditInput& in, const ControllersFile& file, Findings& out) {
  std::set<std::string> controlled;
  for (const DeclaredController& c : file.controllers) {
    // The parameters of an unknown controller cannot be checked.
    if (!c.known_kind() && !c.broadcasts()) return;
    for (const std::string& joint : c.driven_joints()) controlled.insert(joint);
  }
  if (controlled.empty()) return;
  Names missing;
  SourceLocation where;
  for (const HardwareDescription& hardware : in.robot.hardware) {
    for (const HardwareJointDescription& joint : hardware.joints) {
      const Joint* urdf = in.robot.find_joint(joint.name);
      if (!offers_commands(joint) || urdf == nullptr || urdf->mimic || !moves(*urdf)) continue;
      if (controlled.contains(joint.name) || contains(missing, joint.name)) continue;
      if (missing.empty()) where = joint.source;
      missing.push_back(joint.name);
    }
  }
  if (missing.empty()) return;
  out.add("controllers.uncontrolled_joint",
          missing.size() == 1 ? fmt::format("joint '{}'", missing[0]) : "the robot", where,
          fmt::format("no controller of {} commands {}", file.path.filename().string(), quoted_list(missing)),
          "add it to a controller's joints, or remove its command interface");
}

}  // namespace

void check_controllers(const AuditInput& in, Findings& out) {
  const ControllerRegistry registry = builtin_controllers();
  const Offer offer = offer_of(in.robot);
  for (ControllersFile& file : read_controllers(in, out)) {
    check_types(file, registry, out);
    check_sections(file, out);
    JointCheck joints(in, file, out);
    for (DeclaredController& c : file.controllers) {
      joints.check(c);
      if (!in.robot.hardware.empty()) check_interfaces(in, file, c, offer, out);
      check_idle_gains(in, c, out);
      if (const auto* type = registry.find(c.type)) check_parameters(in, file, c, *type, out);
    }
    check_rates(file, out);
    check_claims(file, out);
    check_uncontrolled(in, file, out);
  }
}

}  // namespace doppel::audit_rules
