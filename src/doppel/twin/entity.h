#pragma once
// What clients mean by a name, as in Gazebo: the robot, "robot::link" or just the link; an object or
// "object::link", which are its frame; and "object::link::collision", its shape, whose pose is the one that
// /doppel/objects tells. An object has one link and one shape, whatever its text called them. Empty, "world"
// and "map" are TF's world (world_frame.h).

#include <string>

#include "doppel/core/status.h"
#include "doppel/physics/engine.h"

namespace doppel {

inline constexpr std::size_t kLongestName = 100;  // of what is spawned

struct Entity {
  int link = -1;       // of the robot, or
  std::string object;  // one of the world
  bool shape = false;  // its shape is meant
};

struct EntityMotion {
  Pose X_WE = Pose::Identity();
  FrameVelocity velocity;
};

// Null: none is called so.
[[nodiscard]] const WorldObject* find_named(const std::vector<WorldObject>& objects, std::string_view name);
[[nodiscard]] bool is_world(const std::string& frame);
// An object, or a part of one, is meant; nothing where the world has none of this name.
[[nodiscard]] bool find_object(const Engine& engine, const std::string& name, Entity& entity);
[[nodiscard]] Status find_entity(const Model& model, const Engine& engine, const std::string& name,
                                 Entity& entity);
[[nodiscard]] EntityMotion motion_of(const Engine& engine, const Entity& entity);
// A frame of reference: an entity or the world.
[[nodiscard]] Status find_frame(const Model& model, const Engine& engine, const std::string& name,
                                EntityMotion& frame);
// The pose of an object's shape in the object's frame; the identity where there is no such object.
[[nodiscard]] Pose shape_in_object(const Engine& engine, const std::string& object);

}  // namespace doppel
