#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>

#include "doppel/base/images/image.h"
#include "doppel/sensors/render/scene_builder.h"

namespace doppel {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

// The volume inside, by the divergence theorem; also that every normal is on the side of its triangle.
double volume_of(const SurfaceMesh& mesh) {
  double volume = 0;
  for (const auto& t : mesh.triangles) {
    const Vector3d a = mesh.positions[t[0]].cast<double>(), b = mesh.positions[t[1]].cast<double>(),
                   c = mesh.positions[t[2]].cast<double>();
    volume += a.dot(b.cross(c)) / 6;
    const Vector3f face = (b - a).cross(c - a).cast<float>();
    for (const std::uint32_t corner : t) EXPECT_GT(mesh.normals[corner].dot(face), -1e-6F);
  }
  return volume;
}

TEST(SurfaceOfShape, EnclosesVolumeOfClosedForm) {
  constexpr double pi = std::numbers::pi;
  EXPECT_NEAR(volume_of(surface_of(Box{{0.2, 0.3, 0.4}})), 0.024, 1e-8);
  EXPECT_NEAR(volume_of(surface_of(Sphere{0.1})), 4.0 / 3 * pi * 1e-3, 1e-5);
  EXPECT_NEAR(volume_of(surface_of(Cylinder{0.1, 0.5})), pi * 0.01 * 0.5, 2e-5);
  EXPECT_NEAR(volume_of(surface_of(Capsule{0.1, 0.5})), pi * 0.01 * 0.5 + 4.0 / 3 * pi * 1e-3, 3e-5);
  EXPECT_NEAR(volume_of(surface_of(Cone{0.1, 0.3})), pi * 0.01 * 0.1, 2e-5);
  EXPECT_NEAR(volume_of(surface_of(Ellipsoid{{0.1, 0.2, 0.3}})), 4.0 / 3 * pi * 0.006, 5e-5);
  EXPECT_NEAR(volume_of(surface_of(Extrusion{{{0, 0}, {0.2, 0}, {0.2, 0.1}, {0, 0.1}}, 0.5})), 0.01, 1e-8);
}

TEST(SurfaceOfShape, ChordsOfCircleDeviateByLessThanStated) {
  for (const double radius : {0.005, 0.05, 0.3, 0.66}) {
    const SurfaceMesh mesh = surface_of(Cylinder{radius, 1});
    for (const auto& t : mesh.triangles)
      for (int k = 0; k < 3; ++k) {
        const Vector3f a = mesh.positions[t[static_cast<std::size_t>(k)]],
                       b = mesh.positions[t[static_cast<std::size_t>((k + 1) % 3)]];
        if (std::hypot(a.x(), a.y()) < 0.9 * radius || std::hypot(b.x(), b.y()) < 0.9 * radius) continue;
        const Vector3f middle = (a + b) / 2;
        EXPECT_GT(std::hypot(middle.x(), middle.y()), radius - 1.02 * kChordError) << radius;
      }
  }
}

TEST(VertexNormals, AreSmoothBelowCreaseAndSharpAboveIt) {
  // Two faces that meet at an edge along y, tilted by +-20 and then +-50 degrees.
  for (const double tilt : {20.0, 50.0}) {
    const double a = tilt * std::numbers::pi / 180;
    const auto c = static_cast<float>(std::cos(a)), s = static_cast<float>(std::sin(a));
    const SurfaceMesh mesh =
        with_normals({{0, 0, 0}, {0, 1, 0}, {-c, 0, -s}, {c, 0, -s}}, {{0, 1, 2}, {0, 3, 1}}, 0.9);
    const Vector3f at_edge = mesh.normals[0];
    EXPECT_NEAR(at_edge.z(), 2 * a < 0.9 ? 1 : c, 1e-6);
  }
}

class MeshFileTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("doppel_scene_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string write(const std::string& name, const std::string& content) {
    std::ofstream(folder_ / name, std::ios::binary) << content;
    return (folder_ / name).string();
  }
  std::filesystem::path folder_;
};

