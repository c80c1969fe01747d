// Fits against wheels whose radii and track are known, and edits of controllers' files.

#include <gmock/gmock.h>

#include <cmath>
#include <iostream>
#include <random>

#include "doppel/lab/base_report/base_report.h"

namespace doppel {
namespace {

using ::testing::HasSubstr;

constexpr double kSeparation = 0.4;  // m, of the controller

// A leg of a base that rolls without slip with these wheels, each way a straight in time.
BaseLeg leg(BaseLeg::Kind kind, bool left_side, double left, double right, const BaseMultipliers& true_ones) {
  BaseLeg out;
  out.kind = kind;
  out.left = left_side;
  for (int i = 1; i <= 200; ++i) out.rolled.push_back({left * i / 200, right * i / 200});
  out.truth = integrate_odometry(out.rolled, kSeparation, true_ones);
  return out;
}

TEST(BaseFit, FindsMultipliersOfUnequalWheels) {
  for (unsigned seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> radius(0.97, 1.03), separation(0.8, 2.5);
    const BaseMultipliers wanted{separation(random), radius(random), radius(random)};
    const double turn = 10 * kSeparation;
    const std::vector<BaseLeg> legs{leg(BaseLeg::Kind::straight, true, 5, 5, wanted),
                                    leg(BaseLeg::Kind::turn, true, -turn, turn, wanted),
                                    leg(BaseLeg::Kind::turn, false, turn, -turn, wanted)};
    const BaseMultipliers found = fit_multipliers(legs, kSeparation);
    EXPECT_NEAR(found.separation, wanted.separation, 1e-6);
    EXPECT_NEAR(found.left_radius, wanted.left_radius, 1e-6);
    EXPECT_NEAR(found.right_radius, wanted.right_radius, 1e-6);
  }
}

TEST(BaseFit, OdometryOfFullCircleEndsAtItsStart) {
  std::vector<std::array<double, 2>> rolled;
  const double inner = 2 * M_PI * (1 - kSeparation / 2), outer = 2 * M_PI * (1 + kSeparation / 2);
  for (int i = 1; i <= 50; ++i) rolled.push_back({inner * i / 50, outer * i / 50});
  const PlanarPose end = integrate_odometry(rolled, kSeparation, {});
  EXPECT_NEAR(std::hypot(end.x, end.y), 0, 1e-12);
  EXPECT_NEAR(end.heading, 2 * M_PI, 1e-12);
}

constexpr const char* kFile = R"(# my rover
base:
  ros__parameters:
    left_wheel_names: [left]
    wheel_separation: 0.44       # m
    wheel_separation_multiplier: 1.0   # scrub
    wheel_radius: 0.1
)";

TEST(ControllersEdit, NumbersChangeAndAllElseStays) {
  const std::string out = with_multipliers(kFile, "c.yaml", "base", {1.2345, 1.0, 0.99});
  EXPECT_EQ(out, R"(# my rover
base:
  ros__parameters:
    left_wheel_names: [left]
    wheel_separation: 0.44       # m
    right_wheel_radius_multiplier: 0.9900
    left_wheel_radius_multiplier: 1.0000
    wheel_separation_multiplier: 1.2345   # scrub
    wheel_radius: 0.1
)");
  EXPECT_EQ(with_multipliers(out, "c.yaml", "base", {1.2345, 1.0, 0.99}), out);
}

TEST(ControllersEdit, FlowStyleStays) {
  const std::string text =
      "base: {ros__parameters: {wheel_separation: 0.44, wheel_separation_multiplier: 1.0}}\n";
  EXPECT_EQ(with_multipliers(text, "c.yaml", "base", {1.2, 1, 1}),
            "base: {ros__parameters: {wheel_separation: 0.44, right_wheel_radius_multiplier: 1.0000, "
            "left_wheel_radius_multiplier: 1.0000, wheel_separation_multiplier: 1.2000}}\n");
}

TEST(ControllersEdit, TextInPlaceOfNumbersIsRefusedWithItsPlace) {
  const std::string text =
      "base: {ros__parameters: {wheel_separation: 0.44, wheel_separation_multiplier: \"1.0\"}}\n";
  try {
    with_multipliers(text, "c.yaml", "base", {1.2, 1, 1});
    FAIL() << "expected an error";
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr("c.yaml:1:"));
    EXPECT_THAT(e.what(), HasSubstr("write wheel_separation_multiplier: 1.2000 yourself"));
  }
}

TEST(ControllersEdit, AnotherControllerIsRefused) {
  EXPECT_THROW(with_multipliers(kFile, "c.yaml", "other", {}), InputError);
}

}  // namespace
}  // namespace doppel
