#include "app/verbs/arm_target.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "app/verbs/found_controllers.h"
#include "app/verbs/position_text.h"
#include "doppel/base/core/names.h"
#include "doppel/base/math/units.h"
#include "doppel/robot/collision/size_limits.h"
#include "doppel/robot/kinematics/kinematics.h"
#include "doppel/robot/scene_objects/scene_file.h"
#include "doppel/scenario/resolve/described_arms.h"

namespace doppel::app {
namespace {

int find_named_link(const Model& model, const std::string& name) {
  const int link = model.find_link(name);
  if (link >= 0) return link;
  throw InputError("cli.link", {},
                   fmt::format("the robot has no link '{}'{}", name, did_you_mean(name, model.link_names())),
                   "doppel tree lists its links");
}

// The chain that --base and --tip name, or that of the group, with one of its ends replaced.
ArmGroup chosen_chain(const ArmOptions& options, const Model& model, const RobotDescription& robot,
                      DescriptionTarget& target) {
  if (!options.base.empty() && !options.tip.empty() && options.group.empty()) {
    const int base = find_named_link(model, options.base), tip = find_named_link(model, options.tip);
    try {
      return {options.base + " to " + options.tip, make_chain(model, base, tip)};
    } catch (const std::invalid_argument& reason) {
      throw InputError("cli.chain", {},
                       fmt::format("'{}' to '{}' is no chain for inverse kinematics: {}", options.base,
                                   options.tip, reason.what()),
                       "--base is a link above --tip, with joints between them that move; see doppel tree");
    }
  }
  Diagnostics notes;
  const std::vector<ArmGroup> arms =
      described_arms(model, robot, &target.target, target.resolver,
                     find_controllers(robot, target, options.controllers).controllers, notes);
  if (arms.empty()) print_diagnostics(notes, true);
  ArmGroup arm = choose_arm(arms, options.group);
  if (options.base.empty() && options.tip.empty()) return arm;
  ArmOptions ends = options;
  ends.group.clear();
  const auto name = [&model](int link) { return model.links[static_cast<std::size_t>(link)].name; };
  if (ends.base.empty()) ends.base = name(arm.chain.base_link);
  if (ends.tip.empty()) ends.tip = name(arm.chain.tip_link);
  ArmGroup replaced = chosen_chain(ends, model, robot, target);
  replaced.name = arm.name;
  return replaced;
}

Eigen::Vector3d parse_axis(const std::string& text) {
  static const std::vector<std::string> kAxes = {"x", "y", "z", "-x", "-y", "-z"};
  const auto found = std::find(kAxes.begin(), kAxes.end(), text);
  if (found == kAxes.end()) {
    throw InputError("cli.axis", {}, fmt::format("'{}' is not an axis{}", text, did_you_mean(text, kAxes)),
                     fmt::format("write one of {}", fmt::join(kAxes, ", ")));
  }
  const auto index = static_cast<int>(found - kAxes.begin());
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();
  axis[index % 3] = index < 3 ? 1 : -1;
  return axis;
}

void apply_seed(const std::vector<std::string>& words, const Model& model, Eigen::VectorXd& q) {
  for (const std::string& word : words) {
    const std::size_t equals = word.rfind('=');
    const std::string name = word.substr(0, equals);
    const int joint = model.find_joint(name);
    if (equals == std::string::npos || joint < 0 || !model.joints[static_cast<std::size_t>(joint)].scalar()) {
      throw InputError("cli.seed", {},
                       fmt::format("'{}' is not JOINT=POSITION of a joint of the robot{}", word,
                                   did_you_mean(name, model.scalar_joint_names())),
                       "for example --seed shoulder=30deg elbow=0.5");
    }
    q[model.joints[static_cast<std::size_t>(joint)].q] =
        parse_position(std::string_view(word).substr(equals + 1), word);
  }
  model.apply_mimics(q);
}

std::vector<double> parse_numbers(const std::vector<std::string>& words) {
  std::vector<double> out;
  for (const std::string& word : words) out.push_back(parse_position(word, word));
  return out;
}

SceneObjects read_objects(const std::string& file) {
  SceneObjects out;
  for (const SceneObject& object : read_scene(file).objects) out.append(object);
  return out;
}

ReachSurroundings surroundings_of(const SceneObjects& objects) {
  ReachSurroundings out;
  for (const auto& [id, object] : objects.all()) out.others.push_back(scene_instance(object, object.X_PO));
  return out;
}

// The frame of a link, of an object or of its subframe, in the root link.
Pose find_named_frame(const std::string& name, const ArmTarget& arm) {
  if (const std::optional<ObjectFrame> frame = arm.objects.frame(name)) return frame->X_PF;
  std::vector<std::string> names = arm.model->link_names();
  const std::vector<std::string> of_objects = arm.objects.frame_names();
  names.insert(names.end(), of_objects.begin(), of_objects.end());
  const int link = arm.model->find_link(name);
  if (link < 0) {
    throw InputError("cli.frame", {},
                     fmt::format("there is no frame '{}'{}", name, did_you_mean(name, names)),
                     "it is a link, an object of --scene, or OBJECT/SUBFRAME");
  }
  Data data(*arm.model);
  forward_kinematics(*arm.model, data, arm.q);
  return data.X_WL[static_cast<std::size_t>(link)];
}

Eigen::Matrix3d rotation_to(const Eigen::Vector3d& tool_axis, const Eigen::Vector3d& direction) {
  return Eigen::Quaterniond::FromTwoVectors(tool_axis, direction).toRotationMatrix();
}

}  // namespace

std::string shown_position(const ModelJoint& joint, double position) {
  const bool slides = joint.type == JointType::prismatic;
  const double step = slides ? 1e-4 : 1e-2, value = slides ? position : position / kDegree;
  const double shown = std::round(value / step) * step + 0.0;  // no minus before a zero
  return slides ? fmt::format("{:.4f} m", shown) : fmt::format("{:.2f} deg", shown);
}

void add_arm_options(CLI::App& verb, ArmOptions& options) {
  add_target(verb, options.target);
  verb.add_option("--group", options.group, "Group of joints (default: the arm with the most joints)")
      ->type_name("NAME");
  verb.add_option("--base", options.base, "Link at which the chain begins (default: the group's)")
      ->type_name("LINK");
  verb.add_option("--tip", options.tip, "Link that is moved to the pose (default: the group's)")
      ->type_name("LINK");
  verb.add_option("--tool-axis", options.tool_axis,
                  "Axis of the tip that points away from the arm: x, y, z, -x, -y, -z (default: found)")
      ->type_name("AXIS");
  verb.add_option("--seed", options.seed,
                  "Where the robot is: the nearest solution to it is preferred (default: zero)")
      ->type_name("JOINT=POSITION")
      ->expected(1, -1);
  verb.add_option("--scene", options.scene,
                  "Objects around the robot: a .scene file of MoveIt, in the robot's root link")
      ->type_name("FILE");
  verb.add_flag("--no-collisions", options.no_collisions,
                "Accept solutions in which the robot touches itself or objects");
  verb.add_option("--controllers", options.controllers,
                  "Controllers' parameter file (YAML) that defines the groups (default: found)")
      ->type_name("FILE");
}

ArmTarget open_arm(const ArmOptions& options) {
  DescriptionTarget target = open_target(options.target);
  const RobotDescription robot = load_target(target).robot;
  Diagnostics diagnostics;
  ArmTarget out;
  out.robot = robot.name;
  out.model = std::make_shared<const Model>(compile_model(robot, BaseKind::fixed, diagnostics));
  print_diagnostics(diagnostics);
  ArmGroup arm = chosen_chain(options, *out.model, robot, target);
  Diagnostics notes;
  if (!options.scene.empty()) out.objects = read_objects(options.scene);
  if (!options.no_collisions)
    out.scene = reach_scene(robot, out.model, &arm.chain, surroundings_of(out.objects), notes);
  print_diagnostics(notes, true);
  out.group = arm.name;
  out.reach = std::make_unique<ArmReach>(out.model, std::move(arm.chain), out.scene);
  if (!options.tool_axis.empty()) out.reach->set_tool_axis(parse_axis(options.tool_axis));
  out.q = out.model->neutral();
  apply_seed(options.seed, *out.model, out.q);
  return out;
}

void add_pose_options(CLI::App& verb, PoseOptions& options) {
  verb.add_option("--at", options.position, "Position of the tip, m")->type_name("X Y Z")->expected(3);
  auto* down = verb.add_flag("--down", options.down, "The tool points down; its rotation about that is free");
  auto* up = verb.add_flag("--up", options.up, "The tool points up");
  auto* approach = verb.add_option("--approach", options.approach, "Direction in which the tool points")
                       ->type_name("X Y Z")
                       ->expected(3);
  auto* rpy =
      verb.add_option("--rpy", options.rpy, "Whole rotation: roll, pitch, yaw as in URDF, rad or 90deg")
          ->type_name("R P Y")
          ->expected(3);
  auto* quaternion = verb.add_option("--quaternion", options.quaternion, "Whole rotation")
                         ->type_name("X Y Z W")
                         ->expected(4);
  for (CLI::Option* a : {down, up, approach, rpy, quaternion}) {
    for (CLI::Option* b : {down, up, approach, rpy, quaternion}) {
      if (a != b) a->excludes(b);
    }
  }
  verb.add_option("--frame", options.frame,
                  "Frame of the pose: a link, an object of --scene or OBJECT/SUBFRAME (default: the robot's "
                  "root link)")
      ->type_name("FRAME");
}

AskedPose asked_pose(const PoseOptions& options, const ArmTarget& arm) {
  AskedPose out;
  Pose X_FT = Pose::Identity();
  const std::vector<double> p = parse_numbers(options.position);
  X_FT.translation() = Eigen::Vector3d(p.at(0), p.at(1), p.at(2));
  if (X_FT.translation().cwiseAbs().maxCoeff() > kMaxDistance)
    throw InputError("cli.at", {}, "the position is beyond 10 km", "--at takes metres");
  const Eigen::Vector3d tool = arm.reach->solver().task_space().tool_axis;
  if (!options.rpy.empty()) {
    const std::vector<double> r = parse_numbers(options.rpy);
    X_FT.linear() = rotation_from_rpy({r[0], r[1], r[2]});
  } else if (!options.quaternion.empty()) {
    const std::vector<double> r = parse_numbers(options.quaternion);
    const Eigen::Quaterniond rotation(r[3], r[0], r[1], r[2]);
    if (rotation.norm() < 1e-6)
      throw InputError("cli.rotation", {}, "the quaternion is zero", "no rotation is 0 0 0 1");
    X_FT.linear() = rotation.normalized().toRotationMatrix();
  } else if (options.down || options.up || !options.approach.empty()) {
    Eigen::Vector3d direction(0, 0, options.down ? -1 : 1);
    if (!options.approach.empty()) {
      const std::vector<double> d = parse_numbers(options.approach);
      direction = {d[0], d[1], d[2]};
    }
    if (direction.norm() < 1e-9)
      throw InputError("cli.approach", {}, "the direction is zero", "down is 0 0 -1");
    X_FT.linear() = rotation_to(tool, direction.normalized());
    out.task = IkTask::axis;
  } else {
    out.task = IkTask::position;
  }
  const Pose X_WF = options.frame.empty() ? Pose::Identity() : find_named_frame(options.frame, arm);
  out.X_WT = X_WF * X_FT;
  return out;
}

}  // namespace doppel::app
