#pragma once
// MoveIt's .scene files: a name, objects with shapes, colours and, in the newer form, poses and subframes.
// Sources: loadGeometryFromStream and saveGeometryToStream of moveit_core's planning_scene.cpp;
// constructShapeFromText of geometric_shapes.

#include <string>
#include <string_view>
#include <vector>

#include "doppel/export.h"
#include "doppel/robot/scene_objects/scene_object.h"

namespace doppel {

struct SceneFile {
  std::string name;
  std::vector<SceneObject> objects;  // in the world, in the order of the file
};

// Poses are in the robot's root link, m. Both forms are read, also mixed. Throws InputError, rule
// "scene.file", at the token that is wrong, and those of check_object(). `file` is used in messages.
[[nodiscard]] DOPPEL_API SceneFile parse_scene(std::string_view text, const std::string& file);
// Also "file.unreadable".
[[nodiscard]] DOPPEL_API SceneFile read_scene(const std::string& path);

// The newer form. Attached objects and the octomap are omitted, as MoveIt does.
[[nodiscard]] DOPPEL_API std::string write_scene(const SceneFile& scene);

}  // namespace doppel
