// The objects of the world: where they are, how they move, and how they come and go.

#include <fmt/format.h>

#include <algorithm>

#include "doppel/physics/mujoco/mujoco_engine_detail.h"

namespace doppel {

int MujocoEngine::find_object(std::string_view name) const {
  for (std::size_t i = 0; i < world_.objects.size(); ++i) {
    if (world_.objects[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

bool MujocoEngine::object_pose(std::string_view name, Pose& X_WO) const {
  const int index = find_object(name);
  if (index < 0) return false;
  X_WO = body_pose(state_->object(index).body);
  return true;
}

bool MujocoEngine::set_object_pose(std::string_view name, const Pose& X_WO) {
  const int index = find_object(name);
  if (index < 0) return false;
  state_->place_object(static_cast<std::size_t>(index), X_WO);
  if (!state_->refresh()) diverged_ = true;
  return true;
}

bool MujocoEngine::object_velocity(std::string_view name, FrameVelocity& velocity) const {
  const int index = find_object(name);
  if (index < 0) return false;
  velocity = body_velocity(state_->object(index).body);
  return true;
}

bool MujocoEngine::set_object_velocity(std::string_view name, const FrameVelocity& velocity) {
  const int index = find_object(name);
  if (index < 0) return false;
  const MujocoObject& object = state_->object(index);
  if (object.v < 0) return true;
  // A free joint's velocity: translation in the world's axes, rotation in the body's.
  Eigen::Map<Eigen::Vector3d>(d()->qvel + object.v, 3) = velocity.linear_W;
  Eigen::Map<Eigen::Vector3d>(d()->qvel + object.v + 3, 3) =
      body_pose(object.body).linear().transpose() * velocity.angular_W;
  if (!state_->refresh()) diverged_ = true;
  return true;
}

bool MujocoEngine::apply_object_wrench(std::string_view name, const Eigen::Vector3d& p_OoP_O,
                                       const Eigen::Vector3d& force_W, const Eigen::Vector3d& torque_W) {
  const int index = find_object(name);
  if (index < 0) return false;
  object_wrenches_[static_cast<std::size_t>(index)] = {true, p_OoP_O, force_W, torque_W};
  any_wrench_ = true;
  return true;
}

void MujocoEngine::spawn(const WorldObject& object) {
  if (find_object(object.name) >= 0 || object.name == "ground") {
    throw InputError("world.name_taken", object.source,
                     fmt::format("the world already has an object named '{}'", object.name),
                     "choose another name");
  }
  World world = world_;
  world.objects.push_back(object);
  rebuild(std::move(world));
}

bool MujocoEngine::remove(std::string_view name) {
  const int index = find_object(name);
  if (index < 0) return false;
  World world = world_;
  world.objects.erase(world.objects.begin() + index);
  rebuild(std::move(world));
  return true;
}

void MujocoEngine::set_objects(std::vector<WorldObject> objects) {
  World world = world_;
  world.objects = std::move(objects);
  rebuild(std::move(world));
}

void MujocoEngine::rebuild(World world) {
  Diagnostics notes;
  auto fresh = std::make_unique<MujocoState>(robot_, model_, world, meshes_, notes);
  fresh->apply_exclusions(robot_.pairs, overlaps_);
  carry_over(*state_, world_, *fresh, world);
  std::vector<AppliedWrench> wrenches(world.objects.size());
  for (std::size_t i = 0; i < wrenches.size(); ++i) {
    const int before = find_object(world.objects[i].name);
    if (before >= 0) wrenches[i] = object_wrenches_[static_cast<std::size_t>(before)];
  }
  object_wrenches_ = std::move(wrenches);
  looked_.reset();
  state_ = std::move(fresh);
  world_ = std::move(world);
  size_stages();
  write_armature();
  list_exclusions();
  if (!state_->refresh()) diverged_ = true;
}

void MujocoEngine::carry_over(const MujocoState& old, const World& old_world, MujocoState& fresh,
                              const World& world) const {
  const mjData* from = old.d();
  mjData* to = fresh.d();
  std::copy_n(from->qpos, model_.nq, to->qpos);
  std::copy_n(from->qvel, model_.nv, to->qvel);
  std::copy_n(from->qacc_warmstart, model_.nv, to->qacc_warmstart);
  for (std::size_t i = 0; i < world.objects.size(); ++i) {
    const MujocoObject& object = fresh.object(i);
    fresh.place_object(i, world.objects[i].X_WO);
    for (std::size_t k = 0; k < old_world.objects.size(); ++k) {
      if (old_world.objects[k].name != world.objects[i].name) continue;
      const MujocoObject& before = old.object(k);
      std::copy_n(old.m()->body_pos + 3 * before.body, 3, fresh.m()->body_pos + 3 * object.body);
      std::copy_n(old.m()->body_quat + 4 * before.body, 4, fresh.m()->body_quat + 4 * object.body);
      if (object.q < 0) continue;
      std::copy_n(from->qpos + before.q, 7, to->qpos + object.q);
      std::copy_n(from->qvel + before.v, 6, to->qvel + object.v);
      std::copy_n(from->qacc_warmstart + before.v, 6, to->qacc_warmstart + object.v);
    }
  }
}

}  // namespace doppel
