#include "doppel/description/meshes/mesh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <random>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/math/mass_properties.h"
#include "doppel/description/meshes/detail/mesh.h"

namespace doppel {
namespace {

const Eigen::Vector3d kOnes = Eigen::Vector3d::Ones();

std::string binary_stl(const std::vector<std::array<Eigen::Vector3f, 3>>& triangles) {
  std::string out(80, ' ');
  const auto put = [&out](const void* p, std::size_t n) { out.append(static_cast<const char*>(p), n); };
  const auto count = static_cast<std::uint32_t>(triangles.size());
  put(&count, 4);
  for (const auto& t : triangles) {
    const std::array<float, 3> normal{};
    put(normal.data(), 12);
    for (const auto& p : t) put(p.data(), 12);
    const std::uint16_t attributes = 0;
    put(&attributes, 2);
  }
  return out;
}

std::vector<std::array<Eigen::Vector3f, 3>> tetrahedron() {
  const Eigen::Vector3f o(0, 0, 0), x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
  return {{o, y, x}, {o, x, z}, {o, z, y}, {x, y, z}};
}

double volume(const TriangleMesh& mesh) {
  return solid_properties(mesh.vertices, mesh.triangles).volume;
}

std::string refused(std::string_view bytes, std::string_view format) {
  try {
    parse_mesh(bytes, format, "part", kOnes);
  } catch (const InputError& problem) {
    return problem.what();
  }
  return "accepted";
}

TEST(StlReader, BinaryWithSolidHeaderIsRead) {
  std::string bytes = binary_stl(tetrahedron());
  bytes.replace(0, 5, "solid");
  const TriangleMesh mesh = parse_mesh(bytes, "stl", "t.stl", kOnes);
  EXPECT_EQ(mesh.vertices.size(), 4u);
  EXPECT_EQ(mesh.triangles.size(), 4u);
  EXPECT_NEAR(volume(mesh), 1.0 / 6.0, 1e-7);
}

TEST(StlReader, AsciiVariantsAreRead) {
  const TriangleMesh mesh = parse_mesh(
      "solid vertex 1 2 3 facet\r\n facet normal 0 0 1\r\n outer loop\r\n  vertex 0 0 0\r\n  vertex +1.0E0 0 "
      "0\n"
      "\tvertex 0 1e-0 1e-400\nendloop endfacet\nendsolid vertex",
      "stl", "t.stl", kOnes);
  ASSERT_EQ(mesh.triangles.size(), 1u);
  EXPECT_EQ(mesh.vertices[2], Eigen::Vector3f(0, 1, 0));
}

TEST(StlReader, MirroringScaleKeepsOrientation) {
  const std::string bytes = binary_stl(tetrahedron());
  EXPECT_NEAR(volume(parse_mesh(bytes, "stl", "t", {-0.001, 0.001, 0.001})), 1e-9 / 6.0, 1e-15);
}

TEST(StlReader, DeclaredCountBeyondFileIsRefused) {
  std::string bytes = binary_stl(tetrahedron());
  const std::uint32_t two_gigabytes = 2'147'483'648u / 50u;
  std::memcpy(bytes.data() + 80, &two_gigabytes, 4);
  const std::string message = refused(bytes, "stl");
  EXPECT_NE(message.find("declares 42949672 triangles"), std::string::npos) << message;
  EXPECT_NE(message.find("the file has 284"), std::string::npos) << message;
}

TEST(StlReader, InvalidFileIsRefusedWithPlace) {
  EXPECT_NE(refused("", "stl").find("0 bytes are too short"), std::string::npos);
  EXPECT_NE(refused(std::string(1000, '\0'), "stl").find("no triangles"), std::string::npos);
  EXPECT_NE(refused("solid a\nfacet\nouter loop\nvertex 0 0 0\nvertex 1 0\nendloop", "stl").find("part:"),
            std::string::npos);
  EXPECT_NE(refused("solid a\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 0\nendloop", "stl")
                .find("4 vertices"),
            std::string::npos);
  EXPECT_NE(refused("solid a\nouter loop\nvertex 0,5 0 0\n", "stl").find("part:3"), std::string::npos)
      << "expected an error: a decimal comma is not part of a valid number";
  auto bad = tetrahedron();
  bad[1][2].x() = std::nanf("");
  EXPECT_NE(refused(binary_stl(bad), "stl").find("triangle 2"), std::string::npos);
}

TEST(ObjReader, FacesOfEveryFormAreRead) {
  const TriangleMesh mesh = parse_mesh(
      "# a pyramid\nmtllib none.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 0.5 1 1.0\nvn 0 0 1\nvt 0 0\n"
      "f 4/1/1 3/1 2//1 \\\n 1\nf 1 2 -1\nf 2 3 5\nf 3 4 5\nf 4 1 5 # the last\n",
      "obj", "p.obj", kOnes);
  EXPECT_EQ(mesh.vertices.size(), 5u);
  EXPECT_EQ(mesh.triangles.size(), 6u);
  EXPECT_NEAR(volume(mesh), 1.0 / 3.0, 1e-7);
}

TEST(ObjReader, ColourIsThatOfFirstMaterial) {
  const std::string folder = ::testing::TempDir();
  std::ofstream(folder + "doppel_mesh_test.mtl")
      << "newmtl grey\nKd 0.5 0.5 0.5\nnewmtl warm red\nKd 0.8 0.25 0\n";
  const TriangleMesh mesh =
      parse_mesh("mtllib doppel_mesh_test.mtl\nusemtl warm red\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "obj",
                 folder + "m.obj", kOnes);
  ASSERT_TRUE(mesh.rgba);
  EXPECT_EQ(*mesh.rgba, Eigen::Vector4f(0.8F, 0.25F, 0, 1));
}

TEST(ObjReader, MissingVertexIsReported) {
  EXPECT_NE(refused("v 0 0 0\nv 1 0 0\nf 1 2 3\n", "obj").find("part:3"), std::string::npos);
  EXPECT_NE(refused("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 0\n", "obj").find("'0'"), std::string::npos);
  EXPECT_NE(refused("v 0 0\n", "obj").find("three numbers"), std::string::npos);
}

// Star-shaped polygons: however the ears are cut, the signed area is that of the polygon.
TEST(PolygonTriangulation, EarSearchBeyondLimitFallsBackToFans) {
  mesh::TriangleSoup soup;
  std::vector<std::uint32_t> star;
  for (std::uint32_t i = 0; i < mesh::kMaxPolygonCorners; ++i) {
    const double angle = 2 * M_PI * i / mesh::kMaxPolygonCorners, radius = i % 2 == 0 ? 1.0 : 0.2;
    soup.points.emplace_back(radius * std::cos(angle), radius * std::sin(angle), 0);
    star.push_back(i);
  }
  constexpr std::size_t polygons = 20'000;
  for (std::size_t i = 0; i < polygons; ++i) mesh::add_polygon(soup, star);
  EXPECT_EQ(soup.triangles.size(), polygons * (mesh::kMaxPolygonCorners - 2));
  EXPECT_GE(soup.ear_tests, mesh::kMaxEarTests);
  EXPECT_LT(soup.ear_tests, mesh::kMaxEarTests + mesh::kMaxPolygonCorners * mesh::kMaxPolygonCorners);
}

TEST(PolygonTriangulation, EarsCoverPolygonOnce) {
  const unsigned seed = 20261121;
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> radius(0.2F, 1.0F);
  for (int round = 0; round < 300; ++round) {
    mesh::TriangleSoup soup;
    const auto n = static_cast<std::uint32_t>(4 + round % 30);
    std::vector<std::uint32_t> corners;
    const Eigen::Vector3f normal =
        Eigen::Vector3f(radius(random) - 0.6F, radius(random) - 0.6F, 1).normalized();
    const Eigen::Vector3f x = normal.unitOrthogonal(), y = normal.cross(x);
    for (std::uint32_t i = 0; i < n; ++i) {
      const float angle = 6.2831853F * static_cast<float>(i) / static_cast<float>(n), r = radius(random);
      soup.points.push_back(r * std::cos(angle) * x + r * std::sin(angle) * y);
      corners.push_back(i);
    }
    float area = 0, cut = 0, absolute = 0;
    for (std::uint32_t i = 0; i < n; ++i)
      area += soup.points[i].cross(soup.points[(i + 1) % n]).dot(normal) / 2;
    mesh::add_polygon(soup, corners);
    ASSERT_EQ(soup.triangles.size(), n - 2);
    for (const auto& t : soup.triangles) {
      const float part =
          (soup.points[t[1]] - soup.points[t[0]]).cross(soup.points[t[2]] - soup.points[t[0]]).dot(normal) /
          2;
      cut += part;
      absolute += std::abs(part);
    }
    EXPECT_NEAR(cut, area, 1e-4F);
    EXPECT_NEAR(absolute, area, 1e-4F) << "expected no triangle outside of the polygon";
  }
}

std::string collada(const std::string& unit, const std::string& node, const std::string& primitive) {
  return R"(<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset>)" +
         unit + R"(<up_axis>Y_UP</up_axis></asset>
<library_effects><effect id="fx"><profile_COMMON><technique sid="c"><phong><diffuse><color>0.1 0.2 0.3 1</color></diffuse></phong></technique></profile_COMMON></effect></library_effects>
<library_materials><material id="mat"><instance_effect url="#fx"/></material></library_materials>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="12">0 0 0  1 0 0  0 1 0  0 0 1</float_array><technique_common><accessor source="#pa" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>)" +
         primitive + R"(</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s">)" +
         node +
         R"(</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>)";
}
const std::string kShow =
    R"(<instance_geometry url="#g"><bind_material><technique_common><instance_material symbol="m" target="#mat"/></technique_common></bind_material></instance_geometry>)";
