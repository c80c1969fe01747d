#include "doppel/twin/loop/detail/guard_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

namespace doppel {
namespace {

std::shared_ptr<const CollisionScene> make_scene(const Instance& robot,
                                                 const std::vector<KeepOutBox>& boxes) {
  const ModelInstance& made_of = robot.made_of();
  std::vector<SceneInstance> instances;
  SceneInstance arm;
  arm.name = made_of.name;
  arm.model = made_of.model;
  arm.shapes = made_of.shapes;
  arm.X_WR = made_of.X_WR;
  arm.self_collision = made_of.self_collision;
  instances.push_back(std::move(arm));
  for (const KeepOutBox& one : boxes) {
    SceneInstance box;
    box.name = one.name;
    CollisionShape shape;
    shape.geometry = Box{one.size};
    shape.id = {0, 0, 0};
    box.shapes = {{shape}};
    box.X_WR = one.X_WB;
    instances.push_back(std::move(box));
  }
  SceneOptions options;
  for (const ExcludedPair& pair : robot.engine().world().excluded_pairs()) {
    if (pair.a.instance == robot.index() && pair.b.instance == robot.index())
      options.allowed.push_back(
          {{0, std::min(pair.a.link, pair.b.link)}, {0, std::max(pair.a.link, pair.b.link)}, pair.reason});
  }
  return std::make_shared<const CollisionScene>(std::move(instances), options);
}

}  // namespace

std::set<int> drivers_of(const Model& model, int link) {
  std::set<int> out;
  for (int joint = model.links[static_cast<std::size_t>(link)].joint; joint >= 0;) {
    const ModelJoint& one = model.joints[static_cast<std::size_t>(joint)];
    if (one.nq > 0) out.insert(one.mimics() ? one.mimic_leader : joint);
    joint = model.links[static_cast<std::size_t>(one.parent_link)].joint;
  }
  return out;
}

GuardScene::GuardScene(const Instance& robot, const std::vector<KeepOutBox>& boxes)
    : model_(robot.made_of().model), scene_(make_scene(robot, boxes)) {
  const auto& tested = scene_->tested_pairs();
  for (std::size_t i = 0; i < tested.size(); ++i) {
    const auto& [a, b] = tested[i];
    if (!a.is_ground() && !b.is_ground() && (a.instance == 0 || b.instance == 0)) pairs_.push_back(i);
  }
  leave_out_single_joints();
}

// The fingers of a gripper close by intent, and one joint's limits say how far.
void GuardScene::leave_out_single_joints() {
  std::erase_if(pairs_, [&](std::size_t pair) {
    const auto& [a, b] = scene_->tested_pairs()[pair];
    if (a.instance != b.instance) return false;
    const std::set<int> of_a = drivers_of(*model_, a.link), of_b = drivers_of(*model_, b.link);
    std::vector<int> between;
    std::ranges::set_symmetric_difference(of_a, of_b, std::back_inserter(between));
    return between.size() <= 1;
  });
}

std::string GuardScene::sentence(std::size_t pair, const char* verb) const {
  const auto& [a, b] = scene_->tested_pairs()[pair];
  // The link further from the base is the one that comes.
  const bool b_comes = b.instance == 0 && (a.instance != 0 || b.link > a.link);
  const BodyId link = b_comes ? b : a, other = b_comes ? a : b;
  const std::string& name = model_->links[static_cast<std::size_t>(link.link)].name;
  if (other.instance == 0)
    return fmt::format("'{}' {} touch '{}'", name, verb,
                       model_->links[static_cast<std::size_t>(other.link)].name);
  return fmt::format("'{}' {} enter the keep-out box '{}'", name, verb,
                     scene_->instances()[static_cast<std::size_t>(other.instance)].name);
}

}  // namespace doppel
