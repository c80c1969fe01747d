#pragma once
// A collision shape of a link, the same for every consumer: a primitive, the convex hull of a mesh, or a box
// where the mesh is flat. link_shapes.h makes the list of a model.

#include <compare>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/meshes/heightmap.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"
#include "doppel/robot/collision/friction.h"

namespace doppel {

struct TriangleMesh;

struct CollisionHull {
  std::vector<Eigen::Vector3f> vertices;  // m, in the mesh's frame; the shape is their convex hull
};
using SharedHull = std::shared_ptr<const CollisionHull>;  // shapes of one mesh and scale share it
// A terrain; only on links that do not move.
using SharedField = std::shared_ptr<const HeightField>;

// Names a shape in its model: the same for every consumer, and after a reload of the same description.
struct ShapeId {
  int link = -1;      // index into Model::links
  int collision = 0;  // index into Link::collisions
  int part = 0;       // of a mesh that collides as several convex parts
  auto operator<=>(const ShapeId&) const = default;
};

struct CollisionShape {
  std::variant<Box, Cylinder, Capsule, Sphere, Ellipsoid, SharedHull, SharedField> geometry;
  Pose X_LS = Pose::Identity();  // shape in the link frame
  Friction friction = {};
  // Speed after an impact over that before, 0..1; nullopt: not written, so that the other shape of a pair
  // decides.
  std::optional<double> restitution = {};
  ShapeId id = {};
  SourceLocation source = {};  // the <collision>
  bool as_described = false;   // <doppel:contact>: never replaced by the rolling form of a wheel
  // The triangles behind a hull or box that no description has, in a frame G; CollisionDetail::triangles uses
  // them.
  std::shared_ptr<const TriangleMesh> triangles = nullptr;
  Pose X_LG = Pose::Identity();
};

// False for a primitive with a size of zero; a mesh may have none that is found.
DOPPEL_API bool has_size(const Geometry& geometry);

// z in m, along the axis of F, of the shape's lowest point. X_FS: the shape in a frame F.
DOPPEL_API double lowest_point(const CollisionShape& shape, const Pose& X_FS);

struct CollisionMesh {
  SharedHull hull;                                     // null: the box is used
  Eigen::Vector3d box_size = Eigen::Vector3d::Zero();  // full side lengths, m
  Pose X_GB = Pose::Identity();                        // the box in the mesh's frame
};

// Of a hull with more vertices than this, only those that are extreme in one of kSupportDirections
// directions are kept.
inline constexpr std::size_t kMaxHullVertices = 500;
inline constexpr int kSupportDirections = 300;

// vertices: m, in the mesh's frame. A mesh thinner than a ten-thousandth of its length is flat: no hull can
// be computed, and a box of at least 1 mm is used instead.
DOPPEL_API CollisionMesh make_collision_mesh(const std::vector<Eigen::Vector3f>& vertices);

enum class MeshSource {
  file,    // the vertices of the file, as engines need them
  report,  // the hull of the cached report (mesh_report.h), so that a check reads no mesh
};

// Loads every file once for each scale.
class DOPPEL_API CollisionMeshes {
 public:
  explicit CollisionMeshes(MeshSource source = MeshSource::file) : source_(source) {}
  // nullptr: the mesh has no file, so that nothing collides. Throws the InputErrors of load_mesh. `owner`
  // ("link 'arm'") and `where` are used in the warning "physics.flat_mesh". Valid as long as this object.
  const CollisionMesh* find(const MeshGeometry& mesh, const std::string& owner, const SourceLocation& where,
                            Diagnostics& diagnostics);

 private:
  MeshSource source_;
  std::map<std::string, CollisionMesh> loaded_;  // by path and scale
};

}  // namespace doppel
