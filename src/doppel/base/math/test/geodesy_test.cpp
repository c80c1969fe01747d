// WGS 84 coordinates against published points and an independent integration along the ellipsoid, and the standard
// atmosphere against its published table.
#include "doppel/base/math/geodesy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace doppel {
namespace {

constexpr double kDegree = std::numbers::pi / 180, kA = 6378137.0, kE2 = 6.69437999014e-3;

TEST(Geodesy, EarthFixedCoordinatesAreThoseOfPublishedPoints) {
  EXPECT_LT((to_earth_fixed({0, 0, 0}) - Eigen::Vector3d(kA, 0, 0)).norm(), 1e-6);
  EXPECT_LT((to_earth_fixed({90, 0, 0}) - Eigen::Vector3d(0, 0, 6356752.314245)).norm(), 1e-5);
  EXPECT_LT((to_earth_fixed({0, 90, 100}) - Eigen::Vector3d(0, kA + 100, 0)).norm(), 1e-6);
}

TEST(Geodesy, CoordinatesRoundTripFromPoleToPole) {
  const unsigned seed = 5;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> latitude(-90, 90), longitude(-180, 180), altitude(-5000, 50000);
  for (int i = 0; i < 1000; ++i) {
    const GeographicPoint point{i == 0 ? 90 : latitude(random), longitude(random), altitude(random)};
    const GeographicPoint back = from_earth_fixed(to_earth_fixed(point));
    EXPECT_NEAR(back.latitude, point.latitude, 1e-9) << "seed " << seed << " case " << i;
    EXPECT_NEAR(i > 0 ? back.longitude : point.longitude, point.longitude, 1e-9);  // a pole has none
    EXPECT_NEAR(back.altitude, point.altitude, 1e-4);
  }
}

// A metre north is that over the radius of curvature in the meridian, one east over that in the prime vertical.
TEST(Geodesy, SmallDisplacementsFollowRadiiOfCurvature) {
  EarthFrame earth;
  earth.origin = {47.5, 8.25, 430};
  const double s = std::sin(47.5 * kDegree), w = 1 - kE2 * s * s;
  const double meridian = kA * (1 - kE2) / std::pow(w, 1.5) + 430, vertical = kA / std::sqrt(w) + 430;
  const GeographicPoint north = geographic_point(earth, {0, 10, 0}),
                        east = geographic_point(earth, {10, 0, 0});
  EXPECT_NEAR(north.latitude - 47.5, 10 / meridian / kDegree, 1e-10);
  EXPECT_NEAR(north.longitude, 8.25, 1e-12);
  EXPECT_NEAR(east.longitude - 8.25, 10 / (vertical * std::cos(47.5 * kDegree)) / kDegree, 1e-10);
  EXPECT_NEAR(geographic_point(earth, {0, 0, 7}).altitude, 437, 1e-6);
}

TEST(Geodesy, HeadingTurnsWorldAxisFromEastToNorth) {
  EarthFrame earth;
  earth.heading = std::numbers::pi / 2;
  const GeographicPoint ahead = geographic_point(earth, {1000, 0, 0});
  EXPECT_GT(ahead.latitude, 0.009);
  EXPECT_NEAR(ahead.longitude, 0, 1e-12);
}

TEST(Geodesy, PressureIsThatOfStandardAtmosphere) {
  EXPECT_DOUBLE_EQ(standard_pressure(0), 101325);
  // U.S. Standard Atmosphere 1976, table I, by geometric altitude.
  EXPECT_NEAR(standard_pressure(1000), 89876.3, 1);
  EXPECT_NEAR(standard_pressure(5000), 54048.3, 1);
  // The hydrostatic equation at sea level: 1.225 kg/m^3.
  EXPECT_NEAR((standard_pressure(0.5) - standard_pressure(-0.5)) / 9.80665, -1.225, 1e-3);
}

}  // namespace
}  // namespace doppel
