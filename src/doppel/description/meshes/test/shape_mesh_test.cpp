// Surfaces of ellipsoids, cones and extrusions; outlines cut into convex parts; parts of COLLADA files.
#include "doppel/description/meshes/shape_mesh.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <random>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/math/mass_properties.h"
#include "doppel/description/meshes/convex_hull.h"

namespace doppel {
namespace {

void expect_closed(const TriangleMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& t : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) ++edges[{t[i], t[(i + 1) % 3]}];
  }
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1);
    EXPECT_EQ(edges.count({edge.second, edge.first}), 1u);
  }
}

double enclosed_volume(const TriangleMesh& mesh) {
  return solid_properties(mesh.vertices, mesh.triangles).volume;
}

TEST(ShapeMesh, SurfacesAreClosedAndFaceOutwards) {
  const double pi = std::numbers::pi;
  const TriangleMesh ball = surface_mesh(Ellipsoid{{0.1, 0.2, 0.3}});
  expect_closed(ball);
  EXPECT_NEAR(enclosed_volume(ball), 4.0 / 3.0 * pi * 0.006, 0.03 * 0.025);
  const TriangleMesh cone = surface_mesh(Cone{0.2, 0.6});
  expect_closed(cone);
  EXPECT_NEAR(enclosed_volume(cone), pi * 0.04 * 0.6 / 3, 0.01 * 0.025);
  const TriangleMesh prism = surface_mesh(Extrusion{{{0, 0}, {1, 0}, {1, 2}, {0, 2}}, 3});
  expect_closed(prism);
  EXPECT_NEAR(enclosed_volume(prism), 6, 1e-6);
}

double polygon_area(const std::vector<Eigen::Vector2d>& polygon) {
  double twice = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
    twice += p.x() * q.y() - p.y() * q.x();
  }
  return twice / 2;
}

TEST(ConvexParts, StarIsCutWithoutLossOfArea) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> radius(0.2, 1.0);
  for (int run = 0; run < 50; ++run) {
    std::vector<Eigen::Vector2d> star;
    const int corners = 5 + run % 20;
    for (int i = 0; i < corners; ++i) {
      const double angle = 2 * std::numbers::pi * i / corners;
      star.emplace_back(radius(random) * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
    }
    const double whole = polygon_area(star);
    if (run % 2 == 1) std::reverse(star.begin(), star.end());
    double sum = 0;
    for (const auto& part : convex_parts(star)) {
      sum += polygon_area(part);
      for (std::size_t i = 0; i < part.size(); ++i) {
        const Eigen::Vector2d a = part[(i + 1) % part.size()] - part[i];
        const Eigen::Vector2d b = part[(i + 2) % part.size()] - part[(i + 1) % part.size()];
        EXPECT_GE(a.x() * b.y() - a.y() * b.x(), 0);
      }
    }
    EXPECT_NEAR(sum, whole, 1e-9);
  }
}

TEST(ConvexParts, ConvexOutlineIsOnePart) {
  EXPECT_EQ(convex_parts({{0, 0}, {1, 0}, {1, 1}, {0.5, 1.5}, {0, 1}}).size(), 1u);
  EXPECT_TRUE(convex_parts({{0, 0}, {1, 0}}).empty());
  EXPECT_TRUE(convex_parts({{0, 0}, {1, 0}, {2, 0}}).empty());
}

TEST(Submesh, OnlyNamedPartIsLoadedAndCentred) {
  const auto file = std::filesystem::path(::testing::TempDir()) / "two_parts.dae";
  const auto triangle = [](const std::string& id, const std::string& points) {
    return "<geometry id='" + id + "' name='" + id + "'><mesh><source id='" + id + "-p'><float_array id='" +
           id + "-a' count='9'>" + points + "</float_array><technique_common><accessor source='#" + id +
           "-a' count='3' stride='3'/></technique_common></source><vertices id='" + id +
           "-v'><input semantic='POSITION' source='#" + id +
           "-p'/></vertices><triangles count='1'><input "
           "semantic='VERTEX' source='#" +
           id + "-v' offset='0'/><p>0 1 2</p></triangles></mesh></geometry>";
  };
  std::ofstream(file) << "<COLLADA version='1.4.1'><library_geometries>"
                      << triangle("one", "0 0 0 1 0 0 0 1 0") << triangle("two", "4 0 0 6 0 0 4 2 0")
                      << "</library_geometries><library_visual_scenes><visual_scene id='s'>"
                         "<node name='left'><instance_geometry url='#one'/></node>"
                         "<node name='right'><instance_geometry url='#two'/></node></visual_scene>"
                         "</library_visual_scenes><scene><instance_visual_scene url='#s'/></scene></COLLADA>";
  MeshGeometry mesh;
  mesh.path = file.string();
  EXPECT_EQ(load_mesh(mesh).triangles.size(), 2u);
  mesh.submesh = "right";
  EXPECT_EQ(load_mesh(mesh).bounds().min().x(), 4);
  mesh.center_submesh = true;
  EXPECT_EQ(load_mesh(mesh).bounds().min().x(), -1);
  mesh.submesh = "rihgt";
  EXPECT_THROW(load_mesh(mesh), InputError);
}

TEST(ConvexOutline, CornersAreCounterClockwiseWithoutInnerPoints) {
  const std::vector<Eigen::Vector2d> points = {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0.5, 0.5}, {0.5, 0}, {1, 1}};
  const std::vector<Eigen::Vector2d> expected = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  EXPECT_EQ(convex_outline(points), expected);
  EXPECT_TRUE(convex_outline({}).empty());
}

}  // namespace
}  // namespace doppel
