// Covers and their proofs: planning.md decision 4.
#include "doppel/robot/clearance/sphere_cover.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <random>

#include "doppel/description/meshes/mesh.h"
#include "doppel/robot/clearance/instance_covers.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

constexpr double kCoarseCells = 40;  // of the largest size, for the proof of the inside

double largest_size(const CoverGeometry& shape) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& p : shape.vertices) box.extend(p);
  if (shape.ball) return 2 * shape.ball->radius;
  return box.sizes().maxCoeff();
}

void expect_proven(const CoverGeometry& shape, const SphereCover& cover) {
  for (std::size_t level = 0; level < 3; ++level) {
    const auto hole = find_hole(cover.levels[level], shape, largest_size(shape) / kCoarseCells);
    EXPECT_FALSE(hole) << "level " << level << ", " << hole->point.transpose() << ", inside " << hole->inside;
  }
}

TEST(CoverProof, SphereThatIsTakenAwayLeavesHole) {
  const CoverGeometry box = cover_geometry(CollisionShape{Box{{0.3, 0.1, 0.1}}});
  const SphereCover cover = make_cover(box, {6, 24});
  expect_proven(box, cover);
  int holes = 0;
  for (std::size_t i = 0; i < cover.levels[1].size(); ++i) {
    std::vector<CoverSphere> spheres = cover.levels[1];
    spheres.erase(spheres.begin() + static_cast<std::ptrdiff_t>(i));
    holes += find_hole(spheres, box, 0.005) ? 1 : 0;
  }
  EXPECT_GE(2 * holes, static_cast<int>(cover.levels[1].size())) << "enlarging has made some superfluous";
  std::vector<CoverSphere> smaller = cover.levels[1];
  for (CoverSphere& s : smaller) s.radius *= 0.8;
  const auto hole = find_hole(smaller, box, 0.005);
  ASSERT_TRUE(hole);
  EXPECT_LE(hole->point.cwiseAbs().maxCoeff(), 0.15 + 1e-9) << "a hole is a part of the shape";
}

TEST(CoverProof, HollowCoverOfClosedShapeHasHoleInside) {
  const CoverGeometry box = cover_geometry(CollisionShape{Box{{0.2, 0.2, 0.2}}});
  std::vector<CoverSphere> skin;
  for (int x = -6; x <= 6; ++x) {
    for (int y = -6; y <= 6; ++y) {
      for (const int side : {-6, 6}) {
        const Eigen::Vector3d p(x, y, side);
        skin.push_back({p / 60, 0.02});
        skin.push_back({Eigen::Vector3d(p.z(), p.x(), p.y()) / 60, 0.02});
        skin.push_back({Eigen::Vector3d(p.y(), p.z(), p.x()) / 60, 0.02});
      }
    }
  }
  const auto hole = find_hole(skin, box, 0.01);
  ASSERT_TRUE(hole);
  EXPECT_TRUE(hole->inside);
  CoverGeometry surface = box;
  surface.closed = false;
  EXPECT_FALSE(find_hole(skin, surface, 0.01)) << "the surface itself is covered";
}

TEST(SphereCover, PrimitivesAreCoveredWithinTheirExcess) {
  const std::vector<Geometry> shapes{
      Box{{0.05, 0.1, 0.3}},        Cylinder{0.04, 0.2},
      Capsule{0.03, 0.2},           Sphere{0.1},
      Ellipsoid{{0.1, 0.05, 0.03}}, Cylinder{0.002, 0.3},
      Box{{0.3, 0.2, 0.002}},       Extrusion{{{0, 0}, {0.1, 0}, {0, 0.1}}, 0.05}};
  for (const Geometry& geometry : shapes) {
    SCOPED_TRACE(geometry.index());
    const CoverGeometry shape =
        cover_geometry(collision_shape(geometry, nullptr, Pose::Identity(), Friction{}));
    const SphereCover cover = make_cover(shape, {8, 64});
    expect_proven(shape, cover);
    EXPECT_TRUE(cover.closed);
    EXPECT_LE(cover.excess[2], cover.excess[1]);
    EXPECT_LE(cover.levels[1].size(), 12U);
    EXPECT_LE(cover.levels[2].size(), 80U);
  }
}

TEST(SphereCover, SmallLinkIsCoveredCloselyByManySpheres) {
  const CoverGeometry shape = cover_geometry(CollisionShape{Box{{0.03, 0.03, 0.06}}});
  EXPECT_LT(make_cover(shape, {8, 300}).excess[2], 0.0035) << "2 mm, and what enlarging adds";
}

