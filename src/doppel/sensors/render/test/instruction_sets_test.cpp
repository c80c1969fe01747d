// The modules for the different registers of processors compute the same.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>

#include "doppel/base/core/plugin_module.h"
#include "doppel/sensors/render/ray_caster.h"
#include "doppel/sensors/render/scene_builder.h"

namespace doppel {
namespace {

using Eigen::Vector3d;

// Highlights, three kinds of lamps, a sky, glass, and a size that no packet divides.
struct Everything {
  std::shared_ptr<const RenderScene> scene;
  std::vector<Pose> poses, moved;
  PixelRays pixels;

  Everything() {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> uniform(-1, 1);
    SceneBuilder builder;
    builder.environment().sky = Sky{};
    for (const LightKind kind : {LightKind::directional, LightKind::point, LightKind::spot}) {
      Light light;
      light.kind = kind;
      light.direction_W = Vector3d(0.3, 0.2, -1).normalized();
      light.X_WL.translation() = Vector3d(0.5, -1, 3);
      light.inner_angle = 0.4;
      light.outer_angle = 1.5;
      light.falloff = 0.8;
      light.cast_shadows = true;
      builder.add_light(light);
    }
    for (int i = 0; i < 30; ++i) {
      SurfaceMaterial material;
      material.rgba = {0.2F + 0.02F * static_cast<float>(i), 0.6F, 0.9F - 0.02F * static_cast<float>(i),
                       i % 5 == 0 ? 0.4F : 1.0F};
      material.specular = 0.1F * static_cast<float>(i % 4);
      material.shininess = 5.0F + static_cast<float>(i);
      const int body = builder.add_body("body" + std::to_string(i));
      const Geometry shapes[] = {Box{{0.5, 0.3, 0.4}}, Cylinder{0.2, 0.5}, Sphere{0.3}};
      builder.add_shape(body, shapes[i % 3], Pose::Identity(), material);
      Pose X = Pose::Identity();
      X.linear() = Eigen::AngleAxisd(3 * uniform(random), Vector3d(1, uniform(random), 0.3).normalized())
                       .toRotationMatrix();
      X.translation() = 1.2 * Vector3d(uniform(random), uniform(random), uniform(random));
      poses.push_back(X);
    }
    scene = builder.finish();
    moved = poses;
    for (std::size_t i = 0; i < moved.size(); i += 2) moved[i].translation().z() += 0.1;
    pixels.width = 131;
    pixels.height = 97;
    pixels.pixel_angle = 0.01F;
    for (int v = 0; v < pixels.height; ++v)
      for (int u = 0; u < pixels.width; ++u) {
        pixels.x.push_back(static_cast<float>((u - 65.3) / 90));
        pixels.y.push_back(static_cast<float>((v - 48.1) / 90));
        pixels.z.push_back(1);
      }
  }
};

TEST(InstructionSets, PicturesAndRangesAreSameBytesWithEach) {
  const Everything what;
  Pose X_WC = Pose::Identity();
  X_WC.linear() = Eigen::AngleAxisd(-1.9, Vector3d::UnitX()).toRotationMatrix();
  X_WC.translation() = Vector3d(0, -4, 1.2);
  RayBatch rays;
  rays.resize(what.pixels.x.size(), 1);
  rays.far = 20;
  for (std::size_t i = 0; i < what.pixels.x.size(); ++i) {
    const Vector3d d = X_WC.linear() * Vector3d(what.pixels.x[i], what.pixels.y[i], what.pixels.z[i]);
    rays.direction_x[i] = static_cast<float>(d.x());
    rays.direction_y[i] = static_cast<float>(d.y());
    rays.direction_z[i] = static_cast<float>(d.z());
  }
  rays.origin_y[0] = -4;
  rays.origin_z[0] = 1.2F;
  CameraPicture expected;
  HitBatch expected_hits;
  for (const std::string& module : modules_for_processor("doppel_embree")) {
    SCOPED_TRACE(module);
    using Make = RayCaster* (*)(std::shared_ptr<const RenderScene>);
    const std::unique_ptr<RayCaster> caster(
        reinterpret_cast<Make>(plugin_symbol(module, "doppel_make_ray_caster"))(what.scene));
    caster->set_poses(what.poses);
    caster->set_poses(what.moved);
    CameraPicture picture;
    HitBatch hits;
    caster->render({{&what.pixels, 1}, X_WC, 0.05, 50, true, true, true}, picture);
    rays.columns = 0;
    caster->cast(rays, hits);
    HitBatch in_grid;
    rays.columns = static_cast<std::size_t>(what.pixels.width);
    caster->cast(rays, in_grid);
    EXPECT_EQ(hits.distance, in_grid.distance);
    EXPECT_EQ(hits.item, in_grid.item);
    if (expected.rgb.empty()) {
      expected = picture;
      expected_hits = hits;
      const auto seen = std::count_if(picture.labels.begin(), picture.labels.end(),
                                      [](std::uint32_t label) { return label != 0; });
      EXPECT_GT(seen, 2000);
    }
    EXPECT_TRUE(picture.rgb == expected.rgb);
    EXPECT_TRUE(picture.depth == expected.depth);
    EXPECT_TRUE(picture.labels == expected.labels);
    EXPECT_EQ(hits.distance, expected_hits.distance);
    EXPECT_EQ(hits.cosine, expected_hits.cosine);
    EXPECT_EQ(hits.brightness, expected_hits.brightness);
  }
}

TEST(NearSurfaces, SurfaceIsFoundWithinRadiusOnlyUnlessItsBodyIsExcepted) {
  SceneBuilder builder;
  const int still = builder.add_body("still"), moving = builder.add_body("moving");
  builder.add_shape(still, Box{{10, 10, 4}}, Pose::Identity(), {});  // a room around the point
  builder.add_shape(moving, Sphere{0.1}, Pose::Identity(), {});
  const auto caster = make_ray_caster(builder.finish());
  Pose X = Pose::Identity();
  X.translation() = Vector3d(0, 0, 0.5);
  caster->set_poses(std::vector<Pose>{Pose::Identity(), Pose::Identity()});
  caster->set_poses(std::vector<Pose>{Pose::Identity(), X});
  const Vector3d p = Vector3d::Zero();
  EXPECT_FALSE(caster->may_be_near(p, 0.39, -1));
  EXPECT_TRUE(caster->may_be_near(p, 0.41, -1));
  EXPECT_FALSE(caster->may_be_near(p, 0.41, moving));
  EXPECT_FALSE(caster->may_be_near(p, 1.99, moving));
  EXPECT_TRUE(caster->may_be_near(p, 2.01, moving));
  EXPECT_FALSE(caster->may_be_near({0, 4.8, 0}, 0.19, -1));
  EXPECT_TRUE(caster->may_be_near({0, 4.8, 0}, 0.21, -1));
  EXPECT_FALSE(caster->may_be_near({0, 4.8, 0}, 0.21, still));
}

}  // namespace
}  // namespace doppel