TEST_F(MeshFileTest, ObjKeepsColourAndTextureOfEachPart) {
  Bitmap picture{2, 2, 3, std::vector<std::uint8_t>(12, 200)};
  write("wood.png", encode_png(picture));
  write("a.mtl",
        "newmtl red\nKd 1 0 0\nnewmtl wood\nKd 1 1 1\nmap_Kd wood.png\nnewmtl lost\nmap_Kd gone.png\n");
  const std::string file =
      write("a.obj",
            "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvt 0 1\n"
            "usemtl red\nf 1 2 3\nusemtl wood\nf 1/1 2/2 4/3\nusemtl lost\nf 2/1 3/2 4/3\n");
  const MeshAppearance loaded = load_appearance({"a.obj", Vector3d(2, 2, 2), file, "", false});
  ASSERT_EQ(loaded.mesh.parts.size(), 3U);
  EXPECT_EQ(loaded.mesh.triangles.size(), 3U);
  const auto material = [&](std::size_t part) {
    return loaded.materials[static_cast<std::size_t>(loaded.mesh.parts[part].material)];
  };
  EXPECT_EQ(material(0).rgba, Eigen::Vector4f(1, 0, 0, 1));
  EXPECT_EQ(material(0).texture, -1);
  ASSERT_GE(material(1).texture, 0);
  EXPECT_EQ(loaded.textures[static_cast<std::size_t>(material(1).texture)].path,
            (folder_ / "wood.png").string());
  EXPECT_THAT(loaded.remarks, testing::ElementsAre(testing::HasSubstr("gone.png")));
  float largest = 0;
  for (const Vector3f& p : loaded.mesh.positions) largest = std::max(largest, p.maxCoeff());
  EXPECT_EQ(largest, 2);
}

TEST_F(MeshFileTest, CornerThatIsNoNumberIsRefusedAndColourHasDefault) {
  write("nan.mtl", "newmtl m\nKd nan 0.5 2\nNs nan\n");
  const auto file = [&](const char* x) {
    return write("nan.obj", std::string("mtllib nan.mtl\nv ") + x +
                                " 0 0\nv 1 0 0\nv 0 1 0\nvn nan 0 0\nusemtl m\nf 1//1 2//1 3//1\n");
  };
  const auto load = [&](const char* x) {
    return load_appearance({"nan.obj", Vector3d::Ones(), file(x), "", false});
  };
  EXPECT_THROW((void)load("nan"), InputError);
  const MeshAppearance loaded = load("0");
  for (const Vector3f& normal : loaded.mesh.normals) EXPECT_EQ(normal, Vector3f::UnitZ());
  const auto own = static_cast<std::size_t>(loaded.mesh.parts.at(0).material);
  EXPECT_EQ(loaded.materials.at(own).rgba, Eigen::Vector4f(0, 0.5F, 1, 1));
  EXPECT_TRUE(std::isfinite(loaded.materials.at(own).shininess));
}

TEST_F(MeshFileTest, MissingMeshIsWarningAndRestIsSeen) {
  Link link;
  Visual lost, seen;
  lost.geometry =
      MeshGeometry{"package://r/gone.stl", Vector3d::Ones(), (folder_ / "gone.stl").string(), "", false};
  seen.geometry = Box{{1, 1, 1}};
  link.visuals = {lost, seen};
  SceneBuilder builder;
  Diagnostics diagnostics;
  EXPECT_EQ(builder.add(link, "r::base", diagnostics), 0);
  const auto scene = builder.finish();
  EXPECT_EQ(scene->items.size(), 1U);
  EXPECT_EQ(scene->bodies[0].name, "r::base");
  EXPECT_EQ(scene->lights.size(), 1U);
  ASSERT_EQ(diagnostics.all().size(), 1U);
  EXPECT_EQ(diagnostics.all()[0].rule, "scene.mesh");
}

