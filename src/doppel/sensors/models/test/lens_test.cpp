#include "doppel/sensors/models/lens.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "doppel/sensors/render/ray_caster.h"
#include "doppel/sensors/render/scene_builder.h"

namespace doppel {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

CameraDescription camera_of(LensKind kind, double hfov) {
  CameraDescription camera;
  camera.width = 640;
  camera.height = 480;
  camera.hfov = hfov;
  camera.lens.kind = kind;
  camera.lens.cutoff_angle = 3.1;
  return camera;
}

TEST(Lens, PinholeHasFocalLengthOfItsFieldOfView) {
  const CameraIntrinsics c = intrinsics_of(camera_of(LensKind::pinhole, std::numbers::pi / 2));
  EXPECT_NEAR(c.fx, 320, 1e-9);
  EXPECT_EQ(c.cx, 319.5);
  EXPECT_EQ(c.cy, 239.5);
  // The border of the last pixel is at half of the field of view.
  EXPECT_NEAR(direction_at(c, 639.5, 239.5)->x(), 1, 1e-12);
}

TEST(Lens, DirectionAtPixelIsProjectedToThatPixel) {
  CameraDescription distorted = camera_of(LensKind::pinhole, 1.2);
  distorted.lens.distortion = {-0.3, 0.05, 0.001, -0.002, 0.01};
  CameraDescription offset = camera_of(LensKind::pinhole, 1.2);
  offset.lens.intrinsics = LensDescription::Intrinsics{400, 410, 300, 250, 0.5};
  for (const CameraDescription& camera :
       {camera_of(LensKind::pinhole, 1.047), distorted, offset,
        camera_of(LensKind::equidistant, std::numbers::pi), camera_of(LensKind::stereographic, 2.6),
        camera_of(LensKind::equisolid, 3.0), camera_of(LensKind::orthographic, 2.2)}) {
    const CameraIntrinsics c = intrinsics_of(camera);
    int seen = 0;
    for (int v = 0; v < 480; v += 31)
      for (int u = 0; u < 640; u += 31) {
        const auto d = direction_at(c, u, v);
        if (!d) continue;
        const auto back = project(c, 2.5 * *d);
        ASSERT_TRUE(back);
        EXPECT_LT((*back - Vector2d(u, v)).norm(), 1e-6);
        ++seen;
      }
    EXPECT_GT(seen, 200);
  }
}

TEST(Lens, FisheyePolynomialIsWithinHundredthOfPixelOfItsLens) {
  for (const auto& [kind, hfov] : {std::pair{LensKind::equidistant, 3.1},
                                   {LensKind::stereographic, 2.6},
                                   {LensKind::equisolid, 3.1},
                                   {LensKind::orthographic, 2.0}}) {
    double deviation = 1;
    const CameraIntrinsics c = intrinsics_of(camera_of(kind, hfov), &deviation);
    EXPECT_LT(deviation, 0.05) << static_cast<int>(kind);
    // At half of the field of view is the border of the picture.
    const double a = hfov / 2;
    EXPECT_NEAR(project(c, {std::sin(a), 0, std::cos(a)})->x(), c.cx + 320, 0.06);
  }
}

TEST(Lens, PictureOfStronglyDistortedLensIsDarkWhereNoDirectionIs) {
  CameraDescription camera = camera_of(LensKind::pinhole, 2.2);
  camera.lens.distortion = {-0.3, 0, 0, 0, 0};
  const CameraIntrinsics c = intrinsics_of(camera);
  EXPECT_FALSE(direction_at(c, 0, 0));
  EXPECT_TRUE(direction_at(c, 320, 240));
}

// A white square of known place: the centroid of its pixels against the projection by camera_info of its points.
void expect_centroid(const CameraDescription& camera, const Vector3d& centre, double side) {
  SceneBuilder builder;
  const int body = builder.add_body("square");
  SurfaceMaterial white;
  white.rgba = Eigen::Vector4f::Ones();
  white.emissive = Eigen::Vector3f::Ones();
  Pose X = Pose::Identity();
  X.translation() = centre;
  // Turned towards the camera, so that a fisheye sees it beside itself, too.
  X.linear() = rotation_from_z(-centre);
  builder.add_shape(body, Plane{Vector3d::UnitZ(), {side, side}}, X, white);
  builder.environment().background.setZero();
  const auto caster = make_ray_caster(builder.finish());
  caster->set_poses(std::vector<Pose>{Pose::Identity()});
  const CameraIntrinsics c = intrinsics_of(camera);
  const std::vector<PixelRays> rays = pixel_rays(c, 16);
  CameraPicture picture;
  caster->render({.samples = rays, .near = 0.01, .far = 100}, picture);
  double sum = 0;
  Vector2d at = Vector2d::Zero();
  for (int v = 0; v < c.height; ++v)
    for (int u = 0; u < c.width; ++u) {
      const double srgb = picture.rgb[static_cast<std::size_t>(3 * (v * c.width + u))] / 255.0;
      const double weight = srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
      sum += weight;
      at += weight * Vector2d(u, v);
    }
  ASSERT_GT(sum, 50);
  at /= sum;
  // The mean of the projection over the square, weighted by the area that each part has in the picture.
  Vector2d expected = Vector2d::Zero();
  double area = 0;
  constexpr int kParts = 60;
  const auto seen = [&](double s, double t) {
    return *project(c, X * Vector3d(side * (s - 0.5), side * (t - 0.5), 0));
  };
  for (int i = 0; i < kParts; ++i)
    for (int j = 0; j < kParts; ++j) {
      const double s = (i + 0.5) / kParts, t = (j + 0.5) / kParts, h = 0.5 / kParts;
      const Vector2d a = seen(s + h, t) - seen(s - h, t), b = seen(s, t + h) - seen(s, t - h);
      const double part = std::abs(a.x() * b.y() - a.y() * b.x());
      area += part;
      expected += part * seen(s, t);
    }
  expected /= area;
  EXPECT_LT((at - expected).norm(), 0.05) << at.transpose() << " and " << expected.transpose();
}

TEST(Lens, SquareIsSeenWhereCameraInfoSays) {
  expect_centroid(camera_of(LensKind::pinhole, 1.047), {0.3, -0.2, 2}, 0.2);
  CameraDescription distorted = camera_of(LensKind::pinhole, 1.2);
  distorted.lens.distortion = {-0.3, 0, 0, 0, 0};
  expect_centroid(distorted, {0.7, 0.4, 2}, 0.2);
  expect_centroid(camera_of(LensKind::equidistant, std::numbers::pi), {2, 0.3, 0.4}, 0.3);
  CameraDescription offset = camera_of(LensKind::pinhole, 1.2);
  offset.lens.intrinsics = LensDescription::Intrinsics{420, 430, 280, 260, 0};
  expect_centroid(offset, {-0.5, 0.3, 2}, 0.2);
}

}  // namespace
}  // namespace doppel
