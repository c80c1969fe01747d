// The world of an engine as a CollisionScene.
#include <algorithm>
#include <utility>
#include <vector>

#include "doppel/physics/contract/exclusions.h"
#include "doppel/robot/collision/collision_scene.h"

namespace doppel {

std::shared_ptr<const CollisionScene> make_collision_scene(const CompiledWorld& world) {
  std::vector<SceneInstance> instances;
  for (const ModelInstance& instance : world.instances()) {
    SceneInstance out;
    out.name = instance.name;
    out.model = instance.model;
    out.shapes = instance.shapes;
    out.X_WR = instance.X_WR;
    out.self_collision = instance.self_collision;
    instances.push_back(std::move(out));
  }
  SceneOptions options;
  options.ground = world.settings().ground;
  for (const ExcludedPair& pair : world.excluded_pairs())
    options.allowed.push_back({std::min(pair.a, pair.b), std::max(pair.a, pair.b), pair.reason});
  return std::make_shared<const CollisionScene>(std::move(instances), options);
}

}  // namespace doppel
