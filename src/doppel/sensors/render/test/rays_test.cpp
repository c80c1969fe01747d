// Distances, depths and labels against closed forms and a caster that tries every triangle in double precision.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <optional>
#include <random>

#include "doppel/sensors/render/ray_caster.h"
#include "doppel/sensors/render/scene_builder.h"

namespace doppel {
namespace {

using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

PixelRays pinhole(int width, int height, double focal) {
  PixelRays out;
  out.width = width;
  out.height = height;
  out.pixel_angle = static_cast<float>(1 / focal);
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u) {
      out.x.push_back(static_cast<float>((u - (width - 1) / 2.0) / focal));
      out.y.push_back(static_cast<float>((v - (height - 1) / 2.0) / focal));
      out.z.push_back(1);
    }
  return out;
}

// Möller and Trumbore's test, in double precision, of one triangle after the other.
struct SlowHit {
  double distance = kInfinity;
  int item = -1;
};
SlowHit slow_cast(const RenderScene& scene, std::span<const Pose> bodies, const Vector3d& from,
                  const Vector3d& along) {
  SlowHit best;
  for (std::size_t i = 0; i < scene.items.size(); ++i) {
    const SceneItem& item = scene.items[i];
    const SurfaceMesh& mesh = *scene.meshes[static_cast<std::size_t>(item.mesh)];
    const Pose X_WM = bodies[static_cast<std::size_t>(item.body)] * item.X_BM;
    for (const auto& t : mesh.triangles) {
      const Vector3d a = X_WM * mesh.positions[t[0]].cast<double>(),
                     ab = X_WM * mesh.positions[t[1]].cast<double>() - a,
                     ac = X_WM * mesh.positions[t[2]].cast<double>() - a;
      const Vector3d p = along.cross(ac);
      const double determinant = ab.dot(p);
      if (std::abs(determinant) < 1e-14) continue;
      const Vector3d s = from - a, q = s.cross(ab);
      const double u = s.dot(p) / determinant, v = along.dot(q) / determinant, d = ac.dot(q) / determinant;
      if (u >= 0 && v >= 0 && u + v <= 1 && d > 0 && d < best.distance) best = {d, static_cast<int>(i)};
    }
  }
  return best;
}

RayBatch fan(const Vector3d& from, const std::vector<Vector3d>& directions, float far) {
  RayBatch rays;
  rays.resize(directions.size(), 1);
  rays.far = far;
  rays.origin_x[0] = static_cast<float>(from.x());
  rays.origin_y[0] = static_cast<float>(from.y());
  rays.origin_z[0] = static_cast<float>(from.z());
  for (std::size_t i = 0; i < directions.size(); ++i) {
    rays.direction_x[i] = static_cast<float>(directions[i].x());
    rays.direction_y[i] = static_cast<float>(directions[i].y());
    rays.direction_z[i] = static_cast<float>(directions[i].z());
  }
  return rays;
}

struct RandomScene {
  std::shared_ptr<const RenderScene> scene;
  std::vector<Pose> poses;
};

Pose random_pose(std::mt19937& random, double spread) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  Pose X = Pose::Identity();
  X.linear() = Eigen::Quaterniond::UnitRandom().toRotationMatrix();
  X.translation() = spread * Vector3d(uniform(random), uniform(random), uniform(random));
  return X;
}

RandomScene random_scene(std::mt19937& random, int bodies) {
  std::uniform_real_distribution<double> size(0.1, 0.6);
  SceneBuilder builder;
  RandomScene out;
  for (int i = 0; i < bodies; ++i) {
    const int body = builder.add_body("b" + std::to_string(i));
    const Geometry shapes[] = {Box{{size(random), size(random), size(random)}},
                               Cylinder{size(random) / 2, size(random)},
                               Cone{size(random) / 2, size(random)}};
    builder.add_shape(body, shapes[random() % 3], random_pose(random, 0.2), {});
    out.poses.push_back(random_pose(random, 2));
  }
  out.scene = builder.finish();
  return out;
}

