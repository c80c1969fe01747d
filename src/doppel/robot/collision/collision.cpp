#include "doppel/robot/collision/collision.h"

#include <algorithm>
#include <optional>
#include <stdexcept>

#include "doppel/base/core/plugin_module.h"
#include "doppel/description/meshes/mesh.h"
#include "doppel/description/meshes/mesh_report.h"
#include "doppel/description/meshes/shape_mesh.h"
#include "doppel/robot/collision/detail/convex.h"
#include "doppel/robot/collision/detail/surface.h"

namespace doppel {

// Outside of the anonymous namespace, because LinkCollider::Impl, which contains it, has external linkage.
struct CollidingShape {
  Pose X_LS = Pose::Identity();   // in the link
  ConvexSolid solid;              // of a mesh: its hull
  std::shared_ptr<void> surface;  // with CollisionDetail::triangles
  bool is_mesh = false;
};

namespace {

std::optional<ConvexShape> convex_shape(const Geometry& geometry) {
  if (!has_extent(geometry)) return std::nullopt;
  if (const auto* mesh = std::get_if<MeshGeometry>(&geometry)) {
    const MeshReport& report = cached_mesh_report(mesh->path);
    if (!report.problem.empty() || report.hull.empty()) return std::nullopt;
    ConvexPoints points;
    points.vertices.resize(3, static_cast<Eigen::Index>(report.hull.size()));
    for (std::size_t i = 0; i < report.hull.size(); ++i) {
      points.vertices.col(static_cast<Eigen::Index>(i)) =
          report.hull[i].cast<double>().cwiseProduct(mesh->scale);
    }
    return points;
  }
  if (const auto* box = std::get_if<Box>(&geometry)) return *box;
  if (const auto* cylinder = std::get_if<Cylinder>(&geometry)) return *cylinder;
  if (const auto* capsule = std::get_if<Capsule>(&geometry)) return *capsule;
  if (const auto* sphere = std::get_if<Sphere>(&geometry)) return *sphere;
  ConvexPoints points;
  const std::optional<TriangleMesh> surface = convex_surface(geometry);
  if (!surface) throw std::logic_error("a plane has no convex shape");  // has_extent() is false for it
  points.vertices.resize(3, static_cast<Eigen::Index>(surface->vertices.size()));
  for (std::size_t i = 0; i < surface->vertices.size(); ++i)
    points.vertices.col(static_cast<Eigen::Index>(i)) = surface->vertices[i].cast<double>();
  return points;
}

const SurfaceFunctions& surfaces() {
  using Entry = const SurfaceFunctions* (*)();
  static const SurfaceFunctions* const functions =
      reinterpret_cast<Entry>(plugin_symbol(kSurfaceModule, kSurfaceEntry))();
  return *functions;
}

std::shared_ptr<void> surface_of(const Geometry& geometry) {
  std::optional<TriangleMesh> triangles;
  if (const auto* mesh = std::get_if<MeshGeometry>(&geometry)) {
    triangles = load_mesh(*mesh);
  } else {
    triangles = convex_surface(geometry);
  }
  return {surfaces().make(geometry, triangles ? &*triangles : nullptr), surfaces().discard};
}

bool surfaces_touch(const CollidingShape& a, const Pose& X_WA, const CollidingShape& b, const Pose& X_WB) {
  return surfaces().touch(a.surface.get(), X_WA, b.surface.get(), X_WB);
}

}  // namespace

bool has_extent(const Geometry& geometry) {
  if (const auto* box = std::get_if<Box>(&geometry)) return box->size.minCoeff() > 0;
  if (const auto* cylinder = std::get_if<Cylinder>(&geometry))
    return cylinder->radius > 0 && cylinder->length > 0;
  if (const auto* capsule = std::get_if<Capsule>(&geometry))
    return capsule->radius > 0 && capsule->length >= 0;
  if (const auto* sphere = std::get_if<Sphere>(&geometry)) return sphere->radius > 0;
  if (const auto* ellipsoid = std::get_if<Ellipsoid>(&geometry)) return ellipsoid->radii.minCoeff() > 0;
  if (const auto* cone = std::get_if<Cone>(&geometry)) return cone->radius > 0 && cone->length > 0;
  if (const auto* extrusion = std::get_if<Extrusion>(&geometry))
    return extrusion->outline.size() >= 3 && extrusion->height > 0;
  const auto* const mesh = std::get_if<MeshGeometry>(&geometry);
  return mesh != nullptr && !mesh->path.empty();  // else a plane
}

struct LinkCollider::Impl {
  std::vector<std::vector<CollidingShape>> links;

