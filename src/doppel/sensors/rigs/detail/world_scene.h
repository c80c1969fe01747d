#pragma once
// The scene of a compiled world: body 0 is the ground, then follow the links of all instances in order.

#include <memory>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/physics/contract/engine.h"
#include "doppel/sensors/render/render_scene.h"

namespace doppel {

std::shared_ptr<const RenderScene> make_world_scene(const CompiledWorld& world, Diagnostics& diagnostics);
// The same for a picture, in which marks replace meshes that were not found.
std::shared_ptr<const RenderScene> make_picture_scene(const CompiledWorld& world, Diagnostics& diagnostics);
// In the order of that scene's bodies. Allocates only where `out` grows.
void read_poses(const Engine& engine, std::vector<Pose>& out);

}  // namespace doppel
