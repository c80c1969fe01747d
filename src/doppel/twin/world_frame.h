#pragma once
// The frame "world" of messages. Where the robot's root link is called "world", TF's frame of that name is
// that link, wherever the world file puts it; else it is the engine's world.

#include "doppel/physics/engine.h"

namespace doppel {

// X_TW: the engine's world in TF's "world".
inline Pose world_in_tf(const Model& model, const Engine& engine) {
  return model.links.front().name == "world" ? engine.link_pose(0).inverse() : Pose(Pose::Identity());
}

}  // namespace doppel