TEST(RayCaster, RangesInBoxRoomAreThoseOfClosedForm) {
  SceneBuilder builder;
  const int body = builder.add_body("room");
  builder.add_shape(body, Box{{4, 6, 3}}, Pose::Identity(), {});
  const auto caster = make_ray_caster(builder.finish());
  caster->set_poses(std::vector<Pose>{Pose::Identity()});
  std::vector<Vector3d> directions;
  for (int i = 0; i < 720; ++i) {
    const double a = i * M_PI / 360 + 1e-4;
    directions.emplace_back(std::cos(a), std::sin(a), 0);
  }
  const Vector3d from(0.5, -1, 0.2);
  HitBatch hits;
  caster->cast(fan(from, directions, 100), hits);
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const Vector3d& d = directions[i];
    const double to_x = ((d.x() > 0 ? 2 : -2) - from.x()) / d.x(),
                 to_y = ((d.y() > 0 ? 3 : -3) - from.y()) / d.y();
    EXPECT_NEAR(hits.distance[i], std::min(to_x, to_y), 1e-5) << i;
    EXPECT_NEAR(hits.cosine[i], to_x < to_y ? std::abs(d.x()) : std::abs(d.y()), 1e-5);
    EXPECT_EQ(hits.item[i], 0);
  }
}

TEST(RayCaster, DepthOfTiltedPlaneIsThatOfClosedForm) {
  SceneBuilder builder;
  const int body = builder.add_body("plane");
  builder.add_shape(body, Plane{Vector3d::UnitZ(), {20, 20}}, Pose::Identity(), {});
  const auto caster = make_ray_caster(builder.finish());
  Pose X_WP = Pose::Identity();
  const Vector3d normal = Vector3d(0.3, -0.2, -1).normalized();
  X_WP.linear() = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), normal).toRotationMatrix();
  X_WP.translation() = Vector3d(0, 0, 2);
  caster->set_poses(std::vector<Pose>{X_WP});
  const PixelRays pixels = pinhole(320, 240, 277);
  CameraPicture picture;
  caster->render({{&pixels, 1}, Pose::Identity(), 0.05, 2.1, false, true, false}, picture);
  int seen = 0, beyond = 0;
  for (std::size_t i = 0; i < picture.depth.size(); ++i) {
    const double z = normal.z() * 2 / normal.dot(Vector3d(pixels.x[i], pixels.y[i], 1));
    if (z < 2.0999) {
      EXPECT_NEAR(picture.depth[i], z, 1e-4 * z);
      ++seen;
    } else if (z > 2.1001) {
      EXPECT_EQ(picture.depth[i], kInfinity);
      ++beyond;
    }
  }
  EXPECT_GT(seen, 1000);
  EXPECT_GT(beyond, 1000);
}

TEST(RayCaster, LabelsAndDepthsAreThoseOfEveryTriangleTried) {
  const unsigned seed = 20261124;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  std::srand(seed);  // of Eigen
  for (int round = 0; round < 50; ++round) {
    const RandomScene random_bodies = random_scene(random, 8);
    const auto caster = make_ray_caster(random_bodies.scene);
    caster->set_poses(random_bodies.poses);
    const PixelRays pixels = pinhole(30, 22, 22);
    Pose X_WC = random_pose(random, 0.2);
    X_WC.translation() -= 4 * X_WC.linear().col(2);
    CameraPicture picture;
    caster->render({{&pixels, 1}, X_WC, 0.01, 50, false, true, true}, picture);
    std::vector<int> count(random_bodies.scene->items.size() + 1), expected(count.size());
    int different = 0;
    for (std::size_t i = 0; i < picture.labels.size(); ++i) {
      const SlowHit hit = slow_cast(*random_bodies.scene, random_bodies.poses, X_WC.translation(),
                                    X_WC.linear() * Vector3d(pixels.x[i], pixels.y[i], 1));
      ++count[picture.labels[i]];
      ++expected[static_cast<std::size_t>(hit.item + 1)];
      if (picture.labels[i] != static_cast<std::uint32_t>(hit.item + 1))
        ++different;
      else if (hit.item >= 0) {
        EXPECT_NEAR(picture.depth[i], hit.distance, 2e-5 * hit.distance + 1e-5);
      }
    }
    // A ray through an edge may fall on either side of it in single precision.
    EXPECT_LE(different, 1) << round;
    for (std::size_t label = 0; label < count.size(); ++label) EXPECT_NEAR(count[label], expected[label], 1);
  }
}