TEST(SphereCover, MeshesOfBundledRobotsAreProven) {
  int meshes = 0;
  for (const char* robot : {"omarm_one", "omarm_zero", "lab_arm", "kate"}) {
    for (const auto& file :
         fs::directory_iterator(fs::path(DOPPEL_SOURCE_DIR) / "robots" / robot / "meshes")) {
      if (file.path().extension() != ".stl") continue;
      SCOPED_TRACE(file.path().string());
      TriangleMesh mesh = load_mesh(file.path().string(), Eigen::Vector3d::Ones());
      if (mesh.bounds().sizes().maxCoeff() > 2)
        mesh = load_mesh(file.path().string(), Eigen::Vector3d::Constant(0.001));
      const CoverGeometry shape = cover_geometry(mesh);
      expect_proven(shape, make_cover(shape, {8, 48}));
      if (++meshes % 3 == 0) break;  // three of each robot
    }
  }
  EXPECT_GE(meshes, 9);
}

TEST(SphereCover, OpenMeshIsCoveredOnItsSurface) {
  CoverGeometry shape = cover_geometry(CollisionShape{Box{{0.1, 0.1, 0.1}}});
  shape.triangles.resize(10);
  shape.closed = false;
  expect_proven(shape, make_cover(shape, {8, 64}));
}

TEST(SphereCover, MillionTrianglesAreCoveredInSeconds) {
  CoverGeometry shape;
  constexpr std::uint32_t kSide = 710;
  for (std::uint32_t i = 0; i <= kSide; ++i) {
    for (std::uint32_t k = 0; k <= kSide; ++k) {
      const double x = i * 0.3 / kSide, y = k * 0.3 / kSide;
      shape.vertices.emplace_back(x, y, 0.02 * std::sin(20 * x) * std::cos(15 * y));
    }
  }
  for (std::uint32_t i = 0; i < kSide; ++i) {
    for (std::uint32_t k = 0; k < kSide; ++k) {
      const std::uint32_t a = i * (kSide + 1) + k, b = a + 1, c = a + kSide + 1, d = c + 1;
      shape.triangles.push_back({a, b, c});
      shape.triangles.push_back({b, d, c});
    }
  }
  const SphereCover cover = make_cover(shape, {8, 48});
  EXPECT_FALSE(find_hole(cover.levels[2], shape, 0.01));
}

SceneInstance lab_arm(RobotDescription& robot) {
  const fs::path robots = fs::path(DOPPEL_SOURCE_DIR) / "robots";
  PackageResolver resolver;
  resolver.add_bundled(robots);
  const Target found = resolve_target("lab_arm", robots);
  resolver.add_context(found.description);
  Diagnostics diagnostics;
  robot = load_description(found.description, {}, resolver, diagnostics).robot;
  return described_robot(robot, compile_model(robot, BaseKind::fixed, diagnostics));
}

TEST(InstanceCovers, CachedCoverEqualsFirstOne) {
  const fs::path folder = fs::path(testing::TempDir()) / "cover_cache";
  fs::remove_all(folder);
  const char* before = std::getenv("XDG_CACHE_HOME");
  const std::string kept = before == nullptr ? "" : before;
  ::setenv("XDG_CACHE_HOME", folder.c_str(), 1);
  RobotDescription robot;
  const SceneInstance arm = lab_arm(robot);
  const auto first = make_covers(arm), second = make_covers(arm);
  before == nullptr ? ::unsetenv("XDG_CACHE_HOME") : ::setenv("XDG_CACHE_HOME", kept.c_str(), 1);
  EXPECT_FALSE(fs::is_empty(folder / "doppel" / "meshes"));
  ASSERT_EQ(first->size(), second->size());
  std::size_t fine = 0;
  for (std::size_t link = 0; link < first->size(); ++link) {
    for (std::size_t i = 0; i < (*first)[link].size(); ++i) {
      const SphereCover &a = (*first)[link][i].cover, &b = (*second)[link][i].cover;
      EXPECT_EQ(a.excess, b.excess);
      for (std::size_t level = 0; level < 3; ++level) {
        ASSERT_EQ(a.levels[level].size(), b.levels[level].size());
        for (std::size_t s = 0; s < a.levels[level].size(); ++s) {
          EXPECT_EQ(a.levels[level][s].centre, b.levels[level][s].centre);
          EXPECT_EQ(a.levels[level][s].radius, b.levels[level][s].radius);
        }
      }
      fine += a.levels[2].size();
    }
  }
  EXPECT_LE(fine, 440U) << "400 for an arm, and a few for insides";
}

TEST(Covers, LinkIsCoveredByItsOwnSpheresAndNotByFewerOnes) {
  RobotDescription robot;
  const SceneInstance arm = lab_arm(robot);
  const auto result = make_covers(arm);
  int links = 0;
  for (std::size_t link = 0; link < result->size() && links < 3; ++link) {
    if ((*result)[link].empty()) continue;
    ++links;
    std::vector<CoverSphere> spheres;
    for (const ShapeCover& shape : (*result)[link]) {
      for (const CoverSphere& s : shape.cover.levels[2])
        spheres.push_back({shape.X_LG * s.centre, s.radius + 1e-9});
    }
    const auto geometry = link_geometry(arm, static_cast<int>(link));
    EXPECT_TRUE(covers(spheres, geometry));
    for (CoverSphere& s : spheres) s.radius *= 0.7;
    EXPECT_FALSE(covers(spheres, geometry));
  }
}

}  // namespace
}  // namespace doppel
