#pragma once
// The frame "world" of messages. Where the robot has a link called "world", TF's frame of that name is that
// link, wherever the world file puts it; else it is the engine's world.

#include "doppel/physics/engine.h"

namespace doppel {

// X_TW: the engine's world in TF's "world".
inline Pose world_in_tf(const Model& model, const Engine& engine) {
  const int link = model.find_link("world");
  return link >= 0 ? engine.link_pose(link).inverse() : Pose(Pose::Identity());
}

}  // namespace doppel
