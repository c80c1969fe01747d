#include "doppel/twin/machine.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>

#include "doppel/core/names.h"
#include "doppel/twin/base_choice.h"
#include "doppel/twin/entity.h"
#include "doppel/twin/simulated_hardware.h"

namespace doppel {
namespace {

constexpr std::size_t kNamesShown = 8;

const char* root_name(const Model& model) {
  const bool floats = !model.joints.empty() && model.joints.front().type == JointType::floating;
  return model.links[floats ? 1 : 0].name.c_str();
}

// What was chosen on the user's behalf, with the height at which a floating root stands.
void report_base(const RobotDescription& robot, const Model& model, const Engine& engine,
                 const BaseChoice& choice, bool asked_for, Diagnostics& diagnostics) {
  if (asked_for || (model.links.front().name == "world" && choice.kind == BaseKind::fixed)) return;
  if (choice.kind == BaseKind::floating) {
    diagnostics.note(
        "up.base_floating", robot.source,
        fmt::format("the base floats because {}; it is set on the ground, with '{}' at z = {:.3f} m",
                    choice.reason, root_name(model), engine.link_pose(1).translation().z()),
        "--base fixed holds it in the air at the world's origin");
    return;
  }
  diagnostics.note(
      "up.base_fixed", robot.source,
      fmt::format("the root link '{}' is fixed to the world: {}", root_name(model), choice.reason),
      "--base floating lets it fall and move");
}

void report_weightless(const RobotDescription& robot, const Model& model, Diagnostics& diagnostics) {
  std::vector<std::string> names;
  for (const ModelLink& link : model.links) {
    if (link.weightless) names.push_back(link.name);
  }
  if (names.empty()) return;
  diagnostics.note(
      "up.gravity_off", robot.find_link(names.front())->source,
      fmt::format("<gazebo> turns gravity off for '{}'{}: no weight, but mass and inertia", names.front(),
                  names.size() > 1 ? fmt::format(" and {} more links", names.size() - 1) : ""));
}

// Joints that are described to be driven by effort and carry next to nothing (servo.h).
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
      fmt::format("'{}'{} carries so little that its effort limit would bring it to its velocity limit "
                  "within 0.1 ms; "
                  "commanded by effort it has a motor's inertia of up to {:.2g} kg m^2 beside its own",
                  names.front(), names.size() > 1 ? fmt::format(" and {} more joints", names.size() - 1) : "",
                  largest),
      "check the effort limit and the link's inertia against the drive's data sheet");
}

// Links that start inside the ground or an object: one warning for each of these.
void report_overlaps(const RobotDescription& robot, const Engine& engine, Diagnostics& diagnostics) {
  std::map<std::string, std::vector<const ExcludedPair*>> inside;  // by what they are in
  for (const ExcludedPair& pair : engine.excluded_pairs()) {
    if (pair.depth > 0) inside[pair.link_b].push_back(&pair);
  }
  for (const auto& [object, pairs] : inside) {
    std::vector<std::string> names;
    double deepest = 0.0;
    for (const ExcludedPair* pair : pairs) {
      if (names.size() < kNamesShown) names.push_back(fmt::format("'{}'", pair->link_a));
      deepest = std::max(deepest, pair->depth);
    }
    if (pairs.size() > names.size()) names.push_back(fmt::format("{} more", pairs.size() - names.size()));
    const bool ground = object == "ground";
    const Link* const first = robot.find_link(pairs.front()->link_a);
    diagnostics.warning(
        "up.starts_inside", first != nullptr ? first->source : robot.source,
        fmt::format("{} up to {:.3g} m inside {}: {}; they pass through each other from now on",
                    pairs.size() == 1 ? "a link starts" : fmt::format("{} links start", pairs.size()),
                    deepest, ground ? "the ground" : fmt::format("the object '{}'", object),
                    fmt::join(names, ", ")),
        ground
            ? "place the robot higher by a world file (robot: {xyz: [0, 0, 0.5]}), or let it stand (--base "
              "floating)"
            : "move the object or the robot in the world file");
  }
}

std::vector<HardwareDescription> hardware_of(const RobotSetup& setup, const Model& model,
                                             Diagnostics& diagnostics) {
  const RobotDescription& robot = setup.description.robot;
  bool position = false;
  Diagnostics unknown;  // the simulated hardware reports them itself where it is not replaced
  std::vector<std::string> names;
  for (const Joint& joint : robot.joints) names.push_back(joint.name);
  for (const auto& hardware : robot.hardware) {
    for (const auto& joint : hardware.joints) {
      if (robot.find_joint(joint.name) == nullptr) {
        unknown.warning(
            "ros2_control.unknown_joint", joint.source,
            fmt::format("<ros2_control> '{}' lists the joint '{}', which the robot does not have; "
                        "it is left out{}",
                        hardware.name, joint.name, did_you_mean(joint.name, names)),
            "write the joint's name as its <joint> element has it, or remove the entry");
        continue;
      }
      for (const auto& interface : joint.command_interfaces)
        position = position || interface.name == kPosition;
    }
  }
  if (robot.hardware.empty() || (setup.controllers_origin == "generated" && !position)) {
    for (const Diagnostic& d : unknown.all()) diagnostics.add(d);
    diagnostics.note(
        "up.hardware_generated", robot.source,
        robot.hardware.empty()
            ? "there is no <ros2_control>; every joint that can be driven gets simulated interfaces"
            : "no joint under <ros2_control> takes position commands; every joint that can be driven gets "
              "simulated interfaces instead");
    return {generated_hardware(model)};
  }
  return robot.hardware;
}

