// The errors of servos beside their closed forms.
#include "doppel/validation/extras/detail/servo_errors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "doppel/validation/metrics/pose_accuracy.h"

namespace doppel {
namespace {

using testing::HasSubstr;

Eigen::VectorXd one(double value) {
  return Eigen::VectorXd::Constant(1, value);
}

DrivePrecision drive(double resolution, double backlash, double noise) {
  return {"X", resolution, backlash, noise};
}

TEST(ServoErrors, JointRestsAnywhereWithinStep) {
  constexpr double kStep = 0.01;
  constexpr int kRuns = 20'000;
  ServoErrors errors({drive(kStep, 0, 0)}, 1);
  double sum = 0, squares = 0, least = 1, most = -1;
  for (int run = 0; run < kRuns; ++run) {
    errors.begin(static_cast<std::uint64_t>(run));
    const double error = errors.apply(one(0.7))[0] - 0.7;
    sum += error;
    squares += error * error;
    least = std::min(least, error);
    most = std::max(most, error);
  }
  EXPECT_NEAR(sum / kRuns, 0, 0.01 * kStep);
  EXPECT_NEAR(std::sqrt(squares / kRuns), kStep / std::sqrt(12), 0.01 * kStep);
  EXPECT_NEAR(least, -kStep / 2, 1e-3 * kStep);
  EXPECT_NEAR(most, kStep / 2, 1e-3 * kStep);
}

// With an error u that is uniform in +-h, |u - mean| has the mean h/2 and the deviation h/sqrt(12).
TEST(ServoErrors, RepeatabilityOfLeverIsThatOfUniformError) {
  constexpr double kStep = 2e-3, kLever = 0.4, kHalf = kLever * kStep / 2;
  ServoErrors errors({drive(kStep, 0, 0)}, 3);
  std::vector<MeasuredPose> attained;
  for (int run = 0; run < 5000; ++run) {
    errors.begin(static_cast<std::uint64_t>(run));
    const double angle = errors.apply(one(0))[0];
    attained.push_back({{kLever * std::cos(angle), kLever * std::sin(angle), 0}, Eigen::Vector3d::Zero()});
  }
  const auto figures = pose_figures(attained, {{kLever, 0, 0}, Eigen::Vector3d::Zero()});
  ASSERT_TRUE(figures);
  const double expected = kHalf / 2 + 3 * kHalf / std::sqrt(12);
  EXPECT_NEAR(figures->repeatability, expected, 0.03 * expected);
}

TEST(ServoErrors, NoiseHasItsDeviation) {
  constexpr int kRuns = 20'000;
  ServoErrors errors({drive(0, 0, 0.002)}, 1);
  double squares = 0;
  for (int run = 0; run < kRuns; ++run) {
    errors.begin(static_cast<std::uint64_t>(run));
    squares += std::pow(errors.apply(one(0.3))[0] - 0.3, 2);
  }
  EXPECT_NEAR(std::sqrt(squares / kRuns), 0.002, 0.03 * 0.002);
}

TEST(ServoErrors, PlayLiesOnLoadedSideElseBehindMotion) {
  constexpr double kPlay = 0.02;
  ServoErrors errors({drive(0, kPlay, 0)}, 1);
  const auto place = [&](double u, double load) {
    errors.follow(one(u), one(load), one(0.1));
    return errors.apply(one(u))[0] - u;
  };
  EXPECT_DOUBLE_EQ(place(0, 0), 0);
  // Without a load the joint stays until the drive has taken up the play, and then follows behind it.
  EXPECT_NEAR(place(0.004, 0), -0.004, 1e-15);
  EXPECT_NEAR(place(0.5, 0.05), -kPlay / 2, 1e-15);
  EXPECT_NEAR(place(0.485, 0), 0.005, 1e-15);
  EXPECT_NEAR(place(0, 0), kPlay / 2, 1e-15);
  // A load above the friction pulls it to its side, whatever the motion.
  EXPECT_NEAR(place(0.5, 1), -kPlay / 2, 1e-15);
  EXPECT_NEAR(place(0.4, -1), kPlay / 2, 1e-15);
}

TEST(ServoErrors, WithoutSheetNothingChanges) {
  ServoErrors errors({DrivePrecision{}, DrivePrecision{}}, 1);
  EXPECT_FALSE(errors.any());
  const Eigen::VectorXd u = Eigen::Vector2d(0.3, -2);
  errors.begin(7);
  errors.follow(u, Eigen::Vector2d(1, 1), Eigen::Vector2d(0, 0));
  EXPECT_EQ(errors.apply(u), u);
  EXPECT_EQ(errors.text(), "");
}

TEST(ServoErrors, RunsDifferAndRepeatBySeed) {
  ServoErrors a({drive(0.01, 0, 0.001)}, 5), b({drive(0.01, 0, 0.001)}, 5), c({drive(0.01, 0, 0.001)}, 6);
  const auto angle_of = [](ServoErrors& errors, std::uint64_t run) {
    errors.begin(run);
    return errors.apply(one(0.1))[0];
  };
  EXPECT_EQ(angle_of(a, 3), angle_of(b, 3));
  EXPECT_NE(angle_of(a, 3), angle_of(a, 4));
  EXPECT_NE(angle_of(a, 3), angle_of(c, 3));
  EXPECT_THAT(a.text(), HasSubstr("X (resolution 0.573 deg, noise 0.0573 deg)"));
}

}  // namespace
}  // namespace doppel
