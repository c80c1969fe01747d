#include "doppel/validation/metrics/path_accuracy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

namespace doppel {
namespace {

using Eigen::Vector3d;

MeasuredPath circle_path(double radius, int points, double begin, double end) {
  MeasuredPath out;
  for (int i = 0; i < points; ++i) {
    const double angle = begin + (end - begin) * i / (points - 1);
    out.push_back({{radius * std::cos(angle), radius * std::sin(angle), 0.1}, {0, 0, 0}});
  }
  return out;
}

TEST(NormalPlanes, WiderCircleGivesPointsAtSameAngles) {
  const double turn = 2 * std::numbers::pi;
  const MeasuredPath commanded = circle_path(0.1, 73, 0, turn);
  // 0.1 mm wider, other sampling, with a lead-in and a lead-out.
  const auto met = at_normal_planes(circle_path(0.1001, 9001, -0.05, turn + 0.05), commanded);
  ASSERT_TRUE(met);
  ASSERT_EQ(met->size(), commanded.size());
  // The normals at both ends are those of a chord.
  for (std::size_t i = 1; i + 1 < met->size(); ++i)
    EXPECT_LE(((*met)[i].position - commanded[i].position).norm(), 1.001e-4) << i;
}

TEST(NormalPlanes, LateAndShortPathGivesItsEnds) {
  const MeasuredPath commanded{{{0, 0, 0}, {0, 0, 0}}, {{1, 0, 0}, {0, 0, 0}}, {{2, 0, 0}, {0, 0, 0}}};
  const MeasuredPath attained{{{0.2, 0.1, 0}, {0, 0, 0}}, {{1.8, 0.1, 0}, {0, 0, 0.16}}};
  const auto met = at_normal_planes(attained, commanded);
  ASSERT_TRUE(met);
  EXPECT_NEAR((*met)[0].position.x(), 0.2, 1e-12);
  EXPECT_NEAR((*met)[1].position.x(), 1, 1e-12);
  EXPECT_NEAR((*met)[1].angles.z(), 0.08, 1e-12);
  EXPECT_NEAR((*met)[2].position.x(), 1.8, 1e-12);
}

TEST(NormalPlanes, BadPathsGiveNone) {
  const MeasuredPath line{{{0, 0, 0}, {0, 0, 0}}, {{1, 0, 0}, {0, 0, 0}}};
  EXPECT_FALSE(at_normal_planes({}, line));
  EXPECT_FALSE(at_normal_planes(line, std::span(line).first(1)));
  EXPECT_FALSE(at_normal_planes(line, MeasuredPath(2)));  // no direction
}

TEST(PathAccuracy, TwoCyclesGiveHandComputedFigures) {
  const MeasuredPath commanded{{{0, 0, 0}, {0, 0, 0}}, {{1, 0, 0}, {0, 0, 0}}};
  const std::vector<MeasuredPath> cycles{{{{0, 1e-3, 0}, {0, 0, 0}}, {{1, 0, 5e-3}, {0.01, 0, 0}}},
                                         {{{0, 3e-3, 0}, {0, 0, 0}}, {{1, 0, 5e-3}, {-0.03, 0, 0}}}};
  const auto figures = path_figures(cycles, commanded);
  ASSERT_TRUE(figures);
  EXPECT_NEAR(figures->accuracy, 5e-3, 1e-12);
  EXPECT_EQ(figures->accuracy_point, 1U);
  EXPECT_NEAR(figures->repeatability, 1e-3, 1e-12);  // l = 1 mm and 1 mm
  EXPECT_EQ(figures->repeatability_point, 0U);
  EXPECT_NEAR(figures->angle_accuracy.x(), 0.01, 1e-12);
  EXPECT_NEAR(figures->angle_repeatability.x(), 3 * 0.02 * std::sqrt(2.0), 1e-12);
}

TEST(PathAccuracy, OneCycleOrUnequalPointsGiveNone) {
  const MeasuredPath commanded(2);
  EXPECT_FALSE(path_figures(std::vector<MeasuredPath>(1, commanded), commanded));
  EXPECT_FALSE(path_figures(std::vector<MeasuredPath>{commanded, MeasuredPath(1)}, commanded));
  EXPECT_FALSE(path_figures(std::vector<MeasuredPath>(2), {}));
}

TEST(PathAccuracy, RandomCyclesGiveFiguresOfTheirWorstPoint) {
  constexpr unsigned kSeed = 31;
  std::mt19937 random(kSeed);
  std::normal_distribution<double> normal(0, 1e-3);
  SCOPED_TRACE(testing::Message() << "seed " << kSeed);
  const MeasuredPath commanded = circle_path(0.2, 20, 0, 3);
  std::vector<MeasuredPath> cycles(10, commanded);
  for (MeasuredPath& cycle : cycles)
    for (MeasuredPose& pose : cycle)
      pose.position += Vector3d(normal(random), normal(random), normal(random));
  const auto figures = path_figures(cycles, commanded);
  ASSERT_TRUE(figures);
  double worst = 0;
  for (std::size_t i = 0; i < commanded.size(); ++i) {
    std::vector<MeasuredPose> cloud;
    for (const MeasuredPath& cycle : cycles) cloud.push_back(cycle[i]);
    worst = std::max(worst, pose_figures(cloud, commanded[i])->repeatability);
  }
  EXPECT_EQ(figures->repeatability, worst);
}

TEST(Velocity, ThreeCyclesGiveHandComputedFigures) {
  // Means 0.09, 0.1, 0.11: AV = 0, S = 0.01; the second cycle fluctuates most.
  const std::vector<std::vector<double>> cycles{{0.09, 0.09}, {0.08, 0.12}, {0.1, 0.12}};
  const auto figures = velocity_figures(cycles, 0.1);
  ASSERT_TRUE(figures);
  EXPECT_NEAR(figures->accuracy, 0, 1e-12);
  EXPECT_NEAR(figures->repeatability, 0.3, 1e-12);
  EXPECT_NEAR(figures->fluctuation, 0.04, 1e-12);
  EXPECT_NEAR(velocity_figures(cycles, 0.125)->accuracy, -0.2, 1e-12);
  EXPECT_FALSE(velocity_figures(cycles, 0));
  EXPECT_FALSE(velocity_figures(std::vector<std::vector<double>>{{0.1}, {}}, 0.1));
}

TEST(Corner, RoundedCornerGivesRoundOff) {
  const std::vector<Vector3d> attained{{-2, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, 2, 0}};
  const auto figures = corner_figures(attained, Vector3d::Zero(), {1, 0, 0}, {0, 3, 0});
  ASSERT_TRUE(figures);
  EXPECT_NEAR(figures->round_off, std::sqrt(0.5), 1e-12);
  EXPECT_EQ(figures->overshoot, 0);
}

TEST(Corner, PathBeyondCornerGivesOvershootOnOuterSide) {
  const std::vector<Vector3d> attained{{-1, 0, 0}, {0, 0, 0}, {0.3, 0.5, 0.4}, {-0.9, 1, 0}, {0, 2, 0}};
  const auto figures = corner_figures(attained, Vector3d::Zero(), {1, 0, 0}, {0, 1, 0});
  ASSERT_TRUE(figures);
  EXPECT_EQ(figures->round_off, 0);
  EXPECT_NEAR(figures->overshoot, 0.5, 1e-12);
}

TEST(Corner, ParallelLinesGiveNone) {
  const std::vector<Vector3d> attained(2, Vector3d::Zero());
  EXPECT_FALSE(corner_figures(attained, Vector3d::Zero(), {1, 0, 0}, {2, 0, 0}));
  EXPECT_FALSE(corner_figures(attained, Vector3d::Zero(), {1, 0, 0}, {0, 0, 0}));
}

}  // namespace
}  // namespace doppel