// All that controllers and their hardware were told of a component.
std::string signature(const HardwareDescription& hardware) {
  std::string out = hardware.name + '\n' + hardware.plugin + '\n';
  for (const auto* parts : {&hardware.joints, &hardware.sensors, &hardware.gpios}) {
    for (const HardwareJointDescription& part : *parts) {
      out += "part " + part.name + '\n';
      for (const auto& i : part.command_interfaces) out += "command " + i.name + '\n';
      for (const auto& i : part.state_interfaces) out += "state " + i.name + '\n';
    }
  }
  return out;
}

bool same_joint(const ModelJoint& a, const ModelJoint& b) {
  return a.name == b.name && a.type == b.type && a.q == b.q && a.v == b.v && a.parent_link == b.parent_link &&
         a.mimic_leader == b.mimic_leader;
}

}  // namespace

Machine::Machine(const Scenario& scenario, Diagnostics& diagnostics, std::optional<BaseKind> running)
    : setup(set_up_robot(scenario, resolver, diagnostics)) {
  const RobotDescription& robot = setup.description.robot;
  const bool has_world = robot.find_link("world") != nullptr;
  const std::optional<BaseKind> decided = scenario.base || has_world ? scenario.base : running;
  BaseChoice base = decided ? BaseChoice{*decided, "it was asked for"} : choose_base(robot);
  if (!decided && base.kind == BaseKind::floating && !setup.world.ground)
    base = {BaseKind::fixed, "the world has no ground to stand on"};
  model = compile_model(robot, base.kind, diagnostics);
  EngineOptions options;
  options.q0 = model.neutral();
  apply_initial_values(robot, model, options.q0, diagnostics);
  servos = choose_servos(model, ServoOptions{.ideal = scenario.ideal}, gravity_R());
  options.servos = servos;
  options.set_on_ground = true;
  engine = make_mujoco_engine(robot, model, setup.world, options, diagnostics);
  report_base(robot, model, *engine, base, decided.has_value(), diagnostics);
  report_overlaps(robot, *engine, diagnostics);
  report_weightless(robot, model, diagnostics);
  hardware = hardware_of(setup, model, diagnostics);
  report_rotors(robot, model, servos, hardware, diagnostics);
}

BaseKind Machine::base() const {
  const bool added = setup.description.robot.find_link(model.links.front().name) == nullptr;
  return added ? BaseKind::floating : BaseKind::fixed;
}

Eigen::Vector3d Machine::gravity_R() const {
  return setup.world.X_WR.linear().transpose() * setup.world.gravity;
}

std::vector<std::filesystem::path> Machine::files(const Scenario& scenario) const {
  std::vector<std::filesystem::path> out = files_of(setup.target, setup.description);
  out.insert(out.end(), setup.controllers_files.begin(), setup.controllers_files.end());
  if (scenario.world) out.push_back(*scenario.world);
  return out;
}

bool same_structure(const Machine& a, const Machine& b) {
  const auto same_link = [](const ModelLink& x, const ModelLink& y) { return x.name == y.name; };
  const auto same_hardware = [](const HardwareDescription& x, const HardwareDescription& y) {
    return signature(x) == signature(y);
  };
  return a.setup.controllers.text() == b.setup.controllers.text() &&
         a.setup.world.step == b.setup.world.step &&
         std::equal(a.model.links.begin(), a.model.links.end(), b.model.links.begin(), b.model.links.end(),
                    same_link) &&
         std::equal(a.model.joints.begin(), a.model.joints.end(), b.model.joints.begin(),
                    b.model.joints.end(), same_joint) &&
         std::equal(a.hardware.begin(), a.hardware.end(), b.hardware.begin(), b.hardware.end(),
                    same_hardware);
}

namespace {

// A joint that moved, or followed another one, and that an edit would leave standing or loose.
std::optional<Diagnostic> lost_motion(const ModelJoint& old, const ModelJoint& joint, const Machine& to) {
  const Joint* const source = to.setup.description.robot.find_joint(joint.name);
  if (source == nullptr) return std::nullopt;
  Diagnostic problem;
  problem.rule = "reload.motion";
  if (old.mimics() && !joint.mimics() && source->mimic) {
    problem.where = source->mimic->source;
    problem.message =
        fmt::format("joint '{}' would not follow '{}' any more{}", joint.name, source->mimic->joint,
                    did_you_mean(source->mimic->joint, to.model.scalar_joint_names()));
    problem.mend = "correct the <mimic>, or remove it";
  } else if (old.scalar() && joint.type == JointType::fixed && source->type != JointType::fixed) {
    problem.where = source->axis_source;
    problem.message = fmt::format("joint '{}' would stand still: its axis is zero", joint.name);
    problem.mend = "correct the axis";
  } else {
    return std::nullopt;
  }
  return problem;
}

}  // namespace

