// Distances of convex solids: by their certificate (a pair of points and a plane between the solids, whose
// distances are equal), by closed forms, and with the wrong side of every bound.
#include "doppel/robot/collision/detail/convex.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "doppel/description/meshes/heightmap.h"
#include "doppel/robot/collision/collision_scene.h"
#include "doppel/robot/collision/detail/field_distance.h"

namespace doppel {
namespace {

using Eigen::Vector3d;

class Dice {
 public:
  explicit Dice(unsigned seed) : generator_(seed) {}
  double in(double low, double high) { return std::uniform_real_distribution(low, high)(generator_); }
  Vector3d vector(double reach) { return {in(-reach, reach), in(-reach, reach), in(-reach, reach)}; }
  Pose pose(double reach) { return make_pose(vector(reach), vector(std::numbers::pi)); }
  ConvexShape shape(int kind) {
    switch (kind) {
      case 0:
        return Box{{in(0.01, 0.3), in(0.01, 0.3), in(0.01, 0.3)}};
      case 1:
        return Cylinder{in(0.01, 0.2), in(0.01, 0.4)};
      case 2:
        return Capsule{in(0.01, 0.1), in(0.0, 0.4)};
      case 3:
        return Sphere{in(0.01, 0.2)};
      case 4:
        return Ellipsoid{{in(0.02, 0.2), in(0.02, 0.2), in(0.02, 0.2)}};
      default:
        break;
    }
    ConvexPoints points;
    points.vertices.resize(3, 30);
    for (int i = 0; i < 30; ++i) points.vertices.col(i) = vector(0.15);
    return points;
  }

