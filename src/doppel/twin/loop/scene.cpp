#include "doppel/twin/loop/scene.h"

#include <algorithm>

namespace doppel {

void Scene::show(Engine& engine, std::vector<std::string> robots, std::string root) {
  engine_ = &engine;
  const CompiledWorld& world = engine.world();
  robots_.clear();
  objects_.clear();
  for (const std::string& name : robots) {
    if (const int index = world.find(name); index >= 0) robots_.push_back(index);
  }
  for (int i = 0; i < static_cast<int>(world.instances().size()); ++i) {
    const ModelInstance& made = world.instances()[static_cast<std::size_t>(i)];
    if (!is_robot(i) && made.is_object()) objects_.push_back(i);
  }
  root_ = root.empty() ? -1 : world.find(root);
}

bool Scene::is_robot(int instance) const {
  return std::ranges::find(robots_, instance) != robots_.end();
}

bool Scene::is_object(int instance) const {
  return std::ranges::find(objects_, instance) != objects_.end();
}

Pose Scene::world_in_tf() const {
  if (root_ < 0) return Pose::Identity();
  const Instance root = instance(root_);
  const int link = root.model().find_link("world");
  return link >= 0 ? root.link_pose(link).inverse() : Pose(Pose::Identity());
}

std::string Scene::scoped(int robot, const std::string& name) const {
  return robot == root_ ? name : instance(robot).name() + "::" + name;
}

}  // namespace doppel
