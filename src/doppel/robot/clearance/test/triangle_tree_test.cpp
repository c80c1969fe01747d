#include "doppel/robot/clearance/detail/triangle_tree.h"

#include <gtest/gtest.h>

#include <random>

namespace doppel {
namespace {

using Eigen::Vector3d;

constexpr unsigned kTriangleSeed = 11;

class RandomTriangles {
 public:
  Vector3d point(double size) {
    std::uniform_real_distribution<double> number(-size, size);
    const double x = number(random_), y = number(random_);
    return {x, y, number(random_)};
  }
  Triangle3 triangle(double size) {
    const Vector3d place = point(1);
    const Vector3d a = place + point(size), b = place + point(size);
    return {a, b, place + point(size)};
  }

 private:
  std::mt19937_64 random_{kTriangleSeed};
};

// Points of both on a fine grid.
double sampled_distance(const Triangle3& s, const Triangle3& t) {
  constexpr int kSteps = 40;
  double nearest = 1e9;
  for (int i = 0; i <= kSteps; ++i) {
    for (int k = 0; k + i <= kSteps; ++k) {
      const Vector3d p = s.a + (s.b - s.a) * i / kSteps + (s.c - s.a) * k / kSteps;
      nearest = std::min(nearest, (nearest_point(t, p) - p).norm());
    }
  }
  return nearest;
}

TEST(TriangleDistance, RandomTrianglesAreAsFarApartAsTheirPoints) {
  SCOPED_TRACE("seed 11");
  RandomTriangles random;
  for (int i = 0; i < 300; ++i) {
    const Triangle3 s = random.triangle(0.5), t = random.triangle(0.5);
    const double found = triangle_distance(s, t), sampled = sampled_distance(s, t);
    ASSERT_LE(found, sampled + 1e-12) << i;
    ASSERT_GE(found, sampled - 0.04) << i;
    ASSERT_NEAR(found, triangle_distance(t, s), 1e-12) << i;
  }
}

TEST(TriangleDistance, PointsSegmentsAndCrossingsAreExact) {
  const Triangle3 floor{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const Vector3d above(0.2, 0.2, 0.5);
  EXPECT_NEAR(triangle_distance(floor, {above, above, above}), 0.5, 1e-15);
  EXPECT_NEAR(triangle_distance(floor, {above, above + Vector3d(3, 0, 0), above}), 0.5, 1e-15);
  EXPECT_EQ(triangle_distance(floor, {above, {0.2, 0.2, -0.5}, {0.3, 0.2, 0.5}}), 0);
  EXPECT_NEAR(triangle_distance(floor, {{2, 0, 0}, {3, 0, 0}, {3, 1, 0}}), 1, 1e-15);
  EXPECT_NEAR(triangle_distance(floor, floor), 0, 1e-15);
}

TEST(TriangleTree, DistanceIsThatOfAllPairs) {
  SCOPED_TRACE("seed 11");
  RandomTriangles random;
  for (int round = 0; round < 20; ++round) {
    std::vector<Triangle3> first, second;
    for (int i = 0; i < 60; ++i) first.push_back(random.triangle(0.2));
    for (int i = 0; i < 50; ++i) second.push_back(random.triangle(0.2));
    Pose X = Pose::Identity();
    X.linear() = Eigen::AngleAxisd(round, random.point(1).normalized()).toRotationMatrix();
    X.translation() = random.point(1).normalized() * (1.5 + 0.1 * round);
    double nearest = 1e9;
    for (const Triangle3& s : first) {
      for (const Triangle3& t : second)
        nearest = std::min(nearest, triangle_distance(s, {X * t.a, X * t.b, X * t.c}));
    }
    const TriangleTree a(first), b(second);
    EXPECT_NEAR(a.distance(b, X), nearest, 1e-12);
    EXPECT_NEAR(b.distance(a, X.inverse()), nearest, 1e-12);
    EXPECT_EQ(a.distance(b, X, nearest / 2), nearest / 2) << "nothing is nearer";
  }
}

}  // namespace
}  // namespace doppel
