#pragma once
// How a world is drawn, as the message of /doppel/scene.

#include "doppel/description/robot_description.h"
#include "doppel/messages/doppel_msgs.h"
#include "doppel/physics/world.h"

namespace doppel {

// X_TW: the engine's world in TF's. Without materials and terrains.
[[nodiscard]] doppel_msgs::msg::Scene to_scene_msg(const WorldSettings& settings, const Pose& X_TW);
// What the material of a visual has beyond its marker.
void add_material(const Material& material, std::int32_t marker, doppel_msgs::msg::Scene& out);
// Nothing for a heightmap without heights.
void add_terrain(const Heightmap& map, std::int32_t marker, doppel_msgs::msg::Scene& out);

}  // namespace doppel
