#pragma once
// The appearance of a world, as the message of /doppel/scene.

#include "doppel/description/urdf/robot_description.h"
#include "doppel/physics/contract/world.h"
#include "doppel/ros/messages/doppel_msgs.h"

namespace doppel {

// X_TW: the engine's world in TF's. Without materials and terrains.
[[nodiscard]] doppel_msgs::msg::Scene to_scene_msg(const WorldSettings& settings, const Pose& X_TW);
// Adds the properties of a visual's material that its marker cannot express.
void add_material(const Material& material, std::int32_t marker, doppel_msgs::msg::Scene& out);
// Nothing for a heightmap without heights.
void add_terrain(const Heightmap& map, std::int32_t marker, doppel_msgs::msg::Scene& out);

}  // namespace doppel
