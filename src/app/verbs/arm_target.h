#pragma once
// The arm of a description that `doppel ik` and `doppel reach` work on, and the poses that they are given.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/description_target.h"
#include "doppel/robot/reach/arm_group.h"
#include "doppel/robot/reach/arm_reach.h"
#include "doppel/robot/scene_objects/scene_objects.h"

namespace CLI {
class App;
}

namespace doppel::app {

struct ArmOptions {
  std::vector<std::string> target;
  std::string group, base, tip, tool_axis, controllers, scene;
  std::vector<std::string> seed;  // "joint=position"
  bool no_collisions = false;
};

// TARGET, --group, --base, --tip, --tool-axis, --seed, --scene, --no-collisions, --controllers.
void add_arm_options(CLI::App& verb, ArmOptions& options);

struct ArmTarget {
  std::string robot;
  std::shared_ptr<const Model> model;
  std::string group;  // "arm", or the names of the ends that were chosen
  std::unique_ptr<ArmReach> reach;
  std::shared_ptr<const CollisionScene> scene;  // nullptr: --no-collisions
  SceneObjects objects;                         // of --scene, in the root link
  Eigen::VectorXd q;                            // [nq] the seed
};

// Notes and warnings go to stderr. Throws InputError.
ArmTarget open_arm(const ArmOptions& options);

struct PoseOptions {
  std::vector<std::string> position, rpy, quaternion, approach;
  bool down = false, up = false;
  std::string frame;
};

// --at, --rpy, --quaternion, --approach, --down, --up, --frame.
void add_pose_options(CLI::App& verb, PoseOptions& options);

// The pose in the root link, and the task that follows from what is given of the rotation; nullopt: all of
// it.
struct AskedPose {
  Pose X_WT = Pose::Identity();
  std::optional<IkTask> task;
};
AskedPose asked_pose(const PoseOptions& options, const ArmTarget& arm);

// "  12.3 deg" or " 0.120 m", by the kind of the joint.
std::string shown_position(const ModelJoint& joint, double position);

}  // namespace doppel::app
