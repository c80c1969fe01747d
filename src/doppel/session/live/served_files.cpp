#include "doppel/session/live/served_files.h"

#include "doppel/base/packages/package_folder.h"
#include "doppel/scenario/sdf/sdf_world.h"
#include "doppel/twin/publishers/object_publisher.h"

namespace doppel {

namespace fs = std::filesystem;

namespace {

// A robot's description has the text of its URDF; an object's is made from the world file and has none.
bool is_object(const ModelInstance& instance) {
  return instance.is_object() && instance.description->xml.empty();
}

void add_object(const RobotDescription& object, RobotFiles& out) {
  std::error_code none;
  const fs::path world = object.source.file ? fs::absolute(*object.source.file, none) : fs::path();
  const auto add = [&](const std::string& uri, const std::string& path) {
    const fs::path file = fs::absolute(path, none).lexically_normal();
    out.meshes.push_back({uri, file, world.lexically_normal(), model_around(file)});
  };
  const auto add_image = [&add](const std::string& path) {
    if (!path.empty()) add(file_uri(path), path);
  };
  for (const Link& link : object.links) {
    for (const Visual& visual : link.visuals) {
      const auto* mesh = std::get_if<MeshGeometry>(&visual.geometry);
      if (mesh != nullptr && !mesh->path.empty()) add(mesh_resource(*mesh), mesh->path);
      if (const auto* map = std::get_if<Heightmap>(&visual.geometry)) {
        for (const Heightmap::Texture& texture : map->textures) {
          add_image(texture.diffuse.path);
          add_image(texture.normal.path);
        }
      }
      if (!visual.material) continue;
      add_image(visual.material->texture_path);
      for (const Image* map : {&visual.material->normal_map, &visual.material->roughness_map,
                               &visual.material->metalness_map, &visual.material->emissive_map})
        add_image(map->path);
    }
  }
}

}  // namespace

RobotFiles files_of(const RobotDescription& robot) {
  RobotFiles out;
  std::error_code none;
  if (robot.source.file) out.description = fs::absolute(*robot.source.file, none).lexically_normal();
  const auto add = [&out](const Geometry& geometry) {
    const auto* mesh = std::get_if<MeshGeometry>(&geometry);
    if (mesh != nullptr && !mesh->path.empty())
      out.meshes.push_back({mesh->uri, fs::path(mesh->path).lexically_normal()});
  };
  for (const Link& link : robot.links) {
    for (const Visual& visual : link.visuals) {
      add(visual.geometry);
      if (visual.material && !visual.material->texture.empty())
        out.textures.push_back(visual.material->texture);
    }
    for (const Collision& collision : link.collisions) add(collision.geometry);
  }
  return out;
}

RobotFiles served_files(const std::vector<ModelInstance>& instances) {
  RobotFiles out;
  for (const ModelInstance& instance : instances) {
    if (is_object(instance)) {
      add_object(*instance.description, out);
    } else {
      out = both(files_of(*instance.description), out);
      const SourceLocation& source = instance.description->source;
      if (source.file && is_sdf(*source.file)) add_object(*instance.description, out);
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
