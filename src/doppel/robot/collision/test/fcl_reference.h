#pragma once
// Distances by FCL 0.7, for the comparison with CollisionScene: the same shapes, as FCL's primitives and
// convex polyhedra.

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

inline FclGeometry fcl_hull(const std::vector<Eigen::Vector3f>& points) {
  const ConvexHull convex = convex_hull(points);
  auto vertices = std::make_shared<std::vector<fcl::Vector3d>>();
  auto faces = std::make_shared<std::vector<int>>();
  std::vector<int> renamed(points.size(), -1);  // FCL wants no vertex without a face
  for (const auto& triangle : convex.triangles) {
    faces->push_back(3);
    for (const std::uint32_t corner : triangle) {
      if (renamed[corner] < 0) {
        renamed[corner] = static_cast<int>(vertices->size());
        vertices->push_back(points[corner].cast<double>());
      }
      faces->push_back(renamed[corner]);
    }
  }
  return std::make_shared<fcl::Convexd>(vertices, static_cast<int>(convex.triangles.size()), faces);
}

inline FclGeometry fcl_geometry(const CollisionShape& shape) {
  using Out = FclGeometry;
  return std::visit(
      Overloaded{
          [](const Box& s) -> Out { return std::make_shared<fcl::Boxd>(s.size); },
          [](const Cylinder& s) -> Out { return std::make_shared<fcl::Cylinderd>(s.radius, s.length); },
          [](const Capsule& s) -> Out { return std::make_shared<fcl::Capsuled>(s.radius, s.length); },
          [](const Sphere& s) -> Out { return std::make_shared<fcl::Sphered>(s.radius); },
          [](const Ellipsoid& s) -> Out { return std::make_shared<fcl::Ellipsoidd>(s.radii); },
          [](const SharedHull& s) -> Out { return fcl_hull(s->vertices); },
          [](const SharedField&) -> Out { throw std::logic_error("robots have no terrain"); }},
      shape.geometry);
}

class FclReference {
 public:
  explicit FclReference(const LinkShapes& shapes) {
    for (const auto& of_link : shapes) {
      links_.emplace_back();
      for (const CollisionShape& shape : of_link) links_.back().push_back({fcl_geometry(shape), shape.X_LS});
    }
  }

  // m, of links that do not touch. Each of FCL's solvers ends too early for some pairs: libccd's for
  // cylinders with parallel axes, FCL's own for polyhedra. What they find is a distance of two points, so
  // that the smaller one is right, or nearer to it.
  [[nodiscard]] double distance(int link_a, int link_b, std::span<const Pose> X_WL) const {
    double nearest = std::numeric_limits<double>::infinity();
    fcl::DistanceRequestd request;
    request.distance_tolerance = 1e-8;
    for (const Placed& a : links_[static_cast<std::size_t>(link_a)]) {
      for (const Placed& b : links_[static_cast<std::size_t>(link_b)]) {
        for (const fcl::GJKSolverType solver : {fcl::GST_LIBCCD, fcl::GST_INDEP}) {
          request.gjk_solver_type = solver;
          fcl::DistanceResultd result;
          fcl::distance(a.geometry.get(), X_WL[static_cast<std::size_t>(link_a)] * a.X_LS, b.geometry.get(),
                        X_WL[static_cast<std::size_t>(link_b)] * b.X_LS, request, result);
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
        fcl::collide(a.geometry.get(), X_WL[static_cast<std::size_t>(link_a)] * a.X_LS, b.geometry.get(),
                     X_WL[static_cast<std::size_t>(link_b)] * b.X_LS, request, result);
        if (result.isCollision()) return true;
      }
    }
    return false;
  }

 private:
  struct Placed {
    FclGeometry geometry;
    Pose X_LS;
  };
  std::vector<std::vector<Placed>> links_;
};

// A description of robots/ or of a file, as engines see it: pairs that touch at the start are allowed.
struct CollidingRobot {
  std::shared_ptr<const Model> model;
  std::shared_ptr<const CollisionScene> scene;
};

inline RobotDescription load_robot(const std::string& target, const std::filesystem::path& robots,
                                   Diagnostics& diagnostics) {
  PackageResolver resolver;
  resolver.add_bundled(robots);
  const Target found = resolve_target(target, robots);
  resolver.add_context(found.description);
  return load_description(found.description, {}, resolver, diagnostics).robot;
}

inline CollidingRobot load_colliding(const std::string& target, const std::filesystem::path& robots) {
  Diagnostics diagnostics;
  const RobotDescription robot = load_robot(target, robots, diagnostics);
  CollidingRobot out;
  out.model = std::make_shared<const Model>(compile_model(robot, BaseKind::fixed, diagnostics));
  CollisionMeshes meshes;
  SceneInstance instance;
  instance.name = robot.name;
  instance.model = out.model;
  instance.shapes = link_shapes(robot, *out.model, MeshUse::hull, meshes, diagnostics);
  CollisionContext start(std::make_shared<const CollisionScene>(std::vector{instance}));
  SceneOptions options;
  for (const PairDistance& pair : start.contacts())
    options.allowed.push_back({pair.a, pair.b, "touching at the start"});
  out.scene = std::make_shared<const CollisionScene>(std::vector{std::move(instance)}, options);
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
