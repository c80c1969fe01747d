#include "doppel/validation/metrics/contact_speed.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace doppel {
namespace {

TEST(ContactSpeed, TwoMassesGiveSpeedByEnergy) {
  // 1 / (1/4 + 1/12) = 3 kg; 150 N, 75 kN/m: v = 150 / sqrt(225000).
  EXPECT_NEAR(max_contact_speed({150, 75000, 4}, 12).value(), 150 / std::sqrt(225000.0), 1e-12);
  const double v = max_contact_speed({280, 50000, 40}, 2.5).value(), mass = reduced_mass(40, 2.5).value();
  EXPECT_NEAR(0.5 * mass * v * v, 280.0 * 280.0 / (2 * 50000.0), 1e-12);
}

TEST(ContactSpeed, HeavyRobotGivesMassOfBodyRegion) {
  EXPECT_EQ(reduced_mass(4, std::numeric_limits<double>::infinity()).value(), 4);
  EXPECT_NEAR(max_contact_speed({100, 2500, 4}, 1e12).value(), 1, 1e-9);
}

TEST(ContactSpeed, ValuesThatAreNotPositiveGiveNone) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(max_contact_speed({0, 1, 1}, 1));
  EXPECT_FALSE(max_contact_speed({1, 0, 1}, 1));
  EXPECT_FALSE(max_contact_speed({1, 1, -1}, 1));
  EXPECT_FALSE(max_contact_speed({1, 1, 1}, nan));
  EXPECT_FALSE(max_contact_speed({nan, 1, 1}, 1));
}

}  // namespace
}  // namespace doppel