TEST(RayCaster, MovedBodyIsSeenAsOneThatStoodThereFromStart) {
  const unsigned seed = 20261125;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  std::srand(seed);
  const RandomScene start = random_scene(random, 6);
  std::vector<Pose> after = start.poses;
  after[1] = random_pose(random, 1);
  after[4] = random_pose(random, 1);
  const auto moved = make_ray_caster(start.scene), fresh = make_ray_caster(start.scene);
  moved->set_poses(start.poses);
  moved->set_poses(after);
  fresh->set_poses(after);
  const PixelRays pixels = pinhole(160, 120, 120);
  Pose X_WC = Pose::Identity();
  X_WC.translation() = Vector3d(0, 0, -5);
  CameraPicture a, b;
  moved->render({{&pixels, 1}, X_WC, 0.01, 50, true, true, true}, a);
  fresh->render({{&pixels, 1}, X_WC, 0.01, 50, true, true, true}, b);
  int different = 0;
  for (std::size_t i = 0; i < a.labels.size(); ++i) {
    if (a.labels[i] != b.labels[i])
      ++different;
    else if (a.labels[i] != 0) {
      EXPECT_NEAR(a.depth[i], b.depth[i], 2e-5);
    }
  }
  EXPECT_LE(different, 3);
  int other_colours = 0;  // with the shadows of what has moved
  for (std::size_t i = 0; i < a.rgb.size(); ++i) other_colours += std::abs(a.rgb[i] - b.rgb[i]) > 3 ? 1 : 0;
  EXPECT_LE(other_colours, 60);
}

TEST(RayCaster, MovedBodyIsMetByRaysFromEverywhere) {
  const unsigned seed = 20261126;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  std::srand(seed);
  const RandomScene start = random_scene(random, 20);
  std::vector<Pose> after;
  for (const Pose& X : start.poses) after.push_back(X * random_pose(random, 0.5));
  const auto caster = make_ray_caster(start.scene);
  caster->set_poses(start.poses);
  caster->set_poses(after);
  RayBatch rays;
  constexpr std::size_t kRays = 3000;
  rays.resize(kRays, kRays);
  rays.far = 100;
  std::vector<Vector3d> from, along;
  for (std::size_t i = 0; i < kRays; ++i) {
    // Neighbours begin and end near each other, so that packets are narrow and wide.
    const Vector3d place = i % 24 == 0 ? random_pose(random, 3).translation() : from.back();
    from.push_back(place + 0.01 * Vector3d::Random());
    along.push_back(i % 24 == 0 ? Vector3d::Random().normalized()
                                : (along.back() + (i % 48 < 24 ? 0.02 : 1.0) * Vector3d::Random()).eval());
    rays.origin_x[i] = static_cast<float>(from[i].x());
    rays.origin_y[i] = static_cast<float>(from[i].y());
    rays.origin_z[i] = static_cast<float>(from[i].z());
    rays.direction_x[i] = static_cast<float>(along[i].x());
    rays.direction_y[i] = static_cast<float>(along[i].y());
    rays.direction_z[i] = static_cast<float>(along[i].z());
  }
  HitBatch hits;
  caster->cast(rays, hits);
  int different = 0, met = 0;
  for (std::size_t i = 0; i < kRays; ++i) {
    const SlowHit hit = slow_cast(*start.scene, after, from[i], along[i]);
    different += hit.item != hits.item[i] ? 1 : 0;
    met += hit.item >= 0 ? 1 : 0;
  }
  EXPECT_GT(met, 5);
  EXPECT_LE(different, 3);
}

