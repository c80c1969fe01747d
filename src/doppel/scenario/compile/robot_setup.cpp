#include "doppel/scenario/compile/robot_setup.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>
#include <string_view>

#include "doppel/base/core/names.h"
#include "doppel/base/core/text.h"
#include "doppel/base/yaml/yaml_text.h"
#include "doppel/description/gazebo/base_plugins.h"
#include "doppel/description/gazebo/model_plugins.h"
#include "doppel/description/overlay/overlay.h"
#include "doppel/scenario/compile/detail/base_wheels.h"
#include "doppel/scenario/resolve/controllers_search.h"
#include "doppel/scenario/resolve/open_target.h"
#include "doppel/scenario/resolve/ros1_controllers.h"
#include "doppel/scenario/schema/robot_names.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

constexpr const char* kBaseController = "base_controller";

std::vector<std::string> joints_to_drive(const RobotDescription& robot) {
  std::set<std::string> offered;
  for (const auto& hardware : robot.hardware) {
    for (const auto& joint : hardware.joints) {
      const bool position = std::any_of(joint.command_interfaces.begin(), joint.command_interfaces.end(),
                                        [](const auto& i) { return i.name == "position"; });
      if (position && robot.find_joint(joint.name) != nullptr) offered.insert(joint.name);
    }
  }
  std::vector<std::string> joints;
  for (const Joint& joint : robot.joints) {
    const bool driven = is_scalar(joint) && leader_of(robot, joint) == nullptr;
    if (driven && (offered.empty() || offered.contains(joint.name))) joints.push_back(joint.name);
  }
  return joints;
}

bool offers_velocities(const RobotDescription& robot, const std::vector<std::string>& joints) {
  if (robot.hardware.empty()) return true;
  return std::all_of(joints.begin(), joints.end(), [&robot](const std::string& name) {
    for (const auto& hardware : robot.hardware) {
      for (const auto& joint : hardware.joints) {
        if (joint.name != name) continue;
        return std::any_of(joint.state_interfaces.begin(), joint.state_interfaces.end(),
                           [](const auto& i) { return i.name == "velocity"; });
      }
    }
    return true;
  });
}

constexpr std::array<std::string_view, 4> kCasterNames{"caster", "castor", "swivel", "wheel"};

// A joint that turns freely below the base: it carries a wheel, or is named as one. The continuous joints of
// an arm on the base are none.
bool is_caster(const ModelInstance& made, const Joint& joint) {
  if (joint.type != JointType::continuous) return false;
  const std::string names = lowered(joint.name + ' ' + joint.child);
  if (std::ranges::any_of(kCasterNames,
                          [&](std::string_view part) { return names.find(part) != std::string::npos; }))
    return true;
  const Model& model = *made.model;
  for (const RollingPart& part : made.rolling) {
    for (int at = part.joint; at >= 0;) {
      const ModelJoint& above = model.joints[static_cast<std::size_t>(at)];
      if (above.name == joint.name) return true;
      at = model.links[static_cast<std::size_t>(above.parent_link)].joint;
    }
  }
  return false;
}

// The wheels belong to the base's controller; other joints that turn without end are casters, which roll freely.
std::vector<std::string> leave_to_base(const ModelInstance& made, const RobotDescription& robot,
                                       const MappedBase& base, std::vector<std::string>& joints) {
  std::vector<std::string> casters;
  std::erase_if(joints, [&](const std::string& name) {
    if (std::find(base.joints.begin(), base.joints.end(), name) != base.joints.end()) return true;
    if (!is_caster(made, *robot.find_joint(name))) return false;
    casters.push_back(name);
    return true;
  });
  return casters;
}

// YAML for a robot without controllers: a broadcaster, and a trajectory controller for `joints`.
// `velocity_states`: the hardware has velocity state interfaces. `base`: nullptr: none.
std::string generated_controllers(const std::vector<std::string>& joints, bool velocity_states,
                                  const MappedBase* base) {
  std::string yaml = "controller_manager:\n  ros__parameters:\n    update_rate: 100\n";
  if (joints.empty() && base == nullptr) return yaml;
  yaml += "    joint_state_broadcaster:\n      type: joint_state_broadcaster/JointStateBroadcaster\n";
  if (base != nullptr) yaml += base->declaration;
  if (joints.empty()) return yaml + base->section;
  yaml +=
      "    joint_trajectory_controller:\n      type: joint_trajectory_controller/JointTrajectoryController\n"
      "joint_trajectory_controller:\n  ros__parameters:\n    joints:\n";
  for (const std::string& joint : joints) yaml += fmt::format("      - {}\n", yaml_text(joint));
  yaml += "    command_interfaces: [position]\n    state_interfaces: [position";
  yaml += velocity_states ? ", velocity]\n" : "]\n";
  return base == nullptr ? yaml : yaml + base->section;
}