void refuse_lost_range(const Machine& from, const Machine& to) {
  constexpr double kSlack = 0.01;  // rad or m: a loaded drive stands a little beyond where it is held
  std::vector<Diagnostic> refused;
  for (const ModelJoint& joint : to.model.joints) {
    const int index = from.model.find_joint(joint.name);
    if (index < 0) continue;
    const ModelJoint& old = from.model.joints[static_cast<std::size_t>(index)];
    if (auto lost = lost_motion(old, joint, to)) refused.push_back(std::move(*lost));
    if (!joint.scalar() || joint.mimics()) continue;
    if (!old.scalar() || (old.lower == joint.lower && old.upper == joint.upper)) continue;
    const double q = from.engine->q()[static_cast<std::size_t>(old.q)];
    const bool was_outside = q < old.lower - kSlack || q > old.upper + kSlack;
    const bool is_outside = q < joint.lower - kSlack || q > joint.upper + kSlack;
    const bool lost = joint.upper - joint.lower < 1e-6 && old.upper - old.lower >= 1e-6;
    if (!lost && (was_outside || !is_outside)) continue;
    const Joint* source = to.setup.description.robot.find_joint(joint.name);
    Diagnostic problem;
    problem.rule = "reload.limits";
    problem.where = source->limits ? source->limits->source : source->source;
    problem.message = fmt::format(
        "joint '{}' stands at {:.4g} and would have the limits [{:.4g}, {:.4g}] instead of [{:.4g}, {:.4g}]",
        joint.name, q, joint.lower, joint.upper, old.lower, old.upper);
    problem.mend = "correct lower and upper; where they are meant, move the joint inside of them first";
    refused.push_back(std::move(problem));
  }
  if (!refused.empty()) throw InputError(std::move(refused));
}

namespace {

// The world file's objects but for those that were deleted while it ran, and what was put in.
std::vector<WorldObject> objects_after(const Machine& from, const Machine& to) {
  std::vector<WorldObject> out;
  const std::vector<WorldObject>& there = from.engine->objects();
  for (const WorldObject& object : to.setup.world.objects) {
    const bool was_in_file = find_named(from.setup.world.objects, object.name) != nullptr;
    if (!was_in_file || find_named(there, object.name) != nullptr) out.push_back(object);
  }
  for (const WorldObject& object : there) {
    if (!object.source.known() && find_named(out, object.name) == nullptr) out.push_back(object);
  }
  return out;
}

void carry_over_objects(const Machine& from, Machine& to) {
  std::vector<WorldObject> objects = objects_after(from, to);
  const bool as_in_file =
      std::ranges::equal(objects, to.setup.world.objects, {}, &WorldObject::name, &WorldObject::name);
  if (!as_in_file) to.engine->set_objects(std::move(objects));
  for (const WorldObject& object : to.engine->objects()) {
    const WorldObject* before = find_named(from.engine->objects(), object.name);
    if (before == nullptr) continue;
    Pose X_WO = Pose::Identity();
    FrameVelocity velocity;
    from.engine->object_pose(object.name, X_WO);
    from.engine->object_velocity(object.name, velocity);
    // A fixed one that nobody has moved goes where the file, which may have been edited, puts it.
    if (object.mass == 0 && X_WO.isApprox(before->X_WO, 1e-9)) continue;
    to.engine->set_object_pose(object.name, X_WO);
    to.engine->set_object_velocity(object.name, velocity);
  }
}

}  // namespace

void carry_over_state(const Machine& from, Machine& to) {
  Eigen::VectorXd q = Eigen::Map<const Eigen::VectorXd>(to.engine->q().data(), to.model.nq);
  Eigen::VectorXd v = Eigen::VectorXd::Zero(to.model.nv);
  for (const ModelJoint& joint : to.model.joints) {
    const int index = from.model.find_joint(joint.name);
    if (index < 0) continue;
    const ModelJoint& old = from.model.joints[static_cast<std::size_t>(index)];
    if (old.nq != joint.nq || old.nv != joint.nv) continue;
    for (int i = 0; i < joint.nq; ++i) q[joint.q + i] = from.engine->q()[static_cast<std::size_t>(old.q + i)];
    for (int i = 0; i < joint.nv; ++i) v[joint.v + i] = from.engine->v()[static_cast<std::size_t>(old.v + i)];
  }
  to.engine->set_time(from.engine->time());
  carry_over_objects(from, to);
  to.engine->set_state({q.data(), static_cast<std::size_t>(q.size())},
                       {v.data(), static_cast<std::size_t>(v.size())});
  to.engine->lift_out_of_ground();  // of what an edit has made larger
}

}  // namespace doppel
