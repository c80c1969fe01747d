// The operations of MoveIt's planning scene on collision objects. Sources: moveit_core's planning_scene.cpp
// (jazzy), its test_planning_scene.cpp, and subframes_test.cpp of moveit_ros/planning_interface.
#include "doppel/robot/scene_objects/scene_objects.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace doppel {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

Pose moved(double x, double y, double z) {
  return make_pose({x, y, z}, Eigen::Vector3d::Zero());
}

SceneObject box(const std::string& id, const Pose& X_WO, double side = 0.1) {
  SceneObject out;
  out.id = id;
  out.X_PO = X_WO;
  out.shapes.push_back({Box{Eigen::Vector3d::Constant(side)}});
  return out;
}

// The rule and text of what an operation throws; empty: it throws nothing.
template <class Operation>
std::string refusal(Operation operation) {
  try {
    operation();
  } catch (const InputError& problem) {
    return problem.diagnostics().front().rule + ": " + problem.what();
  }
  return "";
}

const SceneObjects::LinkPose kLinks = [](const std::string& link) {
  return link == "hand" ? moved(0, 0, 1) : moved(0, 0, 2);
};

TEST(SceneObjects, AddReplacesShapesAndSubframes) {  // planning_scene.cpp:1901
  SceneObjects scene;
  SceneObject first = box("cup", moved(1, 0, 0));
  first.shapes.push_back({Sphere{0.2}});
  first.subframes = {{"rim", moved(0, 0, 0.1)}};
  scene.add(first);
  scene.add(box("cup", moved(2, 0, 0)));
  ASSERT_NE(scene.find("cup"), nullptr);
  EXPECT_EQ(scene.find("cup")->shapes.size(), 1u);
  EXPECT_DOUBLE_EQ(scene.find("cup")->X_PO.translation().x(), 2);
  EXPECT_FALSE(scene.frame("cup/rim"));
}

// planning_scene.cpp:1915 adds the shapes at their poses in the object that is there, and ignores the pose of
// the message. Not copied: they are where the message says.
TEST(SceneObjects, AppendAddsShapesWhereTheyAreSaidToBe) {
  SceneObjects scene;
  SceneObject first = box("cup", moved(1, 0, 0));
  first.subframes = {{"rim", moved(0, 0, 0.1)}, {"base", moved(0, 0, -0.1)}};
  scene.add(first);
  SceneObject more = box("cup", moved(1, 0, 1));
  more.shapes.front().X_OS = moved(0, 0.5, 0);
  more.subframes = {{"rim", moved(0, 0, 0.3)}};
  scene.append(more);
  const SceneObject& cup = *scene.find("cup");
  ASSERT_EQ(cup.shapes.size(), 2u);
  EXPECT_TRUE((cup.X_PO * cup.shapes[1].X_OS).isApprox(moved(1, 0.5, 1)));
  EXPECT_TRUE(scene.frame("cup/rim")->X_PF.isApprox(moved(1, 0, 1.3))) << "expected the new subframe";
  EXPECT_TRUE(scene.frame("cup/base")->X_PF.isApprox(moved(1, 0, -0.1))) << "expected the old subframe";
  scene.append(box("new", moved(3, 0, 0)));
  EXPECT_NE(scene.find("new"), nullptr) << "expected what is not there to be added";
}

TEST(SceneObjects, MoveKeepsShapesAndTheirPosesUnlessThereIsOneForEach) {  // planning_scene.cpp:1953-1995
  SceneObjects scene;
  SceneObject cup = box("cup", moved(1, 0, 0));
  cup.shapes.push_back({Sphere{0.2}, moved(0, 0, 0.5)});
  scene.add(cup);
  scene.move("cup", moved(5, 0, 0));
  EXPECT_TRUE(scene.find("cup")->shapes[1].X_OS.isApprox(moved(0, 0, 0.5)));
  EXPECT_DOUBLE_EQ(scene.find("cup")->X_PO.translation().x(), 5);
  EXPECT_THAT(refusal([&] { scene.move("cup", moved(6, 0, 0), {moved(0, 0, 0)}); }),
              HasSubstr("has 2 shapes, and 1 poses"));
  EXPECT_DOUBLE_EQ(scene.find("cup")->X_PO.translation().x(), 5) << "expected nothing to be changed";
  scene.move("cup", moved(6, 0, 0), {moved(0, 0, 0), moved(0, 0, 1)});
  EXPECT_TRUE(scene.find("cup")->shapes[1].X_OS.isApprox(moved(0, 0, 1)));
  EXPECT_THAT(refusal([&] { scene.move("cop", moved(0, 0, 0)); }), HasSubstr("did you mean 'cup'"));
}