void add_chosen(const RobotChoices& choices, RobotSetup& setup) {
  for (const std::string& yaml : choices.parameters)
    setup.controllers.add(ParameterFile::parse(yaml, "<controllers of the scenario>"));
  setup.generated = choices.parameters;
}

void choose_controllers(const Scenario& scenario, const WorldRobot& robot, const PackageResolver& resolver,
                        RobotSetup& setup, Diagnostics& diagnostics) {
  Diagnostics said;
  const RobotChoices* const choices = scenario.choices_of(robot);
  if (choices != nullptr) {
    setup.controllers_named = true;
    setup.controllers_files = choices->controllers;
  } else if (!robot.controllers.empty()) {
    setup.controllers_named = true;
    setup.controllers_files = robot.controllers;
  } else {
    const ControllersSearch found = find_controllers_files(setup.description.robot, setup.target, resolver);
    report(found, said);
    for (const ControllersFile& file : found.files) {
      setup.controllers_files.push_back(file.path);
      if (file.for_ros2) setup.declaring_files.push_back(file.path);
    }
  }
  std::string others;  // becomes part of the note about generated controllers
  for (const Diagnostic& d : said.all()) {
    if (d.rule == "up.controllers_of_others") {
      others += (others.empty() ? "" : "; ") + d.message;
    } else {
      diagnostics.add(d);
    }
  }
  if (!setup.controllers_files.empty()) {
    setup.controllers_origin = setup.controllers_files.front().string();
    const RobotDescription& described = setup.description.robot;
    setup.controllers = load_controllers(setup.controllers_files.front(), described, diagnostics);
    for (std::size_t i = 1; i < setup.controllers_files.size(); ++i)
      setup.controllers.add(load_controllers(setup.controllers_files[i], described, diagnostics));
    NameRules names = scenario.ros.names;
    const std::string manager = names.node(in_namespace(robot.name_space, "controller_manager"));
    report_other_managers(setup.controllers, manager, diagnostics);
    if (choices != nullptr) add_chosen(*choices, setup);
    return;
  }
  if (choices != nullptr) {
    setup.controllers_origin = "the scenario";
    return add_chosen(*choices, setup);
  }
  setup.controllers_origin = kGeneratedOrigin;
  setup.unused_files = others;
}

}  // namespace

ExpandedTarget expand_target(const Scenario& scenario, const WorldRobot& robot, PackageResolver& resolver,
                             Diagnostics& diagnostics) {
  ExpandedTarget out;
  out.target = find_target(robot.target, scenario.bundled_robots, resolver);
  out.arguments = robot.arguments;
  out.description = scenario.choices_of(robot) != nullptr
                        ? expand_corrected(out.target.description, out.arguments, resolver, diagnostics)
                        : expand_for_simulation(out.target.description, out.arguments, resolver, diagnostics);
  return out;
}

std::optional<ExpandedDescription> expanded_if_possible(const Scenario& scenario, const WorldRobot& robot) {
  PackageResolver resolver;
  Diagnostics ignored;
  try {
    return expand_target(scenario, robot, resolver, ignored).description;
  } catch (const InputError&) {
    return std::nullopt;
  }
}

namespace {

// Adds the parameters of the command line to those of the controllers, and sets their namespace.
void address(const Scenario& scenario, const WorldRobot& robot, RobotSetup& setup) {
  add_ros_parameters(scenario.ros, setup.controllers);
  setup.controllers.set_home(robot.name_space);
}

// The part that depends only on the description.
void complete(const Scenario& scenario, const WorldRobot& robot, const PackageResolver& resolver,
              RobotSetup& setup, Diagnostics& diagnostics) {
  choose_controllers(scenario, robot, resolver, setup, diagnostics);
  if (setup.controllers_origin != kGeneratedOrigin) address(scenario, robot, setup);
}

}  // namespace

