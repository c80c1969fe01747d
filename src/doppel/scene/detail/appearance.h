#pragma once
// What the module around assimp gives: triangles with what they look like, as in the file.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "doppel/scene/scene_builder.h"

namespace doppel::appearance {

struct FileMaterial {
  std::string name;
  bool given = false;  // false: assimp's own, for a part without a material
  Eigen::Vector4f rgba = Eigen::Vector4f::Ones();
  Eigen::Vector3f emissive = Eigen::Vector3f::Zero();
  float specular = 0, shininess = 0;
  int texture = -1;  // into FileScene::textures
};

struct FilePart {
  std::vector<std::string> names;  // of its nodes and its mesh
  std::vector<Eigen::Vector3f> positions, normals;
  std::vector<Eigen::Vector2f> uvs;  // or empty; v upwards
  std::vector<std::array<std::uint32_t, 3>> triangles;
  bool normals_written = false;
  int material = 0;
};

struct FileTexture {
  std::string path;   // as written; empty: embedded
  std::string bytes;  // of an embedded PNG or JPEG
};

struct FileScene {
  std::vector<FileMaterial> materials;
  std::vector<FilePart> parts;
  std::vector<FileTexture> textures;
};

// The mesh as scenes have it: at its scale, of the part that it names, with its textures read. Throws InputError
// "mesh.empty" without triangles, "mesh.unreadable" where a corner is not finite.
MeshAppearance appearance_of(const FileScene& file, const MeshGeometry& mesh);

}  // namespace doppel::appearance
