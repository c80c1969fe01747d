#pragma once
// Triangle meshes from STL, OBJ and COLLADA files, read by readers of our own, which are fuzzed, and from
// glTF and others through assimp, which no other room sees. What our readers refuse is given to assimp as
// well: RViz and Gazebo show what it reads.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/export.h"

namespace doppel {

struct DOPPEL_API TriangleMesh {
  std::vector<Eigen::Vector3f> vertices;                // in the file's frame and, after load_mesh, scaled: m
  std::vector<std::array<std::uint32_t, 3>> triangles;  // counter-clockwise seen from outside
  std::optional<Eigen::Vector4f> rgba;                  // the file's own colour, where it has one
  std::size_t collapsed = 0;  // triangles of the file that have two corners at one place, and are left out
  std::string remark;  // why our own reader refused the file, which assimp then read; empty: it did not

  [[nodiscard]] Eigen::AlignedBox3f bounds() const;
};

// Reads `path`, merges its parts with their node transforms, multiplies by `scale` (a negative product flips
// the triangles back outward). COLLADA's unit and up axis: the unit is applied, the up axis is not, as RViz
// and Gazebo do. Throws InputError (rules "file.unreadable", "mesh.unreadable", "mesh.empty",
// "mesh.not_fetched").
DOPPEL_API TriangleMesh load_mesh(const std::string& path, const Eigen::Vector3d& scale);

// The same for the bytes of a file; format: "stl", "obj" or "dae". `name` stands for the file in messages,
// and an OBJ's materials are looked for beside it.
DOPPEL_API TriangleMesh parse_mesh(std::string_view bytes, std::string_view format, const std::string& name,
                                   const Eigen::Vector3d& scale);

}  // namespace doppel
