#include "doppel/robot/scene_objects/scene_object.h"

#include <fmt/format.h>

#include <algorithm>

#include "doppel/base/core/overloaded.h"
#include "doppel/robot/collision/size_limits.h"

namespace doppel {
namespace {

constexpr double kPlaneSide = 200, kPlaneThickness = 1e-3;  // m

// The reasons why a shape cannot collide.
class ShapeCheck {
 public:
  ShapeCheck(const SceneObject& object, const SourceLocation& where) : object_(object), where_(where) {}

  void check() {
    check_distance(object_.X_PO, kRule, where_, errors_);
    for (const ObjectShape& shape : object_.shapes) {
      check_distance(shape.X_OS, kRule, where_, errors_);
      std::visit(
          Overloaded{[this](const ScenePlane& plane) { check_plane(plane); },
                     [this](const SharedTriangles& mesh) { check_mesh(*mesh); }, [](const SharedCells&) {},
                     [this](const auto& solid) { check_sizes(solid, kRule, where_, errors_); }},
          shape.geometry);
    }
    if (!errors_.has_errors()) return;
    // Messages about sizes do not name the object.
    std::vector<Diagnostic> named = errors_.all();
    for (Diagnostic& one : named) one.message = fmt::format("object '{}': {}", object_.id, one.message);
    throw InputError(std::move(named));
  }

 private:
  static constexpr const char* kRule = "scene.shape";

  void complain(const std::string& what, const std::string& fix) { errors_.error(kRule, where_, what, fix); }

  void check_plane(const ScenePlane& plane) {
    const double length = plane.normal.norm();
    if (!std::isfinite(length) || !std::isfinite(plane.offset) || !(length > 1e-9)) {
      complain("a plane a x + b y + c z + d = 0 has no direction, or numbers that are not finite",
               "the ground is 0 0 1 0");
    } else {
      check_range("distance of the plane", plane.offset / length, -kMaxDistance, kMaxDistance, "m", kRule,
                  where_, errors_);
    }
  }

  void check_mesh(const TriangleMesh& mesh) {
    if (mesh.vertices.empty() || mesh.triangles.empty())
      return complain("a mesh has no triangles", "leave the shape out, or give it triangles");
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
      if (mesh.vertices[i].allFinite() &&
          mesh.vertices[i].cwiseAbs().maxCoeff() <= static_cast<float>(kMaxShapeSize))
        continue;
      return complain(fmt::format("vertex {} of a mesh is not finite, or beyond 10 km", i),
                      "vertices are in metres");
    }
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      const auto& corners = mesh.triangles[i];
      const std::uint32_t largest = *std::max_element(corners.begin(), corners.end());
      if (largest < mesh.vertices.size()) continue;
      return complain(fmt::format("triangle {} of a mesh has the corner {}, but there are {} vertices", i,
                                  largest, mesh.vertices.size()),
                      "corners are counted from 0");
    }
  }

  const SceneObject& object_;
  const SourceLocation& where_;
  Diagnostics errors_;
};

CollisionShape plate_of(const ScenePlane& plane, const Pose& X_OS) {
  const double length = plane.normal.norm();
  const Eigen::Vector3d n = plane.normal / length;
  CollisionShape out{Box{{kPlaneSide, kPlaneSide, kPlaneThickness}}};
  out.X_LS = X_OS * Pose(Eigen::Translation3d(-plane.offset / length * n)) * Pose(rotation_from_z(n));
  return out;
}

// A flat mesh collides by its triangles; the box around it is for distances.
CollisionShape mesh_shape(const SharedTriangles& mesh, const Pose& X_OS) {
  const CollisionMesh solid = make_collision_mesh(mesh->vertices);
  CollisionShape out = collision_shape(MeshGeometry{}, &solid, X_OS, Friction{});
  out.triangles = mesh;
  out.X_LG = X_OS;
  return out;
}

void add_cells(const std::vector<Eigen::AlignedBox3d>& cells, const Pose& X_OS,
               std::vector<CollisionShape>& out) {
  for (const Eigen::AlignedBox3d& cell : cells) {
    CollisionShape box{Box{cell.sizes()}};
    box.X_LS = X_OS * Eigen::Translation3d(cell.center());
    out.push_back(std::move(box));
  }
}

}  // namespace

void check_object(const SceneObject& object, const SourceLocation& where) {
  if (object.id.empty()) throw InputError("scene.object", where, "an object has no name", "give it an id");
  if (object.shapes.empty()) {
    throw InputError("scene.object", where, fmt::format("object '{}' has no shapes", object.id),
                     "give it a primitive, a mesh or a plane");
  }
  for (const Subframe& frame : object.subframes) {
    if (frame.name.empty()) {
      throw InputError("scene.object", where, fmt::format("a subframe of '{}' has no name", object.id),
                       "its frame is OBJECT/NAME");
    }
  }
  ShapeCheck(object, where).check();
}

SceneInstance scene_instance(const SceneObject& object, const Pose& X_WO) {
  SceneInstance out;
  out.name = object.id;
  out.X_WR = X_WO;
  std::vector<CollisionShape>& shapes = out.shapes.emplace_back();
  for (const ObjectShape& shape : object.shapes) {
    std::visit(
        Overloaded{[&](const ScenePlane& plane) { shapes.push_back(plate_of(plane, shape.X_OS)); },
                   [&](const SharedTriangles& mesh) { shapes.push_back(mesh_shape(mesh, shape.X_OS)); },
                   [&](const SharedCells& cells) { add_cells(*cells, shape.X_OS, shapes); },
                   [&](const auto& solid) {
                     shapes.push_back(collision_shape(solid, nullptr, shape.X_OS, Friction{}));
                   }},
        shape.geometry);
  }
  for (std::size_t i = 0; i < shapes.size(); ++i) shapes[i].id = {0, static_cast<int>(i), 0};
  return out;
}

}  // namespace doppel
