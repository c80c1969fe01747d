// MoveIt's .scene files. Source: test_planning_scene.cpp:249-310 of moveit_core (jazzy).
#include "doppel/robot/scene_objects/scene_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace doppel {
namespace {

using testing::HasSubstr;

constexpr const char* kNewForm =
    "foobar_scene\n* foo\n0 0 0\n0 0 0 1\n1\nbox\n2.58 1.36 0.31\n1.49257 1.00222 0.170051\n"
    "0 0 4.16377e-05 1\n0 0 1 0.3\n0\n* bar\n0 0 0\n0 0 0 1\n1\ncylinder\n0.02 0.0001\n"
    "0.453709 0.499136 0.355051\n0 0 4.16377e-05 1\n1 0 0 1\n0\n.\n";
constexpr const char* kOldForm =
    "foobar_scene\n* foo\n2\nbox\n.77 0.39 0.05\n0 0 0.025\n0 0 0 1\n0.82 0.75 0.60 1\nbox\n"
    ".77 0.39 0.05\n0 0 1.445\n0 0 0 1\n0.82 0.75 0.60 1\n.\n";

std::string parse_error(const std::string& text) {
  try {
    (void)parse_scene(text, "shelf.scene");
  } catch (const InputError& problem) {
    return problem.what();
  }
  return "";
}

TEST(SceneFile, NewFormHasPosesAndSubframes) {
  const SceneFile scene = parse_scene(kNewForm, "new.scene");
  EXPECT_EQ(scene.name, "foobar_scene");
  ASSERT_EQ(scene.objects.size(), 2u);
  EXPECT_EQ(scene.objects[0].id, "foo");
  EXPECT_EQ(scene.objects[1].id, "bar");
  EXPECT_DOUBLE_EQ(std::get<Box>(scene.objects[0].shapes[0].geometry).size.y(), 1.36);
  EXPECT_DOUBLE_EQ(std::get<Cylinder>(scene.objects[1].shapes[0].geometry).length, 0.0001);
  EXPECT_NEAR(scene.objects[0].shapes[0].X_OS.translation().x(), 1.49257, 1e-12);
  ASSERT_TRUE(scene.objects[0].rgba);
  EXPECT_FLOAT_EQ((*scene.objects[0].rgba)[3], 0.3F);
}

TEST(SceneFile, OldFormHasNeither) {
  const SceneFile scene = parse_scene(kOldForm, "old.scene");
  ASSERT_EQ(scene.objects.size(), 1u);
  ASSERT_EQ(scene.objects[0].shapes.size(), 2u);
  EXPECT_DOUBLE_EQ(scene.objects[0].shapes[1].X_OS.translation().z(), 1.445);
  EXPECT_TRUE(scene.objects[0].X_PO.isApprox(Pose::Identity()));
}

TEST(SceneFile, EveryShapeAndSubframeIsWrittenAndReadAgain) {
  SceneFile scene;
  scene.name = "all shapes";
  SceneObject object;
  object.id = "an object with spaces";
  object.X_PO = make_pose({1, 2, 3}, {0.1, 0.2, 0.3});
  auto mesh = std::make_shared<TriangleMesh>();
  mesh->vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1.5F, 0}, {0, 0, 0.1F}};
  mesh->triangles = {{0, 1, 2}, {0, 3, 1}};
  object.shapes = {{Box{{1, 2, 3}}},
                   {Sphere{0.1}},
                   {Cylinder{0.1, 0.2}},
                   {Cone{0.3, 0.4}},
                   {ScenePlane{{0, 1, 0}, 0.5}},
                   {SharedTriangles(mesh), make_pose({0, 0, 1}, {1, 0, 0})}};
  object.subframes = {{"tip", make_pose({0, 0, 0.1}, {0, 1, 0})}};
  object.rgba = Eigen::Vector4f(0.5F, 0, 0, 1);
  scene.objects.push_back(object);
  const std::string text = write_scene(scene);
  const SceneFile again = parse_scene(text, "again.scene");
  ASSERT_EQ(again.objects.size(), 1u);
  const SceneObject& read = again.objects[0];
  EXPECT_EQ(read.id, object.id);
  EXPECT_TRUE(read.X_PO.isApprox(object.X_PO, 1e-12));
  ASSERT_EQ(read.shapes.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(read.shapes[i].geometry.index(), object.shapes[i].geometry.index());
    EXPECT_TRUE(read.shapes[i].X_OS.isApprox(object.shapes[i].X_OS, 1e-12));
  }
  const auto& triangles = *std::get<SharedTriangles>(read.shapes[5].geometry);
  EXPECT_EQ(triangles.vertices, mesh->vertices);
  EXPECT_EQ(triangles.triangles, mesh->triangles);
  ASSERT_EQ(read.subframes.size(), 1u);
  EXPECT_EQ(read.subframes[0].name, "tip");
  EXPECT_EQ(read.rgba, object.rgba);
}

TEST(SceneFile, DamageIsReportedAtItsPlace) {
  EXPECT_THAT(parse_error(""), HasSubstr("shelf.scene:1:1"));
  EXPECT_THAT(parse_error("name\n* foo\n0 0 0\n0 0 0 1\n1\nbox\n2.58 1.36\n1.4 1.0 box\n"),
              HasSubstr("shelf.scene:8:9: error: 'box' is no number"));
  EXPECT_THAT(parse_error("name\n* foo\n0 0 0\n0 0 0 1\n1\nboxx\n1 1 1\n"),
              HasSubstr("shelf.scene:6:1: error: there is no shape 'boxx'; did you mean 'box'"));
  EXPECT_THAT(parse_error("name\n* foo\n0 0 0\n0 0 0 0\n1\nbox\n1 1 1\n"),
              HasSubstr("shelf.scene:4:1: error: a rotation is a quaternion of length 0"));
  EXPECT_THAT(parse_error("name\n* foo\n1\nmesh\n4000000000 1\n"), HasSubstr("shelf.scene:5:1"));
  EXPECT_THAT(parse_error("name\n* foo\n1\nmesh\n1 1\n0 0 0\n0 -1 0\n"),
              HasSubstr("'-1' cannot be a corner"));
  EXPECT_THAT(parse_error("name\n* foo\n1\nsphere\nnan\n"), HasSubstr("'nan' is no number"));
  EXPECT_THAT(parse_error("name\n* foo\n1\nsphere\n-1\n0 0 0\n0 0 0 1\n0 0 0 0\n.\n"),
              HasSubstr("shelf.scene:2:2: error: object 'foo'"))
      << "a size that is refused is at its object";
  EXPECT_THAT(parse_error("name\n? foo\n"), HasSubstr("'?' is neither"));
  const std::string whole = kNewForm;
  for (std::size_t size = 0; size + 2 < whole.size(); ++size)
    ASSERT_NE(parse_error(whole.substr(0, size)), "") << "cut after " << size << " characters";
}

}  // namespace
}  // namespace doppel