const std::string kFaces =
    R"(<triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/><input semantic="NORMAL" source="#p" offset="1"/><p>0 0 2 0 1 0  0 0 1 0 3 0  0 0 3 0 2 0  1 0 2 0 3 0</p></triangles>)";

TEST(ColladaReader, UnitAndNodesAreAppliedWithoutUpAxis) {
  const TriangleMesh mesh = parse_mesh(collada(R"(<unit name="millimeter" meter="0.001"/>)",
                                               "<node><translate>10 20 30</translate><rotate>0 0 1 "
                                               "90</rotate><scale>2 2 2</scale><node><matrix>1 0 0 1 "
                                               "0 1 0 0 0 0 1 0 0 0 0 1</matrix>" +
                                                   kShow + "</node></node>",
                                               kFaces),
                                       "dae", "t.dae", kOnes);
  EXPECT_EQ(mesh.triangles.size(), 4u);
  EXPECT_NEAR(volume(mesh), 8e-9 / 6.0, 1e-14);
  // (x + 1, y, z) doubled, turned by 90 degrees about z, moved, in millimetres.
  EXPECT_TRUE(mesh.bounds().min().isApprox(Eigen::Vector3f(0.008F, 0.022F, 0.030F), 1e-5F))
      << mesh.bounds().min();
  EXPECT_TRUE(mesh.bounds().max().isApprox(Eigen::Vector3f(0.010F, 0.024F, 0.032F), 1e-5F))
      << mesh.bounds().max();
  ASSERT_TRUE(mesh.rgba);
  EXPECT_EQ(*mesh.rgba, Eigen::Vector4f(0.1F, 0.2F, 0.3F, 1));
}