TEST(RayCaster, LineOfSightEndsAtFirstSurface) {
  SceneBuilder builder;
  const int wall = builder.add_body("wall");
  builder.add_shape(wall, Box{{0.1, 2, 2}}, Pose::Identity(), {});
  const auto caster = make_ray_caster(builder.finish());
  caster->set_poses(std::vector<Pose>{Pose::Identity()});
  EXPECT_FALSE(caster->sees({-1, 0, 0}, {1, 0, 0}));
  EXPECT_TRUE(caster->sees({-1, 0, 0}, {-0.06, 0, 0}));
  EXPECT_TRUE(caster->sees({-1, 1.5, 0}, {1, 1.5, 0}));
  EXPECT_EQ(caster->rays_cast(), 3U);
}

// Physics that diverges and velocities that are extrapolated give such poses; Embree ends the process for such rays.
TEST(RayCaster, PosesBeyondAllBoundsAreNotSeenAndSeeNothing) {
  const PixelRays pixels = pinhole(9, 5, 5);
  for (const double place : {1e30, 1e300, kInfinity, std::numeric_limits<double>::quiet_NaN()}) {
    SceneBuilder builder;
    for (const char* name : {"still", "moving"})
      builder.add_shape(builder.add_body(name), Box{{1, 1, 1}}, Pose::Identity(), {});
    const auto caster = make_ray_caster(builder.finish());
    std::vector<Pose> poses(2, Pose::Identity());
    poses[0].translation().z() = 5;
    caster->set_poses(poses);
    poses[1].translation().z() = 2;
    caster->set_poses(poses);
    const auto depth_of_centre = [&](const Pose& X_WC) {
      CameraPicture picture;
      caster->render({{&pixels, 1}, X_WC, 0.01, 50, true, true, true}, picture);
      return picture.depth[22];
    };
    Pose away = Pose::Identity();
    EXPECT_NEAR(depth_of_centre(away), 1.5, 1e-5);
    away.translation().x() = place;
    EXPECT_EQ(depth_of_centre(away), kInfinity) << place;
    EXPECT_TRUE(caster->sees(away.translation(), {0, 0, 0})) << place;
    EXPECT_FALSE(caster->may_be_near(away.translation(), 1, -1)) << place;
    HitBatch hits;
    caster->cast(fan(away.translation(), {Vector3d::UnitX(), Vector3d::UnitZ()}, 10), hits);
    EXPECT_EQ(hits.item, (std::vector<std::int32_t>{-1, -1})) << place;
    poses[1].translation().z() = place;
    caster->set_poses(poses);
    EXPECT_NEAR(depth_of_centre(Pose::Identity()), 4.5, 1e-5) << place;
    poses[0].translation().z() = place;
    caster->set_poses(poses);
    EXPECT_EQ(depth_of_centre(Pose::Identity()), kInfinity) << place;
  }
}

TEST(RayCaster, EmptySceneShowsNothing) {
  SceneBuilder builder;
  const auto caster = make_ray_caster(builder.finish());
  caster->set_poses({});
  const PixelRays pixels = pinhole(9, 5, 5);
  CameraPicture picture;
  caster->render({{&pixels, 1}, Pose::Identity(), 0.01, 50, true, true, true}, picture);
  for (const float depth : picture.depth) EXPECT_EQ(depth, kInfinity);
  for (const std::uint32_t label : picture.labels) EXPECT_EQ(label, 0U);
}

}  // namespace
}  // namespace doppel
