#pragma once
// Triangle meshes from STL, OBJ and COLLADA files by own, fuzzed readers, and from glTF and others by assimp,
// which only this module uses (imported_mesh.h). Files that the own readers reject are passed to assimp, too, because RViz and
// Gazebo show what it reads.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"

namespace doppel {

struct DOPPEL_API TriangleMesh {
  std::vector<Eigen::Vector3f> vertices;                // in the file's frame and, after load_mesh, scaled: m
  std::vector<std::array<std::uint32_t, 3>> triangles;  // counter-clockwise seen from outside
  std::optional<Eigen::Vector4f> rgba;                  // 0..1; the file's colour, if it has one
  std::size_t collapsed = 0;  // triangles of the file with two equal corners, which are left out
  std::string remark;  // the reason why the own reader rejected a file that assimp read; empty: it did not

  [[nodiscard]] Eigen::AlignedBox3f bounds() const;
};

// Reads `path`, merges its parts with their node transforms, multiplies by `scale` (with a negative product
// the triangles are flipped, so that they still face outwards). COLLADA's unit is applied, its up axis is
// not, as in RViz and Gazebo. Throws InputError (rules "file.unreadable", "mesh.unreadable", "mesh.empty",
// "mesh.not_fetched"). Any thread.
DOPPEL_API TriangleMesh load_mesh(const std::string& path, const Eigen::Vector3d& scale);

// False for the pointer of Git LFS to a file that was not fetched. Does not throw.
DOPPEL_API bool is_fetched(const std::string& path);

// The mesh of a description: its file, or the part of it that is named, at its scale. InputError
// "mesh.no_submesh" if the file has no such part.
DOPPEL_API TriangleMesh load_mesh(const MeshGeometry& mesh);

// The same for the bytes of a file; format: "stl", "obj" or "dae". `name` is used as the file in messages,
// and an OBJ's materials are searched in its folder.
DOPPEL_API TriangleMesh parse_mesh(std::string_view bytes, std::string_view format, const std::string& name,
                                   const Eigen::Vector3d& scale);

}  // namespace doppel
