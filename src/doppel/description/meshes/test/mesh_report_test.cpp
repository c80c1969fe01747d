#include "doppel/description/meshes/mesh_report.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <numbers>
#include <random>

#include "doppel/description/meshes/convex_hull.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using Triangle = std::array<int, 3>;

struct Surface {
  std::vector<Eigen::Vector3d> corners;
  std::vector<Triangle> triangles;
};

Surface cuboid(const Eigen::Vector3d& size) {
  Surface out;
  for (int i = 0; i < 8; ++i) {
    out.corners.push_back(size.cwiseProduct(Eigen::Vector3d(i & 1, (i >> 1) & 1, (i >> 2) & 1)));
  }
  out.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                   {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return out;
}

fs::path written(const Surface& surface, const std::string& name) {
  const fs::path file = fs::path(testing::TempDir()) / (name + ".obj");
  std::ofstream out(file);
  for (const auto& c : surface.corners) out << "v " << c.x() << ' ' << c.y() << ' ' << c.z() << '\n';
  for (const auto& t : surface.triangles)
    out << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
  return file;
}

TEST(MeshReport, ClosedBodyIsMeasured) {
  const MeshReport r = report_mesh(written(cuboid({1, 2, 4}), "closed"));
  ASSERT_EQ(r.problem, "");
  EXPECT_EQ(r.triangles, 12U);
  EXPECT_TRUE(r.watertight());
  EXPECT_EQ(r.degenerate, 0U);
  EXPECT_NEAR(r.solid.volume, 8.0, 1e-9);
  EXPECT_NEAR(r.hull_volume, 8.0, 1e-9);
  EXPECT_NEAR(r.area, 28.0, 1e-9);
  EXPECT_EQ(r.hull.size(), 8U);
  EXPECT_TRUE(r.upper.isApprox(Eigen::Vector3d(1, 2, 4)));
}

TEST(MeshReport, HolesAndInconsistentFacesAreCounted) {
  Surface open = cuboid({1, 1, 1});
  open.triangles.pop_back();
  EXPECT_EQ(report_mesh(written(open, "open")).open_edges, 3U);
  Surface torn = cuboid({1, 1, 1});
  std::swap(torn.triangles[0][0], torn.triangles[0][1]);
  EXPECT_EQ(report_mesh(written(torn, "torn")).crossed_edges, 3U);
  Surface inverted = cuboid({1, 1, 1});
  for (Triangle& t : inverted.triangles) std::swap(t[0], t[1]);
  const MeshReport r = report_mesh(written(inverted, "inverted"));
  EXPECT_TRUE(r.watertight());
  EXPECT_NEAR(r.solid.volume, -1.0, 1e-9);
}

TEST(MeshReport, TwoBodiesThatShareEdgeAreClosed) {
  Surface two = cuboid({1, 1, 1});
  const Surface other = cuboid({1, 1, 1});
  for (const auto& c : other.corners) two.corners.push_back(c + Eigen::Vector3d(1, 1, 0));
  for (const Triangle& t : other.triangles) two.triangles.push_back({t[0] + 8, t[1] + 8, t[2] + 8});
  EXPECT_TRUE(report_mesh(written(two, "two")).watertight());
}

TEST(MeshReport, FlatSheetHasNoVolume) {
  const Surface sheet{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}};
  const MeshReport r = report_mesh(written(sheet, "sheet"));
  EXPECT_EQ(r.problem, "");
  EXPECT_EQ(r.hull_volume, 0.0);
  EXPECT_EQ(r.hull.size(), 4U);
}

TEST(MeshReport, UnreadableMeshIsReported) {
  EXPECT_NE(report_mesh("/nowhere/at/all.stl").problem, "");
  const fs::path junk = fs::path(testing::TempDir()) / "junk.stl";
  std::ofstream(junk) << "this is no mesh";
  EXPECT_NE(report_mesh(junk).problem, "");
}

