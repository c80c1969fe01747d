#pragma once
// Triangle meshes from STL, OBJ, COLLADA and glTF files (through assimp, which no other room sees).

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace doppel {

struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices;                // in the file's frame and, after load_mesh, scaled: m
  std::vector<std::array<std::uint32_t, 3>> triangles;  // counter-clockwise seen from outside
  std::optional<Eigen::Vector4f> rgba;                  // the file's own colour, where it has one

  [[nodiscard]] Eigen::AlignedBox3f bounds() const;
};

// Reads `path`, merges its parts with their node transforms, multiplies by `scale` (a negative product flips
// the triangles back outward). COLLADA's unit and up axis: the unit is applied, the up axis is not, as RViz
// and Gazebo do. Throws InputError (rule "mesh.unreadable", "mesh.empty").
TriangleMesh load_mesh(const std::string& path, const Eigen::Vector3d& scale);

}  // namespace doppel
