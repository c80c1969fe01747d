#pragma once
// The names of entities in services, as in Gazebo: a robot, "robot::link" or only the link if one robot has
// it; an object, which is its model's frame; "object::link", a link of it (any other name, of an object with one
// link, is the object);
// and "object::link::collision", its first visual shape, whose pose is that of its first marker of
// /doppel/objects. A robot with a namespace has that name. Empty, "world" and "map" are TF's world (scene.h).

#include <string>
#include <vector>

#include "doppel/base/core/status.h"
#include "doppel/export.h"
#include "doppel/twin/loop/scene.h"

namespace doppel {

inline constexpr std::size_t kMaxNameLength = 100;  // of what is spawned

struct Entity {
  BodyId body;
  bool robot = false;            // of a robot, else an object
  Pose X_BE = Pose::Identity();  // in the body's link: an object's model frame or shape
};

struct EntityMotion {
  Pose X_WE = Pose::Identity();
  FrameVelocity velocity;
};

[[nodiscard]] DOPPEL_API bool is_world(const std::string& frame);
// True if the name is that of an object or a part of one; false if there is none of this name.
[[nodiscard]] DOPPEL_API bool find_object(const Scene& scene, const std::string& name, Entity& entity);
// "left::Revolute 1", or only the joint if one robot has it.
[[nodiscard]] DOPPEL_API Status find_scalar_joint(const Scene& scene, const std::string& name, int& robot,
                                                  int& joint);
// A link of a robot. A scope that is not a robot is ignored, because in Gazebo a model can be spawned
// under any name.
[[nodiscard]] DOPPEL_API Status find_link(const Scene& scene, const std::string& name, BodyId& body);
[[nodiscard]] DOPPEL_API Status find_entity(const Scene& scene, const std::string& name, Entity& entity);
[[nodiscard]] DOPPEL_API EntityMotion motion_of(const Scene& scene, const Entity& entity);
// A frame of reference: an entity or the world.
[[nodiscard]] DOPPEL_API Status find_frame(const Scene& scene, const std::string& name, EntityMotion& frame);
struct LinkVisual {
  int link = 0;  // of the model
  const Geometry* geometry = nullptr;
  const Origin* origin = nullptr;      // in the link
  const Material* material = nullptr;  // nullptr: none
};
// The drawn shapes of an object, in the order of its links: its visuals, or its collisions where it has none.
[[nodiscard]] DOPPEL_API std::vector<LinkVisual> visuals_of(const ModelInstance& object);
// The present pose of its first visual shape in its base link; the identity if it has none.
[[nodiscard]] DOPPEL_API Pose shape_in_object(const Instance& object);

}  // namespace doppel