TEST(SceneObjects, RemoveWithoutNameRemovesAllThatNoLinkHolds) {  // planning_scene.cpp:1931-1936
  SceneObjects scene;
  scene.add(box("a", moved(1, 0, 0)));
  scene.add(box("b", moved(2, 0, 0)));
  scene.add(box("c", moved(3, 0, 0)));
  SceneObject held = box("c", Pose::Identity());
  held.shapes.clear();
  held.link = "hand";
  scene.attach(held, kLinks);
  scene.remove("b");
  EXPECT_EQ(scene.find("b"), nullptr);
  EXPECT_THAT(refusal([&] { scene.remove("b"); }), HasSubstr("scene.unknown_object"));
  EXPECT_THAT(refusal([&] { scene.remove("c"); }), HasSubstr("attached to link 'hand'"));
  scene.remove("");
  EXPECT_EQ(scene.find("a"), nullptr);
  EXPECT_NE(scene.find("c"), nullptr);
}

TEST(SceneObjects, AttachedObjectMovesWithLinkAndIsPutBackWhereItIs) {  // planning_scene.cpp:1536-1772
  SceneObjects scene;
  SceneObject cup = box("cup", moved(0, 0, 3));
  cup.subframes = {{"rim", moved(0, 0, 0.1)}};
  cup.rgba = Eigen::Vector4f(1, 0, 0, 1);
  scene.add(cup);
  SceneObject held;
  held.id = "cup";
  held.link = "hand";
  held.touch_links = {"finger"};
  scene.attach(held, kLinks);
  EXPECT_EQ(scene.frame("cup/rim")->link, "hand");
  EXPECT_TRUE(scene.frame("cup/rim")->X_PF.isApprox(moved(0, 0, 2.1)));
  EXPECT_THAT(scene.find("cup")->touch_links, ElementsAre("finger"));
  EXPECT_THAT(refusal([&] { scene.move("cup", moved(0, 0, 0)); }), HasSubstr("scene.attached"));
  EXPECT_THAT(refusal([&] { scene.detach("cup", "arm", kLinks); }), HasSubstr("not to 'arm'"));
  const SceneObjects::LinkPose raised = [](const std::string&) { return moved(0, 0, 5); };
  scene.detach("cup", "hand", raised);
  EXPECT_TRUE(scene.frame("cup")->link.empty());
  EXPECT_TRUE(scene.frame("cup/rim")->X_PF.isApprox(moved(0, 0, 7.1)));
  EXPECT_EQ(scene.find("cup")->rgba, Eigen::Vector4f(1, 0, 0, 1));
  EXPECT_THAT(refusal([&] { scene.detach("cup", "", raised); }), HasSubstr("is not attached"));
}

TEST(SceneObjects, AttachingWithShapesReplacesAndAppendingExtends) {  // planning_scene.cpp:1620-1680
  SceneObjects scene;
  SceneObject held = box("cup", moved(0, 0, 0.1));
  held.link = "hand";
  held.touch_links = {"left"};
  scene.attach(held, kLinks);
  held.touch_links = {"right"};
  scene.attach(held, kLinks, true);
  EXPECT_EQ(scene.find("cup")->shapes.size(), 2u);
  EXPECT_THAT(scene.find("cup")->touch_links, ElementsAre("left", "right"));
  scene.attach(held, kLinks);
  EXPECT_EQ(scene.find("cup")->shapes.size(), 1u);
  EXPECT_THAT(scene.find("cup")->touch_links, ElementsAre("right"));
  scene.detach("", "hand", kLinks);
  EXPECT_TRUE(scene.find("cup")->link.empty());
}

TEST(SceneObjects, OctomapKeepsItsName) {  // planning_scene.cpp:1545, 1776
  SceneObjects scene;
  EXPECT_THAT(refusal([&] { scene.add(box(kOctomapId, moved(0, 0, 0))); }), HasSubstr("<octomap>"));
  SceneObject held = box(kOctomapId, moved(0, 0, 0));
  held.link = "hand";
  EXPECT_THAT(refusal([&] { scene.attach(held, kLinks); }), HasSubstr("cannot be attached"));
  const auto cells = std::make_shared<const std::vector<Eigen::AlignedBox3d>>(
      1, Eigen::AlignedBox3d(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones()));
  scene.set_octomap(cells, moved(1, 0, 0));
  EXPECT_NE(scene.find(kOctomapId), nullptr);
  scene.set_octomap(nullptr, moved(1, 0, 0));
  EXPECT_EQ(scene.find(kOctomapId), nullptr);
}

