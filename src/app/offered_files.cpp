#include "app/offered_files.h"

#include "doppel/twin/object_publisher.h"

namespace doppel::app {

namespace fs = std::filesystem;

RobotFiles offered_files(const RobotDescription& robot, const std::vector<WorldObject>& objects) {
  RobotFiles out = files_of(robot);
  std::error_code none;
  for (const WorldObject& object : objects) {
    const auto* mesh = std::get_if<MeshGeometry>(&object.shape);
    if (mesh == nullptr || mesh->path.empty()) continue;
    const fs::path world = object.source.file ? fs::absolute(*object.source.file, none) : fs::path();
    out.meshes.push_back(
        {mesh_resource(*mesh), fs::absolute(mesh->path, none).lexically_normal(), world.lexically_normal()});
  }
  return out;
}

RobotFiles both(RobotFiles next, const RobotFiles& present) {
  next.meshes.insert(next.meshes.end(), present.meshes.begin(), present.meshes.end());
  next.textures.insert(next.textures.end(), present.textures.begin(), present.textures.end());
  return next;
}

}  // namespace doppel::app