 private:
  std::mt19937 generator_;
};

// h(n): the furthest that a solid reaches along n, a unit vector in its frame.
double reach(const ConvexSolid& solid, const Vector3d& n) {
  return solid.support(n).dot(n) + solid.rounding;
}

TEST(ConvexDistanceTest, EveryPairOfKindsHasCertificate) {
  SCOPED_TRACE("seed 51");
  Dice dice(51);
  ConvexWorkspace memory;
  int apart = 0;
  for (int trial = 0; trial < 36000; ++trial) {
    const ConvexSolid a(dice.shape(trial % 6)), b(dice.shape(trial / 6 % 6));
    const Pose X_AB = dice.pose(0.5);
    const ConvexDistance found = convex_distance(a, b, X_AB, kFarAway, memory);
    const Vector3d n = found.normal_A, n_B = X_AB.linear().transpose() * n;
    ASSERT_NEAR(n.norm(), 1, 1e-9);
    ASSERT_LE((found.p_B - found.p_A - found.distance * n).norm(), 1e-9) << "trial " << trial;
    // The plane between them: no pair of points is nearer.
    const double plane = (X_AB.translation().dot(n) - reach(b, -n_B)) - reach(a, n);
    ASSERT_NEAR(plane, found.distance, 1e-7) << "trial " << trial;
    // The points are on the solids: in no direction further than they reach.
    const Vector3d p_B = X_AB.inverse() * found.p_B;
    for (int i = 0; i < 20; ++i) {
      const Vector3d d = dice.vector(1).normalized();
      ASSERT_LE(found.p_A.dot(d), reach(a, d) + 1e-7) << "trial " << trial;
      ASSERT_LE(p_B.dot(d), reach(b, d) + 1e-7) << "trial " << trial;
    }
    apart += found.distance > 0 ? 1 : 0;
  }
  EXPECT_GT(apart, 12000);
  EXPECT_LT(apart, 34000);
}

TEST(ConvexDistanceTest, CloserAgreesWithDistanceAndFarGivesLowerBound) {
  SCOPED_TRACE("seed 52");
  Dice dice(52);
  ConvexWorkspace memory;
  for (int trial = 0; trial < 18000; ++trial) {
    const ConvexSolid a(dice.shape(trial % 6)), b(dice.shape(trial / 6 % 6));
    const Pose X_AB = dice.pose(0.4);
    const double distance = convex_distance(a, b, X_AB, kFarAway, memory).distance;
    const double limit = dice.in(-0.05, 0.2);
    if (std::abs(distance - limit) > 1e-6) {
      ASSERT_EQ(convex_closer(a, b, X_AB, limit, memory), distance < limit) << "trial " << trial;
    }
    const double bounded = convex_distance(a, b, X_AB, limit, memory).distance;
    ASSERT_LE(bounded, distance + 1e-7) << "trial " << trial;
    if (distance < limit) {
      ASSERT_NEAR(bounded, distance, 1e-7) << "trial " << trial;
    } else {
      ASSERT_GE(bounded, std::min(limit, distance) - 1e-7) << "trial " << trial;
    }
  }
}

TEST(ConvexDistanceTest, SeparatingDirectionIsFoundExactlyWhereSolidsAreApart) {
  SCOPED_TRACE("seed 53");
  Dice dice(53);
  ConvexWorkspace memory;
  for (int trial = 0; trial < 18000; ++trial) {
    const ConvexSolid a(dice.shape(trial % 6)), b(dice.shape(trial / 6 % 6));
    const Pose X_AB = dice.pose(0.4);
    const double distance = convex_distance(a, b, X_AB, kFarAway, memory).distance;
    if (std::abs(distance) < 1e-6) continue;
    const auto n = separating_direction(a, b, X_AB);
    ASSERT_EQ(n.has_value(), distance > 0) << "trial " << trial;
    if (!n) continue;
    ASSERT_NEAR(n->norm(), 1, 1e-12);
    const double gap = n->dot(X_AB.translation()) - reach(b, X_AB.linear().transpose() * -*n) - reach(a, *n);
    ASSERT_GT(gap, 0) << "trial " << trial;
    ASSERT_LE(gap, distance + 1e-7) << "trial " << trial;
  }
}

TEST(ConvexDistanceTest, CapsulesAgreeWithDistanceOfTheirAxes) {
  SCOPED_TRACE("seed 53");
  Dice dice(53);
  ConvexWorkspace memory;
  for (int trial = 0; trial < 2000; ++trial) {
    const Capsule a{dice.in(0.01, 0.1), dice.in(0.1, 0.5)}, b{dice.in(0.01, 0.1), dice.in(0.1, 0.5)};
    const Pose X_AB = dice.pose(0.4);
    // Alternating projections converge for two segments.
    const auto on_axis = [](const Vector3d& p, double length) {
      return Vector3d(0, 0, std::clamp(p.z(), -0.5 * length, 0.5 * length));
    };
    Vector3d p = Vector3d::Zero(), q = Vector3d::Zero();
    for (int i = 0; i < 20000; ++i) {
      q = X_AB * on_axis(X_AB.inverse() * p, b.length);
      const Vector3d next = on_axis(q, a.length);
      const bool still = (next - p).norm() < 1e-13;
      p = next;
      if (still) break;
    }
    const double distance = convex_distance(ConvexSolid(a), ConvexSolid(b), X_AB, kFarAway, memory).distance;
    ASSERT_NEAR(distance, (p - q).norm() - a.radius - b.radius, 1e-6) << "trial " << trial;
  }
}

// -- terrains

HeightField slope(double rise) {
  HeightField out;
  out.columns = 21;
  out.rows = 11;
  out.size = {4, 2};
  for (int r = 0; r < out.rows; ++r) {
    for (int c = 0; c < out.columns; ++c)
      out.heights.push_back(static_cast<float>(rise * out.size.x() * (c / 20.0 - 0.5)));
  }
  return out;
}

TEST(FieldDistanceTest, SphereAboveSlopeIsMeasuredToItsPlane) {
  SCOPED_TRACE("seed 54");
  Dice dice(54);
  FieldWorkspace cells;
  ConvexWorkspace memory;
  const double rise = 0.5;
  const HeightField field = slope(rise);
  const Vector3d normal = Vector3d(-rise, 0, 1).normalized();
  for (int trial = 0; trial < 500; ++trial) {
    const Sphere ball{dice.in(0.05, 0.2)};
    Pose X = Pose::Identity();
    X.translation() << dice.in(-0.9, 0.9), dice.in(-0.6, 0.6), dice.in(0.3, 0.8);
    const double expected = normal.dot(X.translation()) - ball.radius;
    if (expected < -0.05) continue;
    const ConvexDistance found = field_distance(field, ConvexSolid(ball), X, kFarAway, cells, memory);
    ASSERT_NEAR(found.distance, expected, 1e-6) << "trial " << trial;
    ASSERT_LE((found.normal_A - normal).norm(), 1e-3) << "trial " << trial;
    ASSERT_LE((found.p_B - found.p_A - found.distance * found.normal_A).norm(), 1e-9);
  }
}

TEST(FieldDistanceTest, BoxBesideTerrainIsMeasuredToItsSide) {
  FieldWorkspace cells;
  ConvexWorkspace memory;
  const HeightField field = slope(0);
  Pose X = Pose::Identity();
  X.translation() << 2.5, 0, -0.2;
  const ConvexSolid box(Box{{0.4, 0.4, 0.2}});
  EXPECT_NEAR(field_distance(field, box, X, kFarAway, cells, memory).distance, 0.3, 1e-7);
  EXPECT_GE(field_distance(field, box, X, 0.1, cells, memory).distance, 0.1);
}

}  // namespace
}  // namespace doppel