TEST(MeshReport, CacheReturnsSameReportAndRejectsDamage) {
  const MeshReport r = report_mesh(written(cuboid({1, 2, 4}), "cached"));
  const std::string bytes = to_bytes(r, "key");
  const auto back = from_bytes(bytes, "key");
  ASSERT_TRUE(back);
  EXPECT_EQ(to_bytes(*back, "key"), bytes);
  EXPECT_FALSE(from_bytes(bytes, "other key"));
  EXPECT_FALSE(from_bytes("", "key"));
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    std::string broken = bytes;
    broken[i] = static_cast<char>(broken[i] ^ 0x20);
    EXPECT_FALSE(from_bytes(broken, "key")) << "expected an error for a changed byte " << i;
    EXPECT_FALSE(from_bytes(bytes.substr(0, i), "key")) << "expected an error for data cut at " << i;
  }
}

TEST(MeshReport, ChangedFileIsMeasuredAgain) {
  const std::string folder = testing::TempDir() + "doppel_cache";
  fs::remove_all(folder);
  setenv("XDG_CACHE_HOME", folder.c_str(), 1);
  const fs::path file = written(cuboid({1, 1, 1}), "changing");
  EXPECT_NEAR(cached_mesh_report(file).hull_volume, 1.0, 1e-9);
  EXPECT_FALSE(fs::is_empty(folder + "/doppel/meshes"));
  written(cuboid({1, 1, 12.5}), "changing");
  EXPECT_NEAR(cached_mesh_report(file).hull_volume, 12.5, 1e-6);
  unsetenv("XDG_CACHE_HOME");
}

TEST(ShapeReport, UnevenScaleScalesMass) {
  const fs::path file = written(cuboid({1, 1, 1}), "unit");
  const Eigen::Vector3d size(0.1, 0.2, 0.4);
  const auto mesh = report_shape(MeshGeometry{"", size, file.string()});
  const auto box = report_shape(Box{size});
  ASSERT_TRUE(mesh && box);
  EXPECT_NEAR(mesh->solid.volume, box->solid.volume, 1e-12);
  EXPECT_TRUE(mesh->solid.unit.I.isApprox(box->solid.unit.I, 1e-6));
  EXPECT_TRUE(mesh->solid.unit.com.isApprox(0.5 * size, 1e-6));
  EXPECT_TRUE(mesh->bounds.sizes().isApprox(size, 1e-9));
}

TEST(ShapeReport, CapsuleInertiaLiesBetweenCylinderAndSphere) {
  const auto ball = report_shape(Sphere{0.3}), none = report_shape(Capsule{0.3, 0});
  EXPECT_TRUE(ball->solid.unit.I.isApprox(none->solid.unit.I, 1e-9));
  const auto inner = report_shape(Cylinder{0.3, 1}), outer = report_shape(Cylinder{0.3, 1.6});
  const auto capsule = report_shape(Capsule{0.3, 1});
  EXPECT_GT(capsule->solid.unit.I(0, 0), inner->solid.unit.I(0, 0));
  EXPECT_LT(capsule->solid.unit.I(0, 0), outer->solid.unit.I(0, 0));
}

TEST(ConvexHull, HullContainsEveryPoint) {
  const unsigned seed = 7;
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 2000; ++i) points.emplace_back(normal(random), normal(random), normal(random));
  const ConvexHull hull = convex_hull(points);
  EXPECT_GT(hull.volume, 4.0 / 3.0 * std::numbers::pi);
  for (const Eigen::Vector3d& d : even_directions(300)) {
    double all = -1e9, corners = -1e9;
    for (const auto& p : points) all = std::max(all, p.cast<double>().dot(d));
    for (const auto i : hull.vertices) corners = std::max(corners, points[i].cast<double>().dot(d));
    EXPECT_DOUBLE_EQ(all, corners);
  }
}

}  // namespace
}  // namespace doppel
