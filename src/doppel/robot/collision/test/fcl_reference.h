#pragma once
// Distances by FCL 0.7, for the comparison with CollisionScene: the same shapes, as FCL's primitives and
// convex polyhedra.

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/ellipsoid.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <random>
#include <span>
#include <stdexcept>
#include <vector>

#include "doppel/base/core/overloaded.h"
#include "doppel/description/meshes/convex_hull.h"
#include "doppel/description/urdf/load.h"
#include "doppel/robot/collision/collision_scene.h"

namespace doppel::test {

using FclGeometry = std::shared_ptr<fcl::CollisionGeometryd>;

// A convex polyhedron twice: as a solid, which FCL collides, and as triangles, whose distance it finds exactly.
struct FclShape {
  FclGeometry solid, surface;
};

inline FclShape fcl_polyhedron(const std::vector<Eigen::Vector3f>& points) {
  const ConvexHull convex = convex_hull(points);
  auto vertices = std::make_shared<std::vector<fcl::Vector3d>>();
  std::vector<int> renamed(points.size(), -1);  // FCL wants no vertex without a face
  auto faces = std::make_shared<std::vector<int>>();
  std::vector<fcl::Triangle> triangles;
  for (const auto& triangle : convex.triangles) {
    faces->push_back(3);
    for (const std::uint32_t corner : triangle) {
      if (renamed[corner] < 0) {
        renamed[corner] = static_cast<int>(vertices->size());
        vertices->push_back(points[corner].cast<double>());
      }
      faces->push_back(renamed[corner]);
    }
    const std::size_t n = faces->size();
    triangles.emplace_back((*faces)[n - 3], (*faces)[n - 2], (*faces)[n - 1]);
  }
  auto surface = std::make_shared<fcl::BVHModel<fcl::OBBRSSd>>();
  surface->beginModel(static_cast<int>(triangles.size()), static_cast<int>(vertices->size()));
  surface->addSubModel(*vertices, triangles);
  surface->endModel();
  return {std::make_shared<fcl::Convexd>(vertices, static_cast<int>(triangles.size()), faces), surface};
}

inline FclShape fcl_shape(const CollisionShape& shape) {
  const auto same = [](const FclGeometry& geometry) { return FclShape{geometry, geometry}; };
  return std::visit(
      Overloaded{
          [&](const Box& s) {
            std::vector<Eigen::Vector3f> corners;
            for (int i = 0; i < 8; ++i) {
              const Eigen::Vector3d sign(i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 0.5 : -0.5);
              corners.push_back(s.size.cwiseProduct(sign).cast<float>());
            }
            return FclShape{std::make_shared<fcl::Boxd>(s.size), fcl_polyhedron(corners).surface};
          },
          [&](const Cylinder& s) { return same(std::make_shared<fcl::Cylinderd>(s.radius, s.length)); },
          [&](const Capsule& s) { return same(std::make_shared<fcl::Capsuled>(s.radius, s.length)); },
          [&](const Sphere& s) { return same(std::make_shared<fcl::Sphered>(s.radius)); },
          [&](const Ellipsoid& s) { return same(std::make_shared<fcl::Ellipsoidd>(s.radii)); },
          [](const SharedHull& s) { return fcl_polyhedron(s->vertices); },
          [](const SharedField&) -> FclShape { throw std::logic_error("robots have no terrain"); }},
      shape.geometry);
}

class FclReference {
 public:
  explicit FclReference(const LinkShapes& shapes) {
    for (const auto& of_link : shapes) {
      links_.emplace_back();
      for (const CollisionShape& shape : of_link) links_.back().push_back({fcl_shape(shape), shape.X_LS});
    }
  }

  // m, of surfaces that do not touch. Each of FCL's solvers ends too early for some pairs: libccd's for
  // cylinders with parallel axes, FCL's own for polyhedra. What they find is a distance of two points, so that
  // the smaller one is right, or nearer to it.
  [[nodiscard]] double distance(int link_a, int link_b, std::span<const Pose> X_WL) const {
    double nearest = std::numeric_limits<double>::infinity();
    fcl::DistanceRequestd request;
    request.distance_tolerance = 1e-8;
    for (const Placed& a : links_[static_cast<std::size_t>(link_a)]) {
      for (const Placed& b : links_[static_cast<std::size_t>(link_b)]) {
        const bool triangles = a.shape.surface != a.shape.solid && b.shape.surface != b.shape.solid;
        for (const fcl::GJKSolverType solver : {fcl::GST_LIBCCD, fcl::GST_INDEP}) {
          if (triangles && solver == fcl::GST_INDEP) continue;  // no solver is used
          request.gjk_solver_type = solver;
          fcl::DistanceResultd result;
          fcl::distance(a.shape.surface.get(), X_WL[static_cast<std::size_t>(link_a)] * a.X_LS,
                        b.shape.surface.get(), X_WL[static_cast<std::size_t>(link_b)] * b.X_LS, request,
                        result);
          nearest = std::min(nearest, result.min_distance);
        }
      }
    }
    return nearest;
  }

  [[nodiscard]] bool touch(int link_a, int link_b, std::span<const Pose> X_WL) const {
    const fcl::CollisionRequestd request;  // one contact is enough
    for (const Placed& a : links_[static_cast<std::size_t>(link_a)]) {
      for (const Placed& b : links_[static_cast<std::size_t>(link_b)]) {
        fcl::CollisionResultd result;
        fcl::collide(a.shape.solid.get(), X_WL[static_cast<std::size_t>(link_a)] * a.X_LS,
                     b.shape.solid.get(), X_WL[static_cast<std::size_t>(link_b)] * b.X_LS, request, result);
        if (result.isCollision()) return true;
      }
    }
    return false;
  }

 private:
  struct Placed {
    FclShape shape;
    Pose X_LS;
  };
  std::vector<std::vector<Placed>> links_;
};

// A description of robots/ or of a file, as engines see it.
struct CollidingRobot {
  std::shared_ptr<const Model> model;
  std::shared_ptr<const CollisionScene> scene;
};

inline CollidingRobot load_colliding(const std::string& target, const std::filesystem::path& robots) {
  PackageResolver resolver;
  resolver.add_bundled(robots);
  const Target found = resolve_target(target, robots);
  resolver.add_context(found.description);
  Diagnostics diagnostics;
  const RobotDescription robot = load_description(found.description, {}, resolver, diagnostics).robot;
  CollidingRobot out;
  out.model = std::make_shared<const Model>(compile_model(robot, BaseKind::fixed, diagnostics));
  CollisionMeshes meshes;
  SceneInstance instance;
  instance.name = robot.name;
  instance.model = out.model;
  instance.shapes = link_shapes(robot, *out.model, MeshUse::hull, meshes, diagnostics);
  out.scene = std::make_shared<const CollisionScene>(std::vector{std::move(instance)});
  return out;
}

// [nq] rad, m: uniform within the limits, or over one turn, or 1 m to each side.
inline Eigen::VectorXd random_state(const Model& model, std::mt19937_64& random) {
  Eigen::VectorXd q = model.neutral();
  for (const ModelJoint& joint : model.joints) {
    if (!joint.scalar() || joint.mimics()) continue;
    const bool limited = std::isfinite(joint.lower) && std::isfinite(joint.upper);
    const double reach = joint.type == JointType::prismatic ? 1.0 : 3.14159;
    q[joint.q] =
        std::uniform_real_distribution(limited ? joint.lower : -reach, limited ? joint.upper : reach)(random);
  }
  model.apply_mimics(q);
  return q;
}

}  // namespace doppel::test
