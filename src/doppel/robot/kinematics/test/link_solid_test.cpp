// The solids of shapes against closed forms.
#include "doppel/robot/kinematics/link_solid.h"

#include <gtest/gtest.h>

#include <numbers>

namespace doppel {
namespace {

constexpr double kPi = std::numbers::pi;

TEST(ShapeSolid, ConeHasCentreOfMassInLowerQuarter) {
  const MassProperties cone = shape_solid(Cone{0.3, 0.8}, 500);
  const double mass = 500 * kPi * 0.09 * 0.8 / 3;
  EXPECT_NEAR(cone.mass, mass, 1e-9);
  EXPECT_NEAR(cone.com.z(), -0.2, 1e-12);
  EXPECT_NEAR(cone.I(2, 2), 0.3 * mass * 0.09, 1e-9);
  EXPECT_NEAR(cone.I(0, 0), mass * (3.0 / 20 * 0.09 + 3.0 / 80 * 0.64), 1e-9);
}

TEST(ShapeSolid, EllipsoidOfEqualRadiiIsBall) {
  const MassProperties ball = shape_solid(Ellipsoid{{0.2, 0.2, 0.2}}, 1000),
                       same = shape_solid(Sphere{0.2}, 1000);
  EXPECT_NEAR(ball.mass, same.mass, 1e-9);
  EXPECT_TRUE(ball.I.isApprox(same.I, 1e-12));
}

TEST(ShapeSolid, ExtrusionOfRectangleIsBox) {
  const MassProperties prism = shape_solid(Extrusion{{{0, 0}, {1, 0}, {1, 2}, {0, 2}}, 3}, 100);
  EXPECT_NEAR(prism.mass, 600, 1e-3);
  EXPECT_TRUE(prism.com.isApprox(Eigen::Vector3d(0.5, 1, 1.5), 1e-6));
  EXPECT_NEAR(prism.I(0, 0), 600.0 / 12 * (4 + 9), 1e-2);
}

TEST(ShapeSolid, PlaneEnclosesNothing) {
  EXPECT_EQ(shape_solid(Plane{}, 1000).mass, 0);
}

}  // namespace
}  // namespace doppel