TEST(ColladaReader, MirroringNodeKeepsOrientation) {
  const TriangleMesh mesh = parse_mesh(collada("", "<node><scale>-1 1 1</scale>" + kShow + "</node>", kFaces),
                                       "dae", "t.dae", kOnes);
  EXPECT_NEAR(volume(mesh), 1.0 / 6.0, 1e-7);
}

TEST(ColladaReader, EveryPrimitiveIsRead) {
  const std::string node = "<node>" + kShow + "</node>";
  const std::string input = R"(<input semantic="VERTEX" source="#v" offset="0"/>)";
  for (const std::string& faces :
       {"<polylist count=\"4\">" + input +
            "<vcount>3 3 3 3</vcount><p>0 2 1 0 1 3 0 3 2 1 2 3</p></polylist>",
        "<polygons count=\"4\">" + input + "<p>0 2 1</p><p>0 1 3</p><p>0 3 2</p><p>1 2 3</p></polygons>",
        "<trifans count=\"2\">" + input + "<p>0 2 1 3 2</p><p>1 2 3</p></trifans>",
        "<tristrips count=\"1\">" + input + "<p>0 2 1 3 0 2</p></tristrips>"}) {
    EXPECT_NEAR(volume(parse_mesh(collada("", node, faces), "dae", "t", kOnes)), 1.0 / 6.0, 1e-7) << faces;
  }
}

