#pragma once
// Messages of the planning scene as objects.

#include "doppel/robot/scene_objects/scene_object.h"
#include "doppel/ros/messages/moveit_msgs.h"

namespace doppel {

// The object in the frame P, of which X_PH is the message's frame H. Shapes without a pose are at the object;
// one shape of an object without a pose gives the object its own. Throws InputError: "scene.shape" and
// "scene.object".
SceneObject object_from(const moveit_msgs::msg::CollisionObject& message, const Pose& X_PH);

// A pose whose quaternion is all zeros has no rotation, as in MoveIt. Throws InputError "scene.object".
Pose object_pose(const geometry_msgs::msg::Pose& pose, const std::string& id);

// The poses of the message's shapes, in the order primitives, meshes, planes.
std::vector<Pose> shape_poses(const moveit_msgs::msg::CollisionObject& message);

// Throws InputError "octomap.data" and "octomap.size".
SharedCells cells_from(const octomap_msgs::msg::Octomap& map);

}  // namespace doppel