TEST(SceneObjects, ObjectBeyondTheirNumberIsRefused) {
  SceneObjects scene;
  for (std::size_t i = 0; i < kMaxSceneObjects; ++i)
    scene.add(box("box" + std::to_string(i), moved(1, 0, 0)));
  EXPECT_THAT(refusal([&] { scene.add(box("more", moved(1, 0, 0))); }), HasSubstr("scene.count: "));
  EXPECT_THAT(refusal([&] { scene.append(box("more", moved(1, 0, 0))); }), HasSubstr("scene.count: "));
  SceneObject held = box("more", moved(0, 0, 0.1));
  held.link = "hand";
  EXPECT_THAT(refusal([&] { scene.attach(held, kLinks); }), HasSubstr("scene.count: "));
  const auto cells = std::make_shared<const std::vector<Eigen::AlignedBox3d>>(
      1, Eigen::AlignedBox3d(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones()));
  EXPECT_THAT(refusal([&] { scene.set_octomap(cells, moved(1, 0, 0)); }), HasSubstr("scene.count: "));
  EXPECT_EQ(scene.all().size(), kMaxSceneObjects);
  EXPECT_EQ(refusal([&] { scene.add(box("box0", moved(2, 0, 0))); }), "") << "it replaces one";
  scene.remove("box1");
  EXPECT_EQ(refusal([&] { scene.add(box("more", moved(1, 0, 0))); }), "");
}

TEST(SceneObjects, FramesAreFoundByLongestNamesWithSlashes) {  // subframes_test.cpp:185
  SceneObjects scene;
  SceneObject shelf = box("room/shelf", moved(1, 0, 0));
  shelf.subframes = {{"top/left", moved(0, 0.5, 0)}};
  scene.add(shelf);
  scene.add(box("room", moved(9, 0, 0)));
  EXPECT_TRUE(scene.frame("room/shelf")->X_PF.isApprox(moved(1, 0, 0)));
  EXPECT_TRUE(scene.frame("room/shelf/top/left")->X_PF.isApprox(moved(1, 0.5, 0)));
  EXPECT_FALSE(scene.frame("room/shelf/top"));
  EXPECT_FALSE(scene.frame("shelf"));
  EXPECT_THAT(scene.frame_names(), ElementsAre("room", "room/shelf", "room/shelf/top/left"));
}

TEST(SceneObjects, DamagedObjectsAreRefusedWithTheirReason) {
  SceneObjects scene;
  const auto with = [](ObjectShape shape) {
    SceneObject out;
    out.id = "x";
    out.shapes.push_back(std::move(shape));
    return out;
  };
  const auto mesh = [&](std::vector<Eigen::Vector3f> vertices,
                        std::vector<std::array<std::uint32_t, 3>> triangles) {
    auto out = std::make_shared<TriangleMesh>();
    out->vertices = std::move(vertices);
    out->triangles = std::move(triangles);
    return with({SharedTriangles(out)});
  };
  const Eigen::Vector3f o(0, 0, 0), x(1, 0, 0), y(0, 1, 0);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(refusal([&] { scene.add(SceneObject{"x"}); }), HasSubstr("has no shapes"));
  EXPECT_THAT(refusal([&] { scene.add(box("", moved(0, 0, 0))); }), HasSubstr("has no name"));
  EXPECT_THAT(refusal([&] { scene.add(with({Box{{1, 0, 1}}})); }), HasSubstr("scene.shape"));
  EXPECT_THAT(refusal([&] { scene.add(with({Sphere{-1}})); }), HasSubstr("scene.shape"));
  EXPECT_THAT(refusal([&] { scene.add(with({Cone{0.1, 1e9}})); }), HasSubstr("scene.shape"));
  EXPECT_THAT(refusal([&] { scene.add(with({ScenePlane{{0, 0, 0}, 1}})); }), HasSubstr("has no direction"));
  EXPECT_THAT(refusal([&] { scene.add(mesh({o, x, y}, {})); }), HasSubstr("has no triangles"));
  EXPECT_THAT(refusal([&] { scene.add(mesh({o, x, y}, {{0, 1, 3}})); }), HasSubstr("the corner 3"));
  EXPECT_THAT(refusal([&] {
                scene.add(mesh({o, x, {0, nan, 0}}, {{0, 1, 2}}));
              }),
              HasSubstr("vertex 2 of a mesh is not finite"));
  EXPECT_THAT(refusal([&] { scene.add(box("far", moved(1e5, 0, 0))); }), HasSubstr("scene.shape"));
  EXPECT_TRUE(scene.all().empty());
  EXPECT_EQ(refusal([&] { scene.add(mesh({o, x, y}, {{0, 1, 2}})); }), "");
}

