#pragma once
// A mesh file as assimp reads it: triangles with what they look like, in the file's units. For formats that the own readers
// do not read, and for what they leave out.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "doppel/export.h"

namespace doppel {

struct DOPPEL_API ImportedMesh {
  struct Material {
    std::string name;
    bool given = false;  // false: assimp's own, for a part without a material
    Eigen::Vector4f rgba = Eigen::Vector4f::Ones();
    std::optional<Eigen::Vector4f> diffuse;  // as written, without the opacity
    Eigen::Vector3f emissive = Eigen::Vector3f::Zero();
    float specular = 0, shininess = 0;
    int texture = -1;  // into ImportedMesh::textures
  };
  struct Part {
    std::vector<std::string> names;  // of its nodes and its mesh
    std::vector<Eigen::Vector3f> positions, normals;
    std::vector<Eigen::Vector2f> uvs;  // or empty; v upwards
    std::vector<std::array<std::uint32_t, 3>> triangles;
    bool normals_written = false;
    int material = 0;
  };
  struct Texture {
    std::string path;   // as written; empty: embedded
    std::string bytes;  // of an embedded PNG or JPEG
  };
  std::vector<Material> materials;
  std::vector<Part> parts;
  std::vector<Texture> textures;
};

// Throws InputError "mesh.unreadable": it is no regular file, too large, or assimp does not read it; "mesh.not_fetched".
DOPPEL_API ImportedMesh import_mesh(const std::string& path);

}  // namespace doppel
