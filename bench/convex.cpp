// The penetration depth of convex solids, by robot/collision/detail/convex.h and by FCL 0.7 (libccd's expanding
// polytope): the time for a pair and the largest error, compared with closed forms and, for hulls, with the
// nearest face of the hull of all differences of their corners (qhull).
//
//   bench_convex
#include "doppel/robot/collision/detail/convex.h"

#include <fcl/fcl.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <functional>
#include <numbers>
#include <random>

#include "doppel/description/meshes/convex_hull.h"

namespace {

using namespace doppel;
using Eigen::Vector3d;

struct Solid {
  ConvexSolid own;
  std::shared_ptr<fcl::CollisionGeometryd> others;
};
struct Pair {
  Solid a, b;
  Pose X_AB;
  double depth;  // m
};

double computed_us() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e6 + static_cast<double>(now.tv_nsec) * 1e-3;
}

double by_fcl(const Pair& pair) {
  fcl::CollisionRequestd request(50, true);
  request.gjk_tolerance = 1e-8;
  fcl::CollisionResultd result;
  fcl::collide(pair.a.others.get(), fcl::Transform3d::Identity(), pair.b.others.get(), pair.X_AB, request,
               result);
  double depth = 0;
  for (std::size_t i = 0; i < result.numContacts(); ++i)
    depth = std::max(depth, result.getContact(i).penetration_depth);
  return depth;
}

void measure(const char* what, const std::vector<Pair>& pairs) {
  const auto with = [&](const std::function<double(const Pair&)>& depth_of) {
    double took = 0, worst = 0;
    int wrong = 0;
    for (const Pair& pair : pairs) {
      const double begin = computed_us();
      const double depth = depth_of(pair);
      took += computed_us() - begin;
      worst = std::max(worst, std::abs(depth - pair.depth));
      if (std::abs(depth - pair.depth) > 1e-5) ++wrong;
    }
    return fmt::format("{:6.1f} us, worst {:.1e} m, {:3} off by more than 10 um",
                       took / static_cast<double>(pairs.size()), worst, wrong);
  };
  const auto own = [](const Pair& pair) {
    static ConvexWorkspace memory;
    return std::max(0.0, -convex_distance(pair.a.own, pair.b.own, pair.X_AB, 0.0, memory).distance);
  };
  fmt::print("{:<32} {:4}: doppel {}; FCL {}\n", what, pairs.size(), with(own), with(by_fcl));
}

Pose at(double x, double y, double z) {
  Pose X = Pose::Identity();
  X.translation() = Vector3d(x, y, z);
  return X;
}

Solid cube() {
  return {ConvexSolid(Box{Vector3d::Constant(0.1)}), std::make_shared<fcl::Boxd>(0.1, 0.1, 0.1)};
}
Solid cylinder(double radius) {
  return {ConvexSolid(Cylinder{radius, 0.1}), std::make_shared<fcl::Cylinderd>(radius, 0.1)};
}
Solid sphere(double radius) {
  return {ConvexSolid(Sphere{radius}), std::make_shared<fcl::Sphered>(radius)};
}

Solid hull(std::mt19937& random, int corners) {
  std::normal_distribution<double> number;
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < corners; ++i)
    points.push_back(
        (0.05 * Vector3d(number(random), number(random), number(random)).normalized()).cast<float>());
  ConvexPoints own;
  own.vertices.resize(3, corners);
  auto vertices = std::make_shared<std::vector<fcl::Vector3d>>();
  for (int i = 0; i < corners; ++i) {
    own.vertices.col(i) = points[static_cast<std::size_t>(i)].cast<double>();
    vertices->push_back(own.vertices.col(i));
  }
  const ConvexHull convex = convex_hull(points);
  auto faces = std::make_shared<std::vector<int>>();
  for (const auto& triangle : convex.triangles) {
    faces->push_back(3);
    for (const auto corner : triangle) faces->push_back(static_cast<int>(corner));
  }
  return {ConvexSolid(own),
          std::make_shared<fcl::Convexd>(vertices, static_cast<int>(convex.triangles.size()), faces)};
}

double depth_by_qhull(const Solid& a, const Solid& b, const Pose& X_AB) {
  const auto& of_a = std::get<ConvexPoints>(a.own.shape).vertices;
  const auto& of_b = std::get<ConvexPoints>(b.own.shape).vertices;
  std::vector<Eigen::Vector3f> differences;
  for (const auto& p : of_a.colwise()) {
    for (const auto& q : of_b.colwise()) differences.push_back((p - X_AB * Vector3d(q)).cast<float>());
  }
  double depth = 1;
  for (const auto& [i, j, k] : convex_hull(differences).triangles) {
    const Vector3d p = differences[i].cast<double>();
    const Vector3d n = (differences[j].cast<double>() - p).cross(differences[k].cast<double>() - p);
    if (n.norm() > 1e-12) depth = std::min(depth, n.normalized().dot(p));
  }
  return std::max(depth, 0.0);
}

}  // namespace

int main() {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> part;
  std::vector<Pair> spheres, cubes, turned, coaxial, hulls;
  for (int i = 0; i < 300; ++i) {
    const double depth = 1e-4 + 0.01 * part(random);
    spheres.push_back({sphere(0.05), sphere(0.07), at(0, 0, 0.12 - depth), depth});
    cubes.push_back({cube(), cube(), at(0.1 - depth, 0, 0), depth});
    Pose X = at(0, 0, 0.1 - depth);
    X.linear() = Eigen::AngleAxisd(std::numbers::pi * part(random), Vector3d::UnitZ()).toRotationMatrix();
    turned.push_back({cube(), cube(), X, depth});
    coaxial.push_back({cylinder(0.05), cylinder(0.03), at(0, 0, 0.1 - depth), depth});
  }
  for (int i = 0; i < 200; ++i) {
    const Solid a = hull(random, 40), b = hull(random, 40);
    const Pose X = at(0.09 * part(random), 0.02 * part(random), 0.02 * part(random));
    hulls.push_back({a, b, X, depth_by_qhull(a, b, X)});
  }
  measure("spheres", spheres);
  measure("cubes face to face", cubes);
  measure("cubes turned about the normal", turned);
  measure("coaxial cylinders", coaxial);
  measure("hulls of 40 corners", hulls);
}
