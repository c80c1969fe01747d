#include "doppel/robot/collision/collision_shape.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <random>

#include "doppel/physics/contract/test/engine_fixture.h"

namespace doppel {
namespace {

using Vertices = std::vector<Eigen::Vector3f>;
using ::testing::HasSubstr;

Vertices corners(const Eigen::Vector3f& size) {
  Vertices out;
  for (int i = 0; i < 8; ++i) {
    out.emplace_back((i & 1) * size.x(), (i >> 1 & 1) * size.y(), (i >> 2 & 1) * size.z());
  }
  return out;
}

// An ASCII STL of the faces of a box from the origin to `size`.
std::string write_box(const std::string& name, const Eigen::Vector3f& size) {
  const std::string path = (std::filesystem::path(::testing::TempDir()) / name).string();
  std::ofstream out(path, std::ios::binary);
  const int faces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                            {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  const Vertices points = corners(size);
  const std::uint32_t count = 12;
  const std::uint16_t attribute = 0;
  out << std::string(80, ' ');
  out.write(reinterpret_cast<const char*>(&count), 4);
  for (const auto& face : faces) {
    const Eigen::Vector3f normal = Eigen::Vector3f::Zero();
    out.write(reinterpret_cast<const char*>(normal.data()), 12);
    for (const int corner : face) out.write(reinterpret_cast<const char*>(points[corner].data()), 12);
    out.write(reinterpret_cast<const char*>(&attribute), 2);
  }
  return path;
}

RobotDescription with_mesh(const std::string& path) {
  RobotDescription robot = test::make_pendulum(1, 0.5);
  Collision collision;
  collision.geometry = MeshGeometry{"package://p/part.stl", {0.001, 0.001, 0.001}, path};
  collision.source = make_location("robot.urdf", 12, 5);
  robot.links[1].collisions.push_back(collision);
  return robot;
}

TEST(CollisionMesh, SmallMeshIsKeptWithoutDuplicates) {
  Vertices twice = corners({1, 2, 3});
  const Vertices once = twice;
  twice.insert(twice.end(), once.begin(), once.end());
  EXPECT_EQ(make_collision_mesh(twice).hull->vertices, once);
}

TEST(CollisionMesh, LargeMeshIsReducedWithoutShrinking) {
  const unsigned seed = 4;
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  Vertices sphere;
  for (int i = 0; i < 20000; ++i) {
    sphere.push_back(Eigen::Vector3f(normal(random), normal(random), normal(random)).normalized());
  }
  const CollisionMesh mesh = make_collision_mesh(sphere);
  EXPECT_LE(mesh.hull->vertices.size(), static_cast<std::size_t>(kSupportDirections) + 6);
  EXPECT_GT(mesh.hull->vertices.size(), 200u);
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3f direction =
        Eigen::Vector3f(normal(random), normal(random), normal(random)).normalized();
    float height = -1;
    for (const auto& p : mesh.hull->vertices) height = std::max(height, direction.dot(p));
    EXPECT_GT(height, 0.98f) << "seed " << seed;
  }
}

TEST(CollisionMesh, FlatMeshesBecomeBoxes) {
  Vertices flat = corners({0.2f, 0.1f, 0.0f});
  const Eigen::Matrix3f turn = rotation_from_rpy({0.3, 0.4, 0.5}).cast<float>();
  for (auto& p : flat) p = turn * p;
  const CollisionMesh mesh = make_collision_mesh(flat);
  EXPECT_EQ(mesh.hull, nullptr);
  Eigen::Vector3d size = mesh.box_size;
  std::sort(size.data(), size.data() + 3);
  EXPECT_NEAR((size - Eigen::Vector3d(0.001, 0.1, 0.2)).norm(), 0, 1e-6);
  EXPECT_NEAR((mesh.X_GB.translation() - (turn * Eigen::Vector3f(0.1f, 0.05f, 0)).cast<double>()).norm(), 0,
              1e-6);
  EXPECT_NEAR(mesh.X_GB.linear().determinant(), 1, 1e-9);
}

TEST(CollisionMesh, MeshCollidesAsItsHull) {
  // 200 x 100 x 40 mm from the origin of the link, which is at z = 2.
  test::Rig rig(with_mesh(write_box("hull.stl", {200, 100, 40})));
  EXPECT_TRUE(rig.diagnostics.all().empty());
  const RayHit hit = rig.engine->cast_ray({0.15, 0.05, 3}, {0, 0, -1});
  EXPECT_NEAR(hit.distance, 1 - 0.04, 1e-6);
  EXPECT_EQ(hit.body, (BodyId{0, 1}));
  EXPECT_LT(rig.engine->cast_ray({0.21, 0.05, 3}, {0, 0, -1}).distance, 0);
}

TEST(CollisionMesh, FlatMeshIsReported) {
  test::Rig rig(with_mesh(write_box("flat.stl", {200, 100, 0})));
  ASSERT_EQ(rig.diagnostics.all().size(), 1u);
  EXPECT_EQ(rig.diagnostics.all()[0].rule, "physics.flat_mesh");
  EXPECT_THAT(rig.diagnostics.all()[0].str(), HasSubstr("robot.urdf:12:5"));
  EXPECT_THAT(rig.diagnostics.all()[0].message, HasSubstr("link 'bob'"));
  rig.run(0.1);
}

// The box in place of a flat mesh, too: the engine does not end with shapes of astronomical sizes.
TEST(CollisionMesh, MeshBeyondLargestSizeIsRefused) {
  for (const float height : {0.0f, 40.0f}) {
    try {
      const test::Rig rig(with_mesh(write_box("huge.stl", {2e9f, 1e9f, height})));
      ADD_FAILURE() << "height " << height << " mm";
    } catch (const InputError& refused) {
      EXPECT_EQ(refused.diagnostics()[0].rule, "physics.size");
      EXPECT_THAT(refused.what(), HasSubstr("robot.urdf:12:5: error: the distance of a vertex"));
    }
  }
}

TEST(CollisionMesh, MissingAndBrokenMeshesDoNotCollide) {
  test::Rig missing(with_mesh(""));
  EXPECT_TRUE(missing.diagnostics.all().empty()) << "expected no diagnostic: the description has reported it";
  missing.run(0.1);
  const std::string path = (std::filesystem::path(::testing::TempDir()) / "broken.stl").string();
  std::ofstream(path) << "not a mesh";
  test::Rig broken(with_mesh(path));
  ASSERT_EQ(broken.diagnostics.all().size(), 1u);
  EXPECT_EQ(broken.diagnostics.all()[0].severity, Severity::warning);
  EXPECT_THAT(broken.diagnostics.all()[0].str(), HasSubstr("collides with nothing"));
}

}  // namespace
}  // namespace doppel
