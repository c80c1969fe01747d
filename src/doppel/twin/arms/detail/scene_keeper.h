#pragma once
// The planning scene's objects of a robot, as messages change them. Sources: processCollisionObjectMsg,
// processAttachedCollisionObjectMsg and processPlanningSceneWorldMsg of moveit_core's planning_scene.cpp
// (moveit2, jazzy).

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "doppel/robot/scene_objects/scene_objects.h"
#include "doppel/ros/messages/moveit_msgs.h"
#include "doppel/twin/arms/arm_snapshot.h"

namespace doppel {

// Any thread.
class SceneKeeper {
 public:
  // nullptr: there are no objects.
  [[nodiscard]] std::shared_ptr<const SceneObjects> current() const;

  // Each returns why it changed nothing, or left something out; empty: all was done. `snapshot`: at the
  // time of the message, which decides where frames are.
  [[nodiscard]] std::vector<std::string> apply(const ArmSnapshot& snapshot,
                                               const moveit_msgs::msg::CollisionObject& message);
  [[nodiscard]] std::vector<std::string> apply(const ArmSnapshot& snapshot,
                                               const moveit_msgs::msg::AttachedCollisionObject& message);
  // Replaces all objects that no link holds, and the octomap.
  [[nodiscard]] std::vector<std::string> apply(const ArmSnapshot& snapshot,
                                               const moveit_msgs::msg::PlanningSceneWorld& message);

 private:
  template <class Change>
  std::vector<std::string> change(Change change);

  mutable std::mutex mutex_;
  std::shared_ptr<const SceneObjects> objects_;
};

}  // namespace doppel
