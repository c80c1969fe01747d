#pragma once
// The objects of a planning scene by their names, with MoveIt's operations on them. Source: moveit_core's
// planning_scene.cpp (processCollisionObjectMsg, processAttachedCollisionObjectMsg).

#include <functional>
#include <map>
#include <string>

#include "doppel/export.h"
#include "doppel/robot/scene_objects/scene_object.h"

namespace doppel {

inline constexpr std::size_t kMaxSceneObjects = 1000;
inline constexpr const char* kOctomapId = "<octomap>";

// A frame of an object: in the world, or in the link that the object is attached to.
struct ObjectFrame {
  std::string link;  // empty: the world
  Pose X_PF = Pose::Identity();
};

// A value: copies share meshes. Every operation that throws has changed nothing. InputError: "scene.shape"
// and "scene.object" as of check_object(), "scene.unknown_object" with the nearest name, "scene.attached" for
// what a link holds or does not hold, "scene.count".
class DOPPEL_API SceneObjects {
 public:
  // The world's pose of a link.
  using LinkPose = std::function<Pose(const std::string& link)>;

  // Replaces the world's object of this name. One that is attached keeps its name to itself.
  void add(SceneObject object);
  // Adds shapes where object.X_PO and their own poses say; subframes replace those of the same names. Without
  // such an object it is added.
  void append(SceneObject object);
  // Moves a world's object; its shapes stay as they are in it. shape_poses: X_OS of each shape, or empty.
  void move(const std::string& id, const Pose& X_WO, const std::vector<Pose>& shape_poses = {});
  // A world's object; "": all of them, and the octomap.
  void remove(const std::string& id);
  // The occupied cells of the world, which replace those before; nullptr: none.
  void set_octomap(SharedCells cells, const Pose& X_WO);

  // object.link holds it from now on. Without shapes it is the world's object of this name, which keeps its
  // place; else its pose is in the link, and an attached object of this name is replaced, or with `append`
  // extended.
  void attach(SceneObject object, const LinkPose& X_WL, bool append = false);
  // Puts what `link` holds (empty: any link) back into the world where it is. id "": everything of the link.
  void detach(const std::string& id, const std::string& link, const LinkPose& X_WL);

  // nullptr: there is none; attached or not.
  [[nodiscard]] const SceneObject* find(const std::string& id) const;
  // "object" or "object/subframe"; nullopt: there is none.
  [[nodiscard]] std::optional<ObjectFrame> frame(const std::string& name) const;
  [[nodiscard]] std::vector<std::string> frame_names() const;
  [[nodiscard]] const std::map<std::string, SceneObject>& all() const { return objects_; }

 private:
  SceneObject& existing(const std::string& id, bool in_world);
  void put(SceneObject object);

  std::map<std::string, SceneObject> objects_;
};

}  // namespace doppel
