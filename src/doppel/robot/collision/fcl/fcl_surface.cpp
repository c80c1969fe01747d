// Surfaces as FCL's bounding volume trees and primitives.
#include <fcl/fcl.h>

#include "doppel/export.h"
#include "doppel/robot/collision/detail/surface.h"

namespace doppel {
namespace {

// Oriented boxes alone: swept spheres, which FCL builds beside them for distances, take as long again.
using Tree = fcl::BVHModel<fcl::OBBd>;
using Surface = std::shared_ptr<fcl::CollisionGeometryd>;

Surface tree_of(const TriangleMesh& mesh) {
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

Surface surface_of(const Geometry& geometry, const TriangleMesh* mesh) {
  if (mesh != nullptr) return tree_of(*mesh);
  if (const auto* box = std::get_if<Box>(&geometry)) return std::make_shared<fcl::Boxd>(box->size);
  if (const auto* c = std::get_if<Cylinder>(&geometry))
    return std::make_shared<fcl::Cylinderd>(c->radius, c->length);
  if (const auto* c = std::get_if<Capsule>(&geometry))
    return std::make_shared<fcl::Capsuled>(c->radius, c->length);
  return std::make_shared<fcl::Sphered>(std::get<Sphere>(geometry).radius);
}

bool touch(const void* a, const Pose& X_WA, const void* b, const Pose& X_WB) {
  const fcl::CollisionRequestd request;  // one contact is enough
  fcl::CollisionResultd result;
  fcl::collide(static_cast<const Surface*>(a)->get(), X_WA, static_cast<const Surface*>(b)->get(), X_WB,
               request, result);
  return result.isCollision();
}

}  // namespace
}  // namespace doppel

extern "C" DOPPEL_API const doppel::SurfaceFunctions* doppel_surface_functions() {
  static const doppel::SurfaceFunctions functions{
      [](const doppel::Geometry& geometry, const doppel::TriangleMesh* mesh) -> void* {
        return new doppel::Surface(doppel::surface_of(geometry, mesh));
      },
      [](void* surface) { delete static_cast<doppel::Surface*>(surface); }, doppel::touch};
  return &functions;
}
