#include "doppel/validation/metrics/pose_accuracy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

namespace doppel {
namespace {

using Eigen::Vector3d;
constexpr double kExact = 1e-12;

void expect_vector(const Vector3d& value, const Vector3d& theory, double tolerance = kExact) {
  EXPECT_LE((value - theory).cwiseAbs().maxCoeff(), tolerance) << value.transpose();
}

TEST(PoseAccuracy, FourPosesOnSquareGiveHandComputedFigures) {
  // The mean is (1, 2, 3), all distances are 0.5, S(l) = 0; S(a) = sqrt((1 + 1 + 1 + 1) / 3) * 0.01.
  const std::vector<MeasuredPose> attained{{{1.5, 2, 3}, {0.11, 0.2, 0}},
                                           {{0.5, 2, 3}, {0.09, 0.2, 0}},
                                           {{1, 2.5, 3}, {0.11, 0.2, 0}},
                                           {{1, 1.5, 3}, {0.09, 0.2, 0}}};
  const auto figures = pose_figures(attained, {{1.03, 1.96, 3.12}, {0.1, 0.15, 0}});
  ASSERT_TRUE(figures);
  EXPECT_NEAR(figures->accuracy, 0.13, kExact);  // 3, 4, 12: 13
  expect_vector(figures->axis_accuracy, {-0.03, 0.04, -0.12});
  expect_vector(figures->angle_accuracy, {0, 0.05, 0});
  EXPECT_NEAR(figures->repeatability, 0.5, kExact);
  expect_vector(figures->angle_repeatability, {0.03 * std::sqrt(4.0 / 3.0), 0, 0});
}

TEST(PoseAccuracy, ThirtyPosesOnLineGiveHandComputedFigures) {
  // x = -14.5, -13.5 ... 14.5 mm: l has each of 0.5 ... 14.5 twice, mean 7.5, squares 2 * 15 * (15^2 - 1) /
  // 12.
  std::vector<MeasuredPose> attained;
  for (int j = 0; j < 30; ++j) attained.push_back({{(j - 14.5) * 1e-3, 0, 0}, Vector3d::Zero()});
  const auto figures = pose_figures(attained, {{0, 2e-3, 0}, Vector3d::Zero()});
  ASSERT_TRUE(figures);
  EXPECT_NEAR(figures->accuracy, 2e-3, kExact);
  EXPECT_NEAR(figures->repeatability, 7.5e-3 + 3e-3 * std::sqrt(560.0 / 29.0), kExact);
}

TEST(PoseAccuracy, AnglesAcrossHalfTurnGiveSmallDifferences) {
  const double pi = std::numbers::pi;
  const std::vector<MeasuredPose> attained{{{0, 0, 0}, {pi - 0.01, 0, 0}}, {{0, 0, 0}, {-pi + 0.03, 0, 0}}};
  const auto figures = pose_figures(attained, {{0, 0, 0}, {pi, 0, 0}});
  ASSERT_TRUE(figures);
  expect_vector(figures->angle_accuracy, {0.01, 0, 0});
  expect_vector(figures->angle_repeatability, {3 * 0.02 * std::sqrt(2.0), 0, 0});
}

TEST(PoseAccuracy, EqualPosesGiveNoSpread) {
  const std::vector<MeasuredPose> attained(30, {{0.25, 0.5, 0.75}, {0.5, 0.25, 0.125}});
  const auto figures = pose_figures(attained, attained.front());
  ASSERT_TRUE(figures);
  EXPECT_EQ(figures->accuracy, 0);
  EXPECT_EQ(figures->repeatability, 0);
  EXPECT_TRUE(figures->angle_repeatability.isZero());
}

TEST(PoseAccuracy, ShiftedAndTurnedCloudGivesSameRepeatability) {
  constexpr unsigned kSeed = 9283;
  std::mt19937 random(kSeed);
  std::normal_distribution<double> normal(0, 1e-3);
  std::uniform_real_distribution<double> place(-1, 1);
  for (int run = 0; run < 30; ++run) {
    SCOPED_TRACE(testing::Message() << "seed " << kSeed << ", run " << run);
    const Vector3d shift(place(random), place(random), place(random));
    std::vector<MeasuredPose> cloud, turned;
    for (int j = 0; j < 30; ++j) {
      cloud.push_back({{normal(random), normal(random), normal(random)}, Vector3d::Zero()});
      const Vector3d& p = cloud.back().position;
      turned.push_back({Vector3d(-p.y(), p.x(), p.z()) + shift, Vector3d::Zero()});
    }
    const auto a = pose_figures(cloud, {}), b = pose_figures(turned, {shift, Vector3d::Zero()});
    ASSERT_TRUE(a && b);
    EXPECT_NEAR(a->repeatability, b->repeatability, kExact);
    EXPECT_NEAR(a->accuracy, b->accuracy, kExact);
  }
}

TEST(PoseAccuracy, BadCloudGivesNone) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(pose_figures({}, {}));
  EXPECT_FALSE(pose_figures(std::vector<MeasuredPose>(1), {}));
  std::vector<MeasuredPose> cloud(3);
  cloud[1].angles.y() = nan;
  EXPECT_FALSE(pose_figures(cloud, {}));
  EXPECT_FALSE(pose_figures(std::vector<MeasuredPose>(3), {{0, nan, 0}, Vector3d::Zero()}));
}

TEST(DirectionVariation, ThreeDirectionsGiveLargestDistanceOfMeans) {
  std::vector<PoseFigures> directions(3);
  directions[0].mean = {{0, 0, 0}, {0.01, 0, 0}};
  directions[1].mean = {{3e-3, 0, 0}, {0, 0.02, 0}};
  directions[2].mean = {{0, 4e-3, 0}, {-0.02, 0, 0}};
  const auto figures = direction_figures(directions);
  ASSERT_TRUE(figures);
  EXPECT_NEAR(figures->position, 5e-3, kExact);
  expect_vector(figures->angles, {0.03, 0.02, 0});
  EXPECT_FALSE(direction_figures(std::span(directions).first(1)));
}

TEST(DistanceAccuracy, ThreeCyclesGiveHandComputedFigures) {
  // D = 0.5, 0.5, 0.53 along (3, 4, 0) / 5: the mean is 0.51, S = sqrt((1 + 1 + 4) / 2) * 0.01.
  const std::vector<MeasuredPose> first(3);
  const std::vector<MeasuredPose> second{
      {{0.3, 0.4, 0}, {0.1, 0, 0}}, {{0.3, 0.4, 0}, {0.1, 0, 0}}, {{0.318, 0.424, 0}, {0.13, 0, 0}}};
  const auto figures = distance_figures(first, second, {}, {{0.3, 0.4, 0}, {0.1, 0, 0}});
  ASSERT_TRUE(figures);
  EXPECT_NEAR(figures->accuracy, 0.01, kExact);
  expect_vector(figures->axis_accuracy, {0.006, 0.008, 0});
  expect_vector(figures->angle_accuracy, {0.01, 0, 0});
  EXPECT_NEAR(figures->repeatability, 0.03 * std::sqrt(3.0), kExact);
  expect_vector(figures->axis_repeatability, {0.018 * std::sqrt(3.0), 0.024 * std::sqrt(3.0), 0});
  expect_vector(figures->angle_repeatability, {0.03 * std::sqrt(3.0), 0, 0});
  EXPECT_FALSE(distance_figures(first, std::span(second).first(2), {}, {}));
}

TEST(Drift, FiguresOverTimeGiveLargestChangeSinceFirst) {
  std::vector<PoseFigures> over_time(3);
  over_time[0].accuracy = 1e-3;
  over_time[1].accuracy = 1.4e-3;
  over_time[2].accuracy = 0.7e-3;
  over_time[2].repeatability = 2e-4;
  over_time[1].angle_accuracy.z() = -0.01;
  const auto figures = drift_figures(over_time);
  ASSERT_TRUE(figures);
  EXPECT_NEAR(figures->accuracy, 4e-4, kExact);
  EXPECT_NEAR(figures->repeatability, 2e-4, kExact);
  expect_vector(figures->angle_accuracy, {0, 0, 0.01});
  EXPECT_FALSE(drift_figures({}));
}

TEST(Approach, OvershootGivesStabilisationAndDistance) {
  const std::vector<double> time{0, 1, 2, 3, 4};
  const std::vector<Vector3d> positions{{-5, 0, 0}, {-1, 0, 0}, {3, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  const auto figures = approach_figures(time, positions, Vector3d::Zero(), 2);
  ASSERT_TRUE(figures);
  EXPECT_TRUE(figures->reached);
  EXPECT_TRUE(figures->stays);
  EXPECT_NEAR(figures->first_inside, 0.75, kExact);
  EXPECT_NEAR(figures->inside_for_good, 2 + 1.0 / 3, kExact);
  EXPECT_NEAR(figures->stabilisation, 2 + 1.0 / 3 - 0.75, kExact);
  EXPECT_EQ(figures->overshoot, 3);
}

TEST(Approach, MonotoneApproachHasNoOvershoot) {
  const std::vector<double> time{0, 1, 2};
  const std::vector<Vector3d> positions{{2, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  const auto figures = approach_figures(time, positions, Vector3d::Zero(), 0.5);
  ASSERT_TRUE(figures);
  EXPECT_NEAR(figures->first_inside, 0.75, kExact);
  EXPECT_EQ(figures->stabilisation, 0);
  EXPECT_EQ(figures->overshoot, 0);
}

TEST(Approach, DistantPathIsNotReached) {
  const std::vector<double> time{0, 1};
  const std::vector<Vector3d> positions{{2, 0, 0}, {1, 0, 0}};
  const auto figures = approach_figures(time, positions, Vector3d::Zero(), 0.5);
  ASSERT_TRUE(figures);
  EXPECT_FALSE(figures->reached);
  EXPECT_FALSE(figures->stays);
  EXPECT_FALSE(approach_figures(time, positions, Vector3d::Zero(), 0));
  EXPECT_FALSE(approach_figures({}, {}, Vector3d::Zero(), 1));
}

}  // namespace
}  // namespace doppel