// A sphere that moves among one object.
class Probe {
 public:
  explicit Probe(const ObjectShape& shape) {
    SceneObject object;
    object.id = "object";
    object.shapes.push_back(shape);
    SceneObject probe;
    probe.id = "probe";
    auto ball = std::make_shared<TriangleMesh>();
    for (const float z : {-0.01F, 0.01F}) {
      for (const float a : {-0.01F, 0.01F}) {
        ball->vertices.emplace_back(a, 0, z);
        ball->vertices.emplace_back(0, a, z);
      }
    }
    ball->triangles = {{0, 1, 2}, {1, 2, 3}, {4, 5, 6}, {5, 6, 7},
                       {0, 1, 4}, {2, 3, 6}, {1, 4, 5}, {3, 6, 7}};
    probe.shapes.push_back({SharedTriangles(ball)});
    SceneInstance moving = scene_instance(probe, Pose::Identity());
    moving.moves = true;
    context_.emplace(
        std::make_shared<const CollisionScene>(std::vector{moving, scene_instance(object, Pose::Identity())},
                                               SceneOptions{.detail = CollisionDetail::triangles}));
  }
  bool touches(double x, double y, double z) {
    context_->set_root(0, moved(x, y, z));
    return context_->in_collision(-kTouching);  // hulls do not count
  }

 private:
  std::optional<CollisionContext> context_;
};

TEST(SceneObjects, PlaneIsFreeOnBothSides) {
  Probe plane({ScenePlane{{0, 0, 2}, -1}, moved(0, 0, 1)});  // z = 0.5 in the shape, 1.5 in the world
  EXPECT_TRUE(plane.touches(3, -4, 1.505));
  EXPECT_TRUE(plane.touches(3, -4, 1.495));
  EXPECT_FALSE(plane.touches(3, -4, 1.53));
  EXPECT_FALSE(plane.touches(3, -4, 1.47));
  EXPECT_FALSE(plane.touches(0, 0, 0.5));
}

TEST(SceneObjects, CylinderHasFlatEndsAndConeItsTip) {
  Probe cylinder({Cylinder{0.2, 1}});
  EXPECT_TRUE(cylinder.touches(0.18, 0, 0.49)) << "a capsule is not there";
  EXPECT_FALSE(cylinder.touches(0, 0, 0.52));
  Probe cone({Cone{0.2, 1}});
  EXPECT_TRUE(cone.touches(0, 0, 0.49));
  EXPECT_FALSE(cone.touches(0.18, 0, 0.4));
  EXPECT_TRUE(cone.touches(0.18, 0, -0.49));
}

TEST(SceneObjects, HollowAndOpenMeshesAreFreeInside) {
  // The walls and floor of a bin without a lid, whose hull is full.
  auto bin = std::make_shared<TriangleMesh>();
  for (const float z : {0.0F, 1.0F}) {
    for (const auto& [x, y] : {std::pair{-1.0F, -1.0F}, {1.0F, -1.0F}, {1.0F, 1.0F}, {-1.0F, 1.0F}})
      bin->vertices.emplace_back(x, y, z);
  }
  bin->triangles = {{0, 1, 2}, {0, 2, 3}};
  for (std::uint32_t i = 0; i < 4; ++i) {
    const std::uint32_t next = (i + 1) % 4;
    bin->triangles.push_back({i, next, next + 4});
    bin->triangles.push_back({i, next + 4, i + 4});
  }
  Probe probe({SharedTriangles(bin)});
  EXPECT_FALSE(probe.touches(0, 0, 0.5)) << "inside the bin";
  EXPECT_FALSE(probe.touches(0, 0, 1.0)) << "where its lid would be";
  EXPECT_TRUE(probe.touches(0, 0, 0.005));
  EXPECT_TRUE(probe.touches(1, 0, 0.5));
  EXPECT_FALSE(probe.touches(1.1, 0, 0.5));
}

}  // namespace
}  // namespace doppel
