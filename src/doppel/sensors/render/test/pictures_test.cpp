// Colours of pictures: light, shadow, textures, transparency, anti-aliasing.
#include <gtest/gtest.h>

#include <cmath>

#include "doppel/sensors/render/ray_caster.h"
#include "doppel/sensors/render/scene_builder.h"

namespace doppel {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using Eigen::Vector4f;

SurfaceMaterial colour(const Vector4f& rgba) {
  SurfaceMaterial out;
  out.rgba = rgba;
  out.specular = 0;
  return out;
}

// A camera 2 m above the origin that looks down; u is y to the right ... of the picture, v is x downwards.
Pose looking_down() {
  Pose X = Pose::Identity();
  X.linear() << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  X.translation() = Vector3d(0, 0, 2);
  return X;
}

PixelRays square(int size, double half_width, double dx = 0, double dy = 0) {
  PixelRays out;
  out.width = out.height = size;
  out.pixel_angle = static_cast<float>(2 * half_width / size);
  for (int v = 0; v < size; ++v)
    for (int u = 0; u < size; ++u) {
      out.x.push_back(static_cast<float>(((u + 0.5 + dx) / size - 0.5) * 2 * half_width));
      out.y.push_back(static_cast<float>(((v + 0.5 + dy) / size - 0.5) * 2 * half_width));
      out.z.push_back(1);
    }
  return out;
}

struct Pictured {
  SceneBuilder builder;
  int body = builder.add_body("things");
  CameraPicture picture;
  int size = 0;

  Pictured() {
    builder.environment().ambient.setZero();
    builder.environment().background = Eigen::Vector4d(0, 0, 1, 1);
  }
  void sun(const Vector3d& direction) {
    Light light;
    light.kind = LightKind::directional;
    light.direction_W = direction;
    light.cast_shadows = true;
    builder.add_light(light);
  }
  void take(const std::vector<PixelRays>& samples) {
    const auto caster = make_ray_caster(builder.finish());
    caster->set_poses(std::vector<Pose>{Pose::Identity()});
    caster->render({samples, looking_down(), 0.01, 50, true, false, false}, picture);
    size = samples.front().width;
  }
  [[nodiscard]] std::array<int, 3> at(int u, int v) const {
    const auto i = static_cast<std::size_t>(3 * (v * size + u));
    return {picture.rgb[i], picture.rgb[i + 1], picture.rgb[i + 2]};
  }
};

double srgb(double linear) {
  return 255 * (linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055);
}

TEST(CameraPictures, DiffuseLightFollowsCosineLaw) {
  for (const double angle : {0.0, 0.5, 1.0}) {
    Pictured p;
    p.sun({std::sin(angle), 0, -std::cos(angle)});
    p.builder.add_shape(p.body, Plane{Vector3d::UnitZ(), {10, 10}}, Pose::Identity(), colour({1, 1, 1, 1}));
    p.take({square(8, 0.5)});
    EXPECT_NEAR(p.at(4, 4)[0], srgb(std::cos(angle)), 1) << angle;
  }
}

TEST(CameraPictures, PixelThatLensDoesNotReachIsBlack) {
  PixelRays lens = square(16, 0.5);
  for (std::size_t i = 0; i < 40; ++i) lens.x[i] = lens.y[i] = lens.z[i] = 0;
  Pictured p;  // nothing but its blue background
  p.take({lens});
  EXPECT_EQ(p.at(0, 0), (std::array<int, 3>{0, 0, 0}));
  EXPECT_EQ(p.at(7, 2), (std::array<int, 3>{0, 0, 0}));
  EXPECT_EQ(p.at(8, 2), (std::array<int, 3>{0, 0, 255}));
}

TEST(CameraPictures, ShadowIsWhereSunIsCovered) {
  Pictured p;
  p.sun({0, 1, -1});  // the shadow of what is at height h falls h further along y
  p.builder.add_shape(p.body, Plane{Vector3d::UnitZ(), {10, 10}}, Pose::Identity(), colour({1, 1, 1, 1}));
  Pose X = Pose::Identity();
  X.translation() = Vector3d(0, -0.5, 0.5);
  p.builder.add_shape(p.body, Box{{0.2, 0.2, 0.01}}, X, colour({1, 0, 0, 1}));
  p.take({square(64, 0.5)});
  // A pixel (u, v) sees x = (u - 31.5) / 32, y = -(v - 31.5) / 32 on the plane.
  EXPECT_EQ(p.at(32, 32)[1], 0);  // in the shadow, at the origin
  EXPECT_GT(p.at(32, 10)[1], 150);
  EXPECT_GT(p.at(50, 32)[1], 150);
}

TEST(CameraPictures, TransparentSurfaceShowsWhatIsBehindByItsOpacity) {
  Pictured p;
  p.sun({0, 0, -1});
  p.builder.add_shape(p.body, Plane{Vector3d::UnitZ(), {10, 10}}, Pose::Identity(), colour({0, 1, 0, 1}));
  p.take({square(8, 0.2)});
  const int plain = p.at(4, 4)[1];
  Pictured q;
  q.builder.environment().shadows = false;
  q.sun({0, 0, -1});
  q.builder.add_shape(q.body, Plane{Vector3d::UnitZ(), {10, 10}}, Pose::Identity(), colour({0, 1, 0, 1}));
  Pose X = Pose::Identity();
  X.translation().z() = 1;
  q.builder.add_shape(q.body, Plane{Vector3d::UnitZ(), {10, 10}}, X, colour({1, 0, 0, 0.25F}));
  q.take({square(8, 0.2)});
  EXPECT_EQ(plain, 255);
  EXPECT_NEAR(q.at(4, 4)[0], srgb(0.25), 1);
  EXPECT_NEAR(q.at(4, 4)[1], srgb(0.75), 1);
}

TEST(CameraPictures, SeveralSamplesOfPixelGiveItsCoveredPart) {
  Pictured p;
  p.sun({0, 0, -1});
  Pose X = Pose::Identity();
  X.translation().x() = 5;  // the half with x > 0
  p.builder.add_shape(p.body, Plane{Vector3d::UnitZ(), {10, 10}}, X, colour({1, 1, 1, 1}));
  std::vector<PixelRays> samples;
  for (const double dx : {-0.375, -0.125, 0.125, 0.375}) samples.push_back(square(9, 0.2, dx));
  p.take(samples);
  EXPECT_EQ(p.at(0, 4)[0], 0);
  EXPECT_EQ(p.at(8, 4)[0], 255);
  EXPECT_NEAR(p.at(4, 4)[0], srgb(0.5), 2);
  EXPECT_EQ(p.at(0, 4)[2], 255);
}

TEST(CameraPictures, PointLightFadesByItsAttenuation) {
  for (const double quadratic : {0.0, 1.0}) {
    Pictured p;
    Light lamp;
    lamp.kind = LightKind::point;
    lamp.X_WL.translation().z() = 1;
    lamp.attenuation_linear = 0;
    lamp.attenuation_quadratic = quadratic;
    p.builder.add_light(lamp);
    p.builder.add_shape(p.body, Plane{Vector3d::UnitZ(), {10, 10}}, Pose::Identity(), colour({1, 1, 1, 1}));
    p.take({square(9, 0.01)});
    EXPECT_NEAR(p.at(4, 4)[0], srgb(1 / (1.0 + quadratic)), 1);
  }
}

}  // namespace
}  // namespace doppel