RobotSetup set_up_robot(const Scenario& scenario, const WorldRobot& robot, PackageResolver& resolver,
                        Diagnostics& diagnostics) {
  RobotSetup setup;
  ExpandedTarget found = expand_target(scenario, robot, resolver, diagnostics);
  setup.target = std::move(found.target);
  setup.arguments = std::move(found.arguments);
  setup.expanded = std::make_shared<const ExpandedDescription>(std::move(found.description));
  setup.description.robot = read_description(*setup.expanded, resolver, diagnostics);
  diagnostics.throw_if_errors();
  setup.description.files = setup.expanded->files;
  complete(scenario, robot, resolver, setup, diagnostics);
  return setup;
}

RobotSetup set_up_robot(const Scenario& scenario, const WorldRobot& robot, RobotDescription description,
                        Diagnostics& diagnostics) {
  RobotSetup setup;
  setup.description.robot = std::move(description);
  complete(scenario, robot, PackageResolver(), setup, diagnostics);
  return setup;
}

RobotSetup set_up_model(const Scenario& scenario, const WorldRobot& robot, const std::string& world,
                        RobotDescription description, Diagnostics& diagnostics) {
  RobotSetup setup;
  const auto mapped = map_model_plugins(description, world, diagnostics);
  if (!mapped) {
    throw InputError("up.model_plugin", description.source,
                     fmt::format("no plugin of the model '{}' drives it", description.name));
  }
  for (const Joint& joint : description.joints) {
    if (std::ranges::find(mapped->joints, joint.name) == mapped->joints.end())
      setup.free_joints.push_back(joint.name);
  }
  setup.description.robot = std::move(description);
  setup.from_plugins = true;
  setup.controllers_origin = "its plugins";
  setup.controllers = ParameterFile::parse(mapped->yaml, "<controllers from plugins>");
  address(scenario, robot, setup);
  return setup;
}

void generate_controllers(const Scenario& scenario, const WorldRobot& robot, const ModelInstance& made,
                          RobotSetup& setup, Diagnostics& diagnostics) {
  const RobotDescription& description = setup.description.robot;
  Diagnostics unused;  // of controllers that are not started
  Diagnostics& notes = scenario.start_controllers ? diagnostics : unused;
  auto base = map_base_plugin(description, PluginTopics::relative, notes);
  if (!base) {
    base = base_for_wheels(base_wheels(made), description, kBaseController, notes);
    if (base)
      notes.note("up.base_generated", description.source, generated_base_text(*base),
                 "declare your own controllers with --controllers FILE");
  }
  auto joints = joints_to_drive(description);
  if (base) setup.free_joints = leave_to_base(made, description, *base, joints);
  if (joints.empty() && base) {
    if (!setup.unused_files.empty())
      notes.note("up.controllers_of_others", description.source, setup.unused_files);
  } else if (joints.empty()) {
    diagnostics.note("up.nothing_to_drive", description.source, "no joint of this robot can be driven");
  } else {
    notes.note(
        "up.controllers_generated", description.source,
        fmt::format("no controllers' YAML of this robot was found; created a joint_state_broadcaster and a "
                    "joint_trajectory_controller with {} joint{}{}{}",
                    joints.size(), joints.size() == 1 ? "" : "s", setup.unused_files.empty() ? "" : "; ",
                    setup.unused_files),
        "give your own file with --controllers FILE, or put it into the package's config/");
  }
  setup.generated = {
      generated_controllers(joints, offers_velocities(description, joints), base ? &*base : nullptr)};
  setup.controllers = ParameterFile::parse(setup.generated.front(), "<generated controllers>");
  address(scenario, robot, setup);
}

void add_spare_base(const ModelInstance& made, RobotSetup& setup) {
  const RobotDescription& description = setup.description.robot;
  std::string name = kBaseController;
  const auto declared = controllers_in(setup.controllers).controllers;
  while (std::ranges::any_of(declared, [&](const DeclaredController& c) { return c.name == name; }))
    name += "_rest";
  Diagnostics unused;  // whether it is needed is not known yet
  const auto base = base_for_wheels(base_wheels(made), description, name, unused);
  if (!base) return;
  std::vector<std::string> others = joints_to_drive(description);
  setup.spare_base = {base->name, generated_base_text(*base), base->joints,
                      leave_to_base(made, description, *base, others)};
  setup.generated = {"controller_manager:\n  ros__parameters:\n" + base->declaration + base->section};
  setup.controllers.add(ParameterFile::parse(setup.generated.front(), "<generated controllers>"));
}

}  // namespace doppel