  // The deepest pair of shapes of two links; without `exact`, the first pair that overlaps.
  [[nodiscard]] ConvexDepth overlap(int link_a, int link_b, std::span<const Pose> X_WL, bool exact) const {
    ConvexDepth deepest;
    const Pose X_LaLb = X_WL[link_a].inverse() * X_WL[link_b];
    for (const CollidingShape& a : links[link_a]) {
      const Pose X_ALb = a.X_LS.inverse() * X_LaLb;
      for (const CollidingShape& b : links[link_b]) {
        const ConvexDepth found = pair_overlap(a, b, X_ALb * b.X_LS, exact);
        deepest.overlap = deepest.overlap || found.overlap;
        deepest.depth = std::max(deepest.depth, found.depth);
        if (deepest.overlap && !exact) return deepest;
      }
    }
    return deepest;
  }

  // With CollisionDetail::triangles the surfaces of meshes decide; the depth is always that of hulls.
  static ConvexDepth pair_overlap(const CollidingShape& a, const CollidingShape& b, const Pose& X_AB,
                                  bool exact) {
    const bool by_surface = a.surface != nullptr && b.surface != nullptr && (a.is_mesh || b.is_mesh);
    if (!by_surface) return convex_depth(a.solid, b.solid, X_AB, exact);
    if (!surfaces_touch(a, Pose::Identity(), b, X_AB)) return {};
    ConvexDepth found;
    if (exact) found = convex_depth(a.solid, b.solid, X_AB, true);
    found.overlap = true;
    return found;
  }
};

LinkCollider::LinkCollider(const RobotDescription& robot, CollisionDetail detail)
    : impl_(std::make_unique<Impl>()) {
  impl_->links.resize(robot.links.size());
  for (std::size_t i = 0; i < robot.links.size(); ++i) {
    for (const Collision& collision : robot.links[i].collisions) {
      auto convex = convex_shape(collision.geometry);
      if (!convex) continue;
      CollidingShape shape{collision.origin.pose(), ConvexSolid(std::move(*convex)), nullptr,
                           std::holds_alternative<MeshGeometry>(collision.geometry)};
      if (detail == CollisionDetail::triangles) shape.surface = surface_of(collision.geometry);
      impl_->links[i].push_back(std::move(shape));
    }
  }
}

LinkCollider::~LinkCollider() = default;
LinkCollider::LinkCollider(LinkCollider&&) noexcept = default;

bool LinkCollider::has_shape(int link) const {
  return !impl_->links[link].empty();
}

bool LinkCollider::touch(int link_a, int link_b, std::span<const Pose> X_WL) const {
  return impl_->overlap(link_a, link_b, X_WL, false).overlap;
}

double LinkCollider::depth(int link_a, int link_b, std::span<const Pose> X_WL) const {
  return impl_->overlap(link_a, link_b, X_WL, true).depth;
}

std::vector<LinkContact> LinkCollider::contacts(std::span<const Pose> X_WL) const {
  std::vector<LinkContact> out;
  const int count = static_cast<int>(impl_->links.size());
  for (int a = 0; a < count; ++a) {
    for (int b = a + 1; b < count; ++b) {
      const ConvexDepth found = impl_->overlap(a, b, X_WL, true);
      if (found.overlap) out.push_back({a, b, found.depth});
    }
  }
  return out;
}

}  // namespace doppel
