#include "doppel/session/served_files.h"

#include "doppel/twin/object_publisher.h"

namespace doppel {

namespace fs = std::filesystem;

namespace {

// A robot's description has the text of its URDF; an object's is made from the world file and has none.
bool is_object(const ModelInstance& instance) {
  return instance.is_object() && instance.description->xml.empty();
}

void add_object(const RobotDescription& object, RobotFiles& out) {
  std::error_code none;
  for (const Link& link : object.links) {
    for (const Visual& visual : link.visuals) {
      const auto* mesh = std::get_if<MeshGeometry>(&visual.geometry);
      if (mesh == nullptr || mesh->path.empty()) continue;
      const fs::path world = object.source.file ? fs::absolute(*object.source.file, none) : fs::path();
      out.meshes.push_back({mesh_resource(*mesh), fs::absolute(mesh->path, none).lexically_normal(),
                            world.lexically_normal()});
    }
  }
}

}  // namespace

RobotFiles served_files(const std::vector<ModelInstance>& instances) {
  RobotFiles out;
  for (const ModelInstance& instance : instances) {
    if (is_object(instance)) {
      add_object(*instance.description, out);
    } else {
      out = both(files_of(*instance.description), out);
    }
  }
  return out;
}

RobotFiles both(RobotFiles next, const RobotFiles& present) {
  next.meshes.insert(next.meshes.end(), present.meshes.begin(), present.meshes.end());
  next.textures.insert(next.textures.end(), present.textures.begin(), present.textures.end());
  return next;
}

}  // namespace doppel