TEST_F(MeshFileTest, TextureOfSeveralMeshesAndMaterialIsReadOnce) {
  write("wood.png", encode_png({2, 2, 3, std::vector<std::uint8_t>(12, 200)}));
  write("a.mtl", "newmtl wood\nmap_Kd wood.png\n");
  const std::string file = write("a.obj",
                                 "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n"
                                 "usemtl wood\nf 1/1 2/2 3/3\n");
  Link link;
  Visual small, large, box;
  small.geometry = MeshGeometry{"a.obj", Vector3d::Ones(), file, "", false};
  large.geometry = MeshGeometry{"a.obj", Vector3d(2, 2, 2), file, "", false};
  box.geometry = Box{{1, 1, 1}};
  box.material = Material{"wood", std::nullopt, "", (folder_ / "wood.png").string(), {}};
  link.visuals = {small, large, box};
  SceneBuilder builder;
  Diagnostics diagnostics;
  builder.add(link, "r::base", diagnostics);
  const auto scene = builder.finish();
  EXPECT_EQ(scene->meshes.size(), 3U);
  ASSERT_EQ(scene->textures.size(), 1U);
  EXPECT_EQ(scene->textures[0].width, 2);
  int textured = 0;
  for (const SurfaceMaterial& material : scene->materials) textured += material.texture == 0 ? 1 : 0;
  EXPECT_EQ(textured, 3);
  EXPECT_TRUE(diagnostics.all().empty());
}

TEST_F(MeshFileTest, FileOfTwoVisualsIsReadOnce) {
  const std::string file = write("t.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  Link link;
  Visual visual;
  visual.geometry = MeshGeometry{"t.obj", Vector3d::Ones(), file, "", false};
  visual.material = Material{"green", Eigen::Vector4d(0, 1, 0, 1), "", "", {}};
  link.visuals = {visual, visual};
  SceneBuilder builder;
  Diagnostics diagnostics;
  builder.add(link, "r::base", diagnostics);
  const auto scene = builder.finish();
  EXPECT_EQ(scene->meshes.size(), 1U);
  ASSERT_EQ(scene->items.size(), 2U);
  EXPECT_EQ(scene->meshes[0]->parts[0].material, -1);
  EXPECT_EQ(scene->materials[static_cast<std::size_t>(scene->items[0].material)].rgba,
            Eigen::Vector4f(0, 1, 0, 1));
}

Link link_with_missing_mesh() {
  Link link;
  link.name = "base";
  Visual visual;
  visual.geometry = MeshGeometry{"package://gone/a.stl", Vector3d::Ones(), "", "", false};
  link.visuals = {visual};
  return link;
}

TEST(SceneBuilder, MissingMeshIsNothingForSensors) {
  SceneBuilder builder;
  Diagnostics diagnostics;
  builder.add(link_with_missing_mesh(), "r::base", diagnostics);
  EXPECT_TRUE(builder.finish()->items.empty());
}

TEST(SceneBuilder, MissingMeshIsHatchedRedBoxInPictures) {
  SceneBuilder builder;
  builder.mark_missing_meshes();
  Diagnostics diagnostics;
  builder.add(link_with_missing_mesh(), "r::base", diagnostics);
  const auto scene = builder.finish();
  ASSERT_EQ(scene->items.size(), 1u);
  const SurfaceMesh& box = *scene->meshes[static_cast<std::size_t>(scene->items[0].mesh)];
  EXPECT_NEAR(volume_of(box), 1e-3, 1e-8);
  ASSERT_EQ(box.uvs.size(), box.positions.size());
  const SurfaceMaterial& material = scene->materials[static_cast<std::size_t>(scene->items[0].material)];
  ASSERT_GE(material.texture, 0);
  const Bitmap& stripes = scene->textures[static_cast<std::size_t>(material.texture)];
  EXPECT_GT(stripes.pixels[0], 2 * stripes.pixels[1]) << "expected red";
  EXPECT_NE(stripes.pixels[1], stripes.pixels[3 * 8 + 1]) << "expected stripes";
}

TEST(SceneBuilder, MissingMeshIsCollisionShapeInPictures) {
  Link link = link_with_missing_mesh();
  link.visuals.push_back(link.visuals.front());
  Collision collision;
  collision.geometry = Sphere{0.1};
  link.collisions = {collision};
  SceneBuilder builder;
  builder.mark_missing_meshes();
  Diagnostics diagnostics;
  builder.add(link, "r::base", diagnostics);
  const auto scene = builder.finish();
  ASSERT_EQ(scene->items.size(), 1u) << "expected the shape once for two missing files";
  EXPECT_NEAR(volume_of(*scene->meshes[static_cast<std::size_t>(scene->items[0].mesh)]),
              4.0 / 3 * std::numbers::pi * 1e-3, 1e-5);
}

}  // namespace
}  // namespace doppel
