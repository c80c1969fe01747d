// Surfaces as FCL's bounding volume trees and primitives.
#include <fcl/fcl.h>

#include <mutex>

#include "doppel/export.h"
#include "doppel/robot/collision/detail/surface.h"

namespace doppel {
namespace {

// Oriented boxes alone: swept spheres, which FCL builds beside them for distances, take as long again.
using Tree = fcl::BVHModel<fcl::OBBd>;
using Shape = std::shared_ptr<fcl::CollisionGeometryd>;

Shape tree_of(const TriangleMesh& mesh) {
  std::vector<fcl::Vector3d> vertices;
  vertices.reserve(mesh.vertices.size());
  for (const Eigen::Vector3f& p : mesh.vertices) vertices.push_back(p.cast<double>());
  std::vector<fcl::Triangle> triangles;
  triangles.reserve(mesh.triangles.size());
  for (const auto& t : mesh.triangles) triangles.emplace_back(t[0], t[1], t[2]);
  auto tree = std::make_shared<Tree>();
  tree->beginModel(static_cast<int>(triangles.size()), static_cast<int>(vertices.size()));
  tree->addSubModel(vertices, triangles);
  tree->endModel();
  return tree;
}

Shape primitive_of(const Geometry& geometry) {
  if (const auto* box = std::get_if<Box>(&geometry)) return std::make_shared<fcl::Boxd>(box->size);
  if (const auto* c = std::get_if<Cylinder>(&geometry))
    return std::make_shared<fcl::Cylinderd>(c->radius, c->length);
  if (const auto* c = std::get_if<Capsule>(&geometry))
    return std::make_shared<fcl::Capsuled>(c->radius, c->length);
  return std::make_shared<fcl::Sphered>(std::get<Sphere>(geometry).radius);
}

// The tree of a mesh is made when a pair first needs it: most meshes are never that near to another one.
class Surface {
 public:
  Surface(const Geometry& geometry, const TriangleMesh* mesh) {
    if (mesh == nullptr) {
      shape_ = primitive_of(geometry);
    } else {
      mesh_ = *mesh;
    }
  }
  // Any thread.
  const fcl::CollisionGeometryd* shape() {
    std::call_once(build_once_, [this] {
      if (shape_ != nullptr) return;
      shape_ = tree_of(mesh_);
      mesh_ = {};
    });
    return shape_.get();
  }

 private:
  TriangleMesh mesh_;
  std::once_flag build_once_;
  Shape shape_;
};

bool touch(void* a, const Pose& X_WA, void* b, const Pose& X_WB) {
  const fcl::CollisionRequestd request;  // one contact is enough
  fcl::CollisionResultd result;
  fcl::collide(static_cast<Surface*>(a)->shape(), X_WA, static_cast<Surface*>(b)->shape(), X_WB, request,
               result);
  return result.isCollision();
}

}  // namespace
}  // namespace doppel

extern "C" DOPPEL_API const doppel::SurfaceFunctions* doppel_surface_functions() {
  static const doppel::SurfaceFunctions functions{
      [](const doppel::Geometry& geometry, const doppel::TriangleMesh* mesh) -> void* {
        return new doppel::Surface(geometry, mesh);
      },
      [](void* surface) { delete static_cast<doppel::Surface*>(surface); }, doppel::touch};
  return &functions;
}
