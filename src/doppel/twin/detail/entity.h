#pragma once
// What clients mean by a name, as in Gazebo: a robot, "robot::link" or just the link where one robot alone
// has it; an object or "object::link", which are its frame; and "object::link::collision", its shape, whose
// pose is the one that /doppel/objects has. An object has one link and one shape, whatever its text called
// them. A robot with a namespace is called by that. Empty, "world" and "map" are TF's world (scene.h).

#include <string>

#include "doppel/core/status.h"
#include "doppel/twin/scene.h"

namespace doppel {

inline constexpr std::size_t kMaxNameLength = 100;  // of what is spawned
inline constexpr double kMaxEntityDistance = 1e4;   // m, of a pose from its frame, along each axis

struct Entity {
  BodyId body;
  bool robot = false;  // of a robot, else an object
  bool shape = false;  // the object's shape is meant
};

struct EntityMotion {
  Pose X_WE = Pose::Identity();
  FrameVelocity velocity;
};

[[nodiscard]] bool is_world(const std::string& frame);
// An object, or a part of one, is meant; false where the world has none of this name.
[[nodiscard]] bool find_object(const Scene& scene, const std::string& name, Entity& entity);
// "left::Revolute 1", or the joint alone where one robot alone has it.
[[nodiscard]] Status find_scalar_joint(const Scene& scene, const std::string& name, int& robot, int& joint);
// A link of a robot, as `entity` says; where the scope is not a robot, it is ignored: in Gazebo a model is
// called whatever it was spawned as.
[[nodiscard]] Status find_link(const Scene& scene, const std::string& name, BodyId& body);
[[nodiscard]] Status find_entity(const Scene& scene, const std::string& name, Entity& entity);
[[nodiscard]] EntityMotion motion_of(const Scene& scene, const Entity& entity);
// A frame of reference: an entity or the world.
[[nodiscard]] Status find_frame(const Scene& scene, const std::string& name, EntityMotion& frame);
// An object's look: its one shape, with pose and colour.
[[nodiscard]] const Visual& visual_of(const ModelInstance& object);
// The pose of its shape in its frame.
[[nodiscard]] Pose shape_in_object(const ModelInstance& object);

}  // namespace doppel
