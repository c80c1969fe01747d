#include "doppel/scenario/compile/compiled_robot.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "doppel/base/core/names.h"
#include "doppel/description/urdf/urdf_writer.h"
#include "doppel/physics/contract/described_servo.h"
#include "doppel/robot/collision/lowest_point.h"
#include "doppel/ros/messages/distro.h"
#include "doppel/scenario/compile/detail/base_axes.h"
#include "doppel/scenario/compile/rolling_report.h"
#include "doppel/scenario/compile/simulated_hardware.h"
#include "doppel/scenario/resolve/open_target.h"

namespace doppel {
namespace {

// The newest version of URDF that the parser of a distribution reads: urdfdom 4.0 and 5.0 refuse a file of
// another version than 1.0.
UrdfVersion read_by_ros(Distro distro) {
  return distro >= Distro::lyrical ? kUrdf12 : UrdfVersion{};
}

constexpr double kMinAirHeight = 0.01;  // m between the ground and a robot that nothing carries

// Below the floating joint that a floating base is compiled with; a floating joint of the description has its
// own parent, which is the root.
const char* root_name(const Model& model, BaseKind base) {
  return model.links[base == BaseKind::floating ? 1 : 0].name.c_str();
}

// The choices made on the user's behalf, with the height of a floating root.
void report_base(const RobotDescription& robot, const Instance& instance, const BaseChoice& choice,
                 bool asked_for, Diagnostics& diagnostics) {
  const Model& model = instance.model();
  if (asked_for || (model.links.front().name == "world" && choice.kind == BaseKind::fixed)) return;
  if (choice.kind == BaseKind::floating) {
    diagnostics.note(
        "up.base_floating", robot.source,
        fmt::format("the base is floating because {}; it is placed on the ground, with '{}' at z = {:.3f} m",
                    choice.reason, root_name(model, choice.kind), instance.link_pose(1).translation().z()),
        "--base fixed fixes it at the origin of the world");
    return;
  }
  diagnostics.note("up.base_fixed", robot.source,
                   fmt::format("the root link '{}' is fixed to the world: {}", root_name(model, choice.kind),
                               choice.reason),
                   "--base floating lets it move freely");
}

void report_wheels(const RobotDescription& robot, const Instance& instance, Diagnostics& diagnostics) {
  const RollingReport report = report_rolling(instance);
  if (report.parts.empty()) return;
  diagnostics.note("up.wheels", robot.source, fmt::format("'{}' {}", robot.name, to_string(report)),
                   "<doppel:contact>cylinder</doppel:contact> in the <gazebo> of a wheel keeps its shape");
}

void report_weightless(const RobotDescription& robot, const Model& model, Diagnostics& diagnostics) {
  std::vector<std::string> names;
  for (const ModelLink& link : model.links) {
    if (link.weightless) names.push_back(link.name);
  }
  if (names.empty()) return;
  diagnostics.note(
      "up.gravity_off", robot.find_link(names.front())->source,
      fmt::format("<gazebo> turns gravity off for '{}'{}: mass and inertia are kept", names.front(),
                  names.size() > 1 ? fmt::format(" and {} more links", names.size() - 1) : ""));
}

// Joints are driven directly: what a transmission says of gears and actuators is not simulated.
void report_transmissions(const RobotDescription& robot, Diagnostics& diagnostics) {
  for (const Transmission& transmission : robot.transmissions) {
    const bool simple = transmission.type.empty() ||
                        transmission.type == "transmission_interface/SimpleTransmission" ||
                        transmission.type == "SimpleTransmission";
    std::vector<std::string> ignored;
    if (!simple) ignored.push_back(fmt::format("the type '{}'", transmission.type));
    for (const auto* elements : {&transmission.joints, &transmission.actuators}) {
      for (const Transmission::Element& element : *elements) {
        if (element.mechanical_reduction && *element.mechanical_reduction != 1.0)
          ignored.push_back(
              fmt::format("mechanicalReduction {:g} of '{}'", *element.mechanical_reduction, element.name));
      }
    }
    if (ignored.empty()) continue;
    diagnostics.note(
        "up.transmission", transmission.source,
        fmt::format("{} in the transmission '{}' {} no effect: commands, states and limits are those of the "
                    "joint, not of the actuator",
                    fmt::join(ignored, ", "), transmission.name, ignored.size() == 1 ? "has" : "have"));
  }
}

// An arm that a pose puts into the air, where nothing carries it.
void report_height(const CompiledRobot& robot, const Instance& instance, Diagnostics& diagnostics) {
  const ModelInstance& made = robot.instance();
  const CompiledWorld& world = instance.engine().world();
  if (made.floating() || !world.settings().ground || !(made.X_WR.translation().z() > kMinAirHeight)) return;
  if (std::ranges::any_of(world.instances(), [](const ModelInstance& one) { return one.is_object(); }))
    return;
  const double lowest =
      lowest_point(made.shapes, [&](std::size_t link) { return instance.link_pose(static_cast<int>(link)); });
  if (!(lowest > kMinAirHeight) || !std::isfinite(lowest)) return;
  diagnostics.note(
      "up.stands_in_air", robot.asked().source.known() ? robot.asked().source : robot.description().source,
      fmt::format("'{}' is fixed with its lowest point {:.3g} m above the ground, and the world has nothing "
                  "that carries it",
                  robot.description().name, lowest),
      "add a table or a pedestal to the world file, or set the z of the robot's pose to 0");
}

// Values of Gazebo's contacts for which the engine has its own.
void report_contact_values(const RobotDescription& robot, Diagnostics& diagnostics) {
  const std::pair<const char*, std::optional<double> ContactSurface::*> values[] = {
      {"<kp>", &ContactSurface::kp},
      {"<kd>", &ContactSurface::kd},
      {"<maxVel>", &ContactSurface::max_velocity},
      {"<minDepth>", &ContactSurface::min_depth}};
  std::vector<std::string> names;
  const GazeboExtension* first = nullptr;
  for (const auto& [name, value] : values) {
    for (const GazeboExtension& extension : robot.gazebo) {
      if (!(extension.surface.*value)) continue;
      if (first == nullptr) first = &extension;
      names.emplace_back(name);
      break;
    }
  }
  if (names.empty()) return;
  diagnostics.note(
      "up.contact_values", first->source,
      fmt::format("{} in <gazebo> {} no effect: contacts are as stiff and damped as the engine makes them",
                  fmt::join(names, ", "), names.size() == 1 ? "has" : "have"));
}

// Joints with an effort command interface and almost no inertia (ServoParameters::rotor_inertia).
void report_rotors(const RobotDescription& robot, const Model& model,
                   const std::vector<ServoParameters>& servos,
                   const std::vector<HardwareDescription>& hardware, Diagnostics& diagnostics) {
  std::vector<std::string> names;
  double largest = 0.0;
  for (const HardwareDescription& component : hardware) {
    for (const HardwareJointDescription& entry : component.joints) {
      const int index = model.find_joint(entry.name);
      const double rotor = index < 0 ? 0.0 : servos[static_cast<std::size_t>(index)].rotor_inertia;
      const bool effort = std::any_of(entry.command_interfaces.begin(), entry.command_interfaces.end(),
                                      [](const auto& i) { return i.name == kEffort; });
      if (!effort || !(rotor > 0) || robot.hardware.empty()) continue;
      names.push_back(entry.name);
      largest = std::max(largest, rotor);
    }
  }
  if (names.empty()) return;
  const Joint* const first = robot.find_joint(names.front());
  diagnostics.note(
      "up.rotor_inertia", first != nullptr ? first->source : robot.source,
      fmt::format("'{}'{} has so little inertia that its effort limit accelerates it to its velocity limit "
                  "within 0.1 ms; for effort commands, a motor inertia of up to {:.2g} kg m^2 is added",
                  names.front(), names.size() > 1 ? fmt::format(" and {} more joints", names.size() - 1) : "",
                  largest),
      "compare the effort limit and the link's inertia with the drive's datasheet");
}

// Values of <doppel:servo> that no engine simulates, and those of joints without a drive.
void report_described_servos(const RobotDescription& robot, const Model& model, Diagnostics& diagnostics) {
  const std::vector<DescribedServo> all = described_servos(robot, diagnostics);
  const DescribedServo* first = nullptr;
  std::size_t joints = 0;
  std::set<std::string> effects;
  for (const DescribedServo& servo : all) {
    const int index = model.find_joint(servo.joint);
    const ModelJoint* joint = index < 0 ? nullptr : &model.joints[static_cast<std::size_t>(index)];
    if (joint == nullptr || !joint->scalar() || joint->mimics()) {
      diagnostics.warning("servo.value", servo.source,
                          fmt::format("<doppel:servo> is of '{}', which is no joint with a drive; it has no "
                                      "effect",
                                      servo.joint),
                          "doppel tree lists links and joints");
      continue;
    }
    if (servo.delay > 0.0) effects.insert("delay");
    if (servo.backlash > 0.0) effects.insert("backlash");
    if (servo.resolution > 0.0) effects.insert("resolution");
    if (!(servo.delay > 0.0) && !(servo.backlash > 0.0) && !(servo.resolution > 0.0)) continue;
    if (first == nullptr) first = &servo;
    ++joints;
  }
  if (first == nullptr) return;
  diagnostics.note("up.servo_effects", first->source,
                   fmt::format("{} of the servo of '{}'{} {} described, but not simulated by any engine",
                               fmt::join(effects, ", "), first->joint,
                               joints > 1 ? fmt::format(" and {} more joints", joints - 1) : "",
                               effects.size() == 1 ? "is" : "are"),
                   "the other values of <doppel:servo> act: stiffness, damping, armature");
}

// The sensors of the description stay, whatever drives its joints.
HardwareDescription generated_with_sensors(const Model& model, const RobotDescription& robot) {
  HardwareDescription out = generated_hardware(model);
  for (const HardwareDescription& written : robot.hardware)
    out.sensors.insert(out.sensors.end(), written.sensors.begin(), written.sensors.end());
  return out;
}

bool offers_positions(const RobotDescription& robot) {
  for (const HardwareDescription& hardware : robot.hardware) {
    for (const HardwareJointDescription& joint : hardware.joints) {
      const bool position =
          std::ranges::find(joint.command_interfaces, kPosition, &HardwareInterfaceDescription::name) !=
          joint.command_interfaces.end();
      if (position && robot.find_joint(joint.name) != nullptr) return true;
    }
  }
  return false;
}

bool generates_hardware(const RobotSetup& setup, const std::optional<RobotChoices>& choices) {
  if (choices) return choices->generated_hardware;
  const RobotDescription& robot = setup.description.robot;
  return robot.hardware.empty() || (setup.controllers_origin == kGeneratedOrigin && !offers_positions(robot));
}

// The interfaces of joints that the robot does not have, where no hardware is made of them, which reports
// them itself.
void report_unknown_joints(const RobotDescription& robot, Diagnostics& diagnostics) {
  std::vector<std::string> names;
  for (const Joint& joint : robot.joints) names.push_back(joint.name);
  for (const HardwareDescription& hardware : robot.hardware) {
    for (const HardwareJointDescription& joint : hardware.joints) {
      if (robot.find_joint(joint.name) != nullptr) continue;
      diagnostics.warning(
          "ros2_control.unknown_joint", joint.source,
          fmt::format(
              "<ros2_control> '{}' lists the joint '{}', which the robot does not have; it is ignored{}",
              hardware.name, joint.name, did_you_mean(joint.name, names)),
          "use the name of the <joint> element, or remove the entry");
    }
  }
}

void report_generated_hardware(const RobotDescription& robot, Diagnostics& diagnostics) {
  diagnostics.note(
      "up.hardware_generated", robot.source,
      robot.hardware.empty()
          ? "there is no <ros2_control>; every joint that can be driven gets simulated interfaces"
          : "no joint in <ros2_control> has a position command interface; every joint that can be driven "
            "gets simulated interfaces instead");
}

// A model's description as a robot's: under its name, with its files as absolute URIs, and as URDF text.
RobotDescription as_robot(RobotDescription description, const std::string& name) {
  const auto absolute = [](const std::string& file) {
    std::error_code none;
    return file.empty() ? file : std::filesystem::absolute(file, none).lexically_normal().string();
  };
  const auto take = [&absolute](Geometry& geometry) {
    auto* const mesh = std::get_if<MeshGeometry>(&geometry);
    if (mesh == nullptr || mesh->path.empty()) return;
    mesh->path = absolute(mesh->path);
    mesh->uri = "file://" + mesh->path;
  };
  for (Link& link : description.links) {
    for (Collision& collision : link.collisions) take(collision.geometry);
    for (Visual& visual : link.visuals) {
      take(visual.geometry);
      if (visual.material) visual.material->texture_path = absolute(visual.material->texture_path);
    }
  }
  description.name = name;
  description.xml = write_urdf(description, read_by_ros(ros_distro()));
  return description;
}

// All data of a component that controllers and hardware use.
std::string signature(const HardwareDescription& hardware) {
  std::string out = hardware.name + '\n' + hardware.plugin + '\n';
  for (const auto* parts : {&hardware.joints, &hardware.sensors, &hardware.gpios}) {
    for (const HardwareJointDescription& part : *parts) {
      out += "part " + part.name + '\n';
      for (const auto& i : part.command_interfaces) out += "command " + i.name + '\n';
      for (const auto& i : part.state_interfaces) out += "state " + i.name + '\n';
    }
  }
  // The place to which a sensor is bound must not change; a joint's values may change while controllers
  // continue.
  for (const HardwareJointDescription& sensor : hardware.sensors) {
    for (const auto& [name, value] : sensor.params) out += "param " + name + '=' + value + '\n';
    for (const auto& i : sensor.state_interfaces)
      if (i.initial_value) out += "initial " + i.name + '=' + fmt::format("{}", *i.initial_value) + '\n';
  }
  return out;
}

bool same_joint(const ModelJoint& a, const ModelJoint& b) {
  return a.name == b.name && a.type == b.type && a.q == b.q && a.v == b.v && a.parent_link == b.parent_link &&
         a.mimic_leader == b.mimic_leader;
}

Model scaled(Model model, const RobotFactors& factors) {
  for (ModelLink& link : model.links) {
    if (!link.inertia) continue;
    link.inertia->mass *= factors.mass;
    link.inertia->I *= factors.mass;
  }
  model.total_mass *= factors.mass;
  for (ModelJoint& joint : model.joints) {
    joint.friction *= factors.friction;
    joint.damping *= factors.friction;
  }
  return model;
}

}  // namespace

CompiledRobot::CompiledRobot(const WorldRobot& asked, const Scenario& scenario, const World& world,
                             std::optional<BaseKind> running, PackageResolver& resolver,
                             CollisionMeshes& meshes, Diagnostics& diagnostics)
    : asked_(asked) {
  const auto setup = std::make_shared<RobotSetup>(set_up_robot(scenario, asked, resolver, diagnostics));
  setup_ = setup;
  build(scenario, world, running, *setup, meshes, diagnostics);
}

CompiledRobot::CompiledRobot(const WorldRobot& asked, const Scenario& scenario, const World& world,
                             RobotDescription description, CollisionMeshes& meshes, Diagnostics& diagnostics)
    : asked_(asked) {
  const auto setup =
      std::make_shared<RobotSetup>(set_up_robot(scenario, asked, std::move(description), diagnostics));
  setup_ = setup;
  build(scenario, world, std::nullopt, *setup, meshes, diagnostics);
}

CompiledRobot::CompiledRobot(const WorldRobot& asked, const Scenario& scenario, const World& world,
                             const SdfModel& model, const std::string& name, CollisionMeshes& meshes,
                             Diagnostics& diagnostics)
    : asked_(asked), base_{model.base, "it is a model of the world"}, base_decided_(true) {
  const auto setup = std::make_shared<RobotSetup>(
      set_up_model(scenario, asked, world.name, as_robot(*model.description, name), diagnostics));
  setup_ = setup;
  SdfModel own = model;
  own.description = std::shared_ptr<const RobotDescription>(setup_, &setup->description.robot);
  made_ = make_instance(own, name, meshes, diagnostics);
  made_.passive = false;
  gravity_R_ = made_.X_WR.linear().transpose() * world.gravity;
  made_.servos = choose_servos(*made_.model, ServoOptions{.ideal = scenario.ideal}, gravity_R_);
  sensors_ = find_sensors(own, *made_.model, diagnostics);
}

void CompiledRobot::build(const Scenario& scenario, const World& world, std::optional<BaseKind> running,
                          RobotSetup& setup, CollisionMeshes& meshes, Diagnostics& diagnostics) {
  const RobotDescription& robot = description();
  const bool has_world = robot.find_link("world") != nullptr;
  if (const RobotChoices* const chosen = scenario.choices_of(asked_)) choices_ = *chosen;
  if (choices_ && !asked_.base && !has_world) {
    throw InputError("scenario.no_base", asked_.source,
                     fmt::format("the scenario is complete, but the robot '{}' has no base", asked_.target),
                     "write base: fixed or base: floating");
  }
  const std::optional<BaseKind> decided = asked_.base || has_world ? asked_.base : running;
  base_decided_ = decided.has_value();
  base_ = decided ? BaseChoice{*decided, "it was requested"} : choose_base(robot);
  if (!decided && base_.kind == BaseKind::floating && !world.ground)
    base_ = {BaseKind::fixed, "the world has no ground"};
  const auto model = std::make_shared<const Model>(
      scaled(compile_model(robot, base_.kind, choices_ ? choices_->masses : LinkMasses{}, diagnostics),
             scenario.factors));
  InstanceOptions options;
  options.name = asked_.name_space;
  options.X_WR = asked_.X_WR.value_or(world.X_WR);
  options.q0 = model->neutral();
  apply_initial_values(robot, *model, options.q0, diagnostics);
  gravity_R_ = options.X_WR.linear().transpose() * world.gravity;
  options.servos = choose_servos(robot, *model, ServoOptions{.ideal = scenario.ideal}, gravity_R_);
  options.set_on_ground = true;
  const std::shared_ptr<const RobotDescription> shared(setup_, &robot);  // the setup lives as long
  made_ = make_instance(shared, model, options, meshes, diagnostics);
  sensors_ = find_sensors(*shared, *model, diagnostics);
  if (setup.controllers_origin == kGeneratedOrigin) {
    generate_controllers(scenario, asked_, made_, setup, diagnostics);
  } else {
    report_base_axes(base_wheels(made_), setup.controllers, diagnostics);
    if (!setup.controllers_named) add_spare_base(made_, setup);
  }
}

void CompiledRobot::report_choices(const Instance& instance, Diagnostics& diagnostics) {
  report_base(description(), instance, base_, base_decided_, diagnostics);
  report_wheels(description(), instance, diagnostics);
  report_weightless(description(), model(), diagnostics);
  report_contact_values(description(), diagnostics);
  report_transmissions(description(), diagnostics);
  report_height(*this, instance, diagnostics);
  make_hardware(diagnostics);
  report_rotors(description(), model(), servos(), hardware_, diagnostics);
  report_described_servos(description(), model(), diagnostics);
}

void CompiledRobot::make_hardware(Diagnostics& diagnostics) {
  generated_hardware_ = generates_hardware(*setup_, choices_);
  if (!setup_->from_plugins && !generated_hardware_) {
    hardware_ = description().hardware;
    return;
  }
  hardware_ = {generated_with_sensors(model(), description())};
  if (setup_->from_plugins) return;
  report_unknown_joints(description(), diagnostics);
  if (!choices_) report_generated_hardware(description(), diagnostics);
}

std::vector<std::filesystem::path> CompiledRobot::files() const {
  std::vector<std::filesystem::path> out;
  if (!asked_.target.empty()) out = files_of(setup_->target, setup_->description);
  out.insert(out.end(), setup_->controllers_files.begin(), setup_->controllers_files.end());
  return out;
}

bool same_structure(const CompiledRobot& a, const CompiledRobot& b) {
  const auto same_link = [](const ModelLink& x, const ModelLink& y) { return x.name == y.name; };
  const auto same_hardware = [](const HardwareDescription& x, const HardwareDescription& y) {
    return signature(x) == signature(y);
  };
  return a.setup().controllers.text() == b.setup().controllers.text() && a.asked().tf == b.asked().tf &&
         std::ranges::equal(a.model().links, b.model().links, same_link) &&
         std::ranges::equal(a.model().joints, b.model().joints, same_joint) &&
         std::ranges::equal(a.hardware(), b.hardware(), same_hardware);
}

}  // namespace doppel
