// Lines of sight and coverage against closed forms: a wall with a hole before a plane of points.
#include "doppel/sensors/models/coverage.h"

#include <gtest/gtest.h>

#include <cmath>

#include "doppel/sensors/render/scene_builder.h"

namespace doppel {
namespace {

using Eigen::Vector3d;

// A ball of radius 0.1 m at the origin of its body.
std::unique_ptr<RayCaster> ball_at(const Vector3d& place) {
  SceneBuilder builder;
  const int body = builder.add_body("ball");
  builder.add_shape(body, Sphere{0.1}, Pose::Identity(), {});
  auto caster = make_ray_caster(builder.finish());
  Pose X_WB = Pose::Identity();
  X_WB.translation() = place;
  caster->set_poses(std::vector<Pose>{X_WB});
  return caster;
}

TEST(SightLines, PointBehindBallIsHiddenByIt) {
  const auto caster = ball_at({1, 0, 0});
  const std::vector<Vector3d> points{{2, 0, 0}, {2, 0.5, 0}, {0.5, 0, 0}, {0.9, 0, 0}};
  const std::vector<SightLine> lines = sight_lines(*caster, Vector3d::Zero(), points);
  EXPECT_FALSE(lines[0].is_free);
  EXPECT_NEAR(lines[0].distance, 0.9, 1e-3);
  EXPECT_EQ(lines[0].item, 0);
  EXPECT_TRUE(lines[1].is_free);  // beside it
  EXPECT_TRUE(lines[2].is_free);  // before it
  EXPECT_TRUE(lines[3].is_free);  // on its surface
  EXPECT_EQ(lines[3].item, -1);
  EXPECT_NEAR(lines[1].distance, std::hypot(2, 0.5), 1e-5);
}

// The shadow of a ball of radius r at distance d is a cone whose half angle is asin(r / d).
TEST(SightLines, ShadowOfBallIsItsCone) {
  const auto caster = ball_at({1, 0, 0});
  const double limit = std::asin(0.1);
  std::vector<Vector3d> points;
  for (int i = 0; i < 200; ++i) {
    const double angle = 0.2 * i / 200;
    points.emplace_back(3 * std::cos(angle), 0, 3 * std::sin(angle));
  }
  const std::vector<SightLine> lines = sight_lines(*caster, Vector3d::Zero(), points);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const double angle = 0.2 * static_cast<double>(i) / 200;
    if (std::abs(angle - limit) < 2e-3) continue;
    EXPECT_EQ(lines[i].is_free, angle > limit) << angle;
  }
}

CameraIntrinsics square_camera() {
  CameraIntrinsics out;
  out.width = out.height = 101;
  out.fx = out.fy = 50.5;  // half the field is 45 degrees
  out.cx = out.cy = 50;
  return out;
}

TEST(CameraCoverage, EachPointHasItsReason) {
  const auto caster = ball_at({0, 0, 1});  // the camera looks along z
  const std::vector<Vector3d> points{{0.5, 0, 2}, {0, 0, 2},       {2.5, 0, 2},
                                     {0, 0, -1},  {0.01, 0, 0.05}, {0.4, 0, 9}};
  const CameraCoverage coverage = camera_coverage(*caster, square_camera(), Pose::Identity(), 0.1, 5, points);
  const std::vector<CameraSight> expected{CameraSight::seen,    CameraSight::hidden,   CameraSight::outside,
                                          CameraSight::outside, CameraSight::too_near, CameraSight::too_far};
  EXPECT_EQ(coverage.sights, expected);
  EXPECT_DOUBLE_EQ(coverage.share, 1.0 / 6);
}

// A square of points in a plane at distance 1 is as large as the picture sees of it: 2 m by 2 m.
TEST(CameraCoverage, ShareOfPlaneIsThatOfField) {
  const auto caster = ball_at({0, 0, -9});
  std::vector<Vector3d> points;
  for (int i = 0; i < 100; ++i) {
    for (int k = 0; k < 100; ++k) points.emplace_back(-1.98 + 0.04 * i, -1.98 + 0.04 * k, 1);
  }
  const CameraCoverage coverage = camera_coverage(*caster, square_camera(), Pose::Identity(), 0.1, 5, points);
  EXPECT_NEAR(coverage.share, 0.25, 0.01);
}

TEST(CameraCoverage, NoPointsAreNoShare) {
  const auto caster = ball_at({0, 0, 1});
  EXPECT_EQ(camera_coverage(*caster, square_camera(), Pose::Identity(), 0.1, 5, {}).share, 0);
}

}  // namespace
}  // namespace doppel