TEST(ColladaReader, CyclicNodesAreRefused) {
  std::string nodes;
  for (int i = 0; i < 60; ++i) {
    const std::string next = "<instance_node url=\"#n" + std::to_string(i + 1) + "\"/>";
    nodes += "<node id=\"n" + std::to_string(i) + "\">" + next + next + "</node>";
  }
  nodes += "<node id=\"n60\">" + kShow + "</node>";
  EXPECT_NE(refused(collada("", nodes, kFaces), "dae").find("in a cycle"), std::string::npos);
  EXPECT_NE(refused(collada("", R"(<node id="a"><instance_node url="#a"/></node>)", kFaces), "dae")
                .find("in a cycle"),
            std::string::npos);
}

TEST(ColladaReader, FaultsAreReportedWithLine) {
  const std::string node = "<node>" + kShow + "</node>";
  EXPECT_NE(refused(collada("", node, "<triangles><p>0 1 2</p></triangles>"), "dae").find("no VERTEX input"),
            std::string::npos);
  EXPECT_NE(
      refused(
          collada("", node,
                  R"(<triangles><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 9</p></triangles>)"),
          "dae")
          .find("refers to vertex '9', but there are 4"),
      std::string::npos);
  EXPECT_NE(refused("<a/>", "dae").find("not <COLLADA>"), std::string::npos);
}

// An independent reader has to read the same triangles.
TEST(ColladaReader, ResultAgreesWithAssimp) {
  const std::string path = ::testing::TempDir() + "doppel_mesh_test.dae";
  std::ofstream(path) << collada(R"(<unit meter="0.01"/>)",
                                 "<node><translate>1 2 3</translate><rotate>0.6 0 0.8 40</rotate>" + kShow +
                                     "</node><node><scale>1 -2 3</scale>" + kShow + "</node>",
                                 kFaces);
  const TriangleMesh ours = load_mesh(path, kOnes);
  const mesh::TriangleSoup theirs = mesh::read_by_assimp(path);
  Eigen::AlignedBox3f box;
  for (const auto& t : theirs.triangles) {
    for (const auto corner : t) box.extend(theirs.points[corner]);
  }
  EXPECT_EQ(ours.triangles.size(), theirs.triangles.size());
  EXPECT_TRUE(ours.bounds().min().isApprox(box.min(), 1e-5F)) << ours.bounds().min() << "\n" << box.min();
  EXPECT_TRUE(ours.bounds().max().isApprox(box.max(), 1e-5F)) << ours.bounds().max() << "\n" << box.max();
}

}  // namespace
}  // namespace doppel
