#pragma once
// A robot and its world at an instant, for computations on another thread.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "doppel/description/urdf/load.h"
#include "doppel/export.h"
#include "doppel/physics/contract/engine.h"
#include "doppel/robot/scene_objects/scene_objects.h"
#include "doppel/robot/semantics/planning_groups.h"

namespace doppel {

// The part of a robot that stays the same while it runs.
struct ArmRobot {
  std::shared_ptr<const void> owner;  // keeps alive what the pointers below refer to
  const RobotDescription* description = nullptr;
  const Target* target = nullptr;  // nullptr: it was not read from a file
  std::shared_ptr<const Model> model;
  std::vector<JointGroup> controllers;
  std::string name_space;  // "left"
  int base_link = 0;       // the root link, or the child of the floating joint
};

struct DOPPEL_API ArmSnapshot {
  std::shared_ptr<const ArmRobot> robot;
  Eigen::VectorXd q;                           // [nq]
  std::shared_ptr<const CompiledWorld> world;  // nullptr: the robot is alone
  int instance = 0;                            // of the robot in the world
  std::vector<std::vector<Pose>> X_WL;         // [instances][links]
  std::vector<Attachment> attachments;
  std::shared_ptr<const SceneObjects> objects;  // of the planning scene; nullptr: none

  [[nodiscard]] const Model& model() const { return *robot->model; }
  // The world in the robot's root link.
  [[nodiscard]] Pose X_RW() const;
};

// The frame `name` in the robot's root link, at q: a link; "" is the base link, "world", "map" and "odom"
// are the world; an object of the world, or "object/link"; an object of the planning scene, or
// "object/subframe". nullopt: there is none.
DOPPEL_API std::optional<Pose> find_frame(const ArmSnapshot& snapshot, const Eigen::VectorXd& q,
                                          std::string name);

// A frame that moves with a link of the robot.
struct LinkFrame {
  int link = -1;
  Pose X_LF = Pose::Identity();
};
// A link, or the frame of an object that a link holds, in physics or in the planning scene. nullopt: it does
// not move with the robot.
DOPPEL_API std::optional<LinkFrame> find_held_frame(const ArmSnapshot& snapshot, const std::string& name);

// ", did you mean ..." of the frames that there are.
DOPPEL_API std::string nearest_frame(const ArmSnapshot& snapshot, const std::string& name);

}  // namespace doppel
