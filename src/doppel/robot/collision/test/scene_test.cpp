// Which pairs a scene tests, and what its queries report of robots, objects, what is held, and the ground.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "doppel/description/meshes/heightmap.h"
#include "doppel/description/urdf/load.h"
#include "doppel/robot/collision/collision_scene.h"

namespace doppel {
namespace {

using testing::Contains;
using testing::IsEmpty;

// Three balls on a rail: each slides along x from its own place, 1 m apart.
constexpr const char* kBeads = R"(<robot name="beads"><link name="rail"/>
<link name="first"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>
<link name="second"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>
<link name="tip"><collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link>
<joint name="x1" type="prismatic"><parent link="rail"/><child link="first"/><origin xyz="0 0 0.5"/>
<axis xyz="1 0 0"/><limit lower="-5" upper="5" effort="1" velocity="1"/></joint>
<joint name="x2" type="prismatic"><parent link="rail"/><child link="second"/><origin xyz="1 0 0.5"/>
<axis xyz="1 0 0"/><limit lower="-5" upper="5" effort="1" velocity="1"/></joint>
<joint name="weld" type="fixed"><parent link="second"/><child link="tip"/><origin xyz="0 0 0.1"/></joint>
</robot>)";

SceneInstance beads() {
  PackageResolver resolver;
  Diagnostics diagnostics;
  const RobotDescription robot = parse_urdf(kBeads, "beads.urdf", resolver, diagnostics);
  SceneInstance out = described_robot(robot, compile_model(robot, BaseKind::fixed, diagnostics));
  out.description = nullptr;
  return out;
}

SceneInstance object(const std::string& name, const Geometry& shape, const Eigen::Vector3d& position) {
  SceneInstance out;
  out.name = name;
  out.shapes = {{collision_shape(shape, nullptr, Pose::Identity(), Friction{})}};
  out.X_WR.translation() = position;
  return out;
}

Eigen::VectorXd q(double first, double second) {
  return Eigen::Vector2d(first, second);
}

constexpr BodyId kFirst{0, 1}, kSecond{0, 2}, kTip{0, 3};

std::string reason(const CollisionScene& scene, BodyId a, BodyId b) {
  for (const AllowedPair& pair : scene.allowed_pairs()) {
    if (pair.a == a && pair.b == b) return pair.reason;
  }
  return "";
}

TEST(CollisionScene, AllowedPairsHaveTheirReason) {
  std::vector instances{beads(), object("table", Box{{1, 1, 1}}, {0, 5, 0}),
                        object("wall", Box{{1, 1, 1}}, {9, 9, 9})};
  SceneOptions options;
  options.ground = true;
  options.allowed = {{kFirst, {1, 0}, "excluded by the SRDF"}};
  const CollisionScene scene(instances, options);
  EXPECT_EQ(reason(scene, kSecond, kTip), "one rigid body");
  EXPECT_EQ(reason(scene, {1, 0}, {2, 0}), "both fixed to the world");
  EXPECT_EQ(reason(scene, {}, {1, 0}), "both fixed to the world");
  EXPECT_EQ(reason(scene, kFirst, {1, 0}), "excluded by the SRDF");
  EXPECT_THAT(scene.tested_pairs(), Contains(std::pair(kFirst, kSecond)));
  EXPECT_THAT(scene.tested_pairs(), Contains(std::pair(kFirst, kTip)));
  EXPECT_THAT(scene.tested_pairs(), Contains(std::pair(kTip, BodyId{1, 0})));
  EXPECT_THAT(scene.tested_pairs(), Contains(std::pair(BodyId{}, kTip)));
  EXPECT_EQ(scene.tested_pairs().size() + scene.allowed_pairs().size(), 15u) << "six bodies";
  EXPECT_FALSE(scene.has_shape({0, 0}));
}

TEST(CollisionScene, PairsAllowedLaterEqualPairsAllowedAtStart) {
  std::vector instances{beads(), object("table", Box{{1, 1, 1}}, {0, 5, 0})};
  SceneOptions options;
  options.allowed = {{kFirst, {1, 0}, "excluded by the SRDF"}, {kSecond, kTip, "never said again"}};
  const CollisionScene whole(instances, options);
  const auto later = CollisionScene(instances).allowing(options.allowed);
  EXPECT_EQ(later->tested_pairs(), whole.tested_pairs());
  ASSERT_EQ(later->allowed_pairs().size(), whole.allowed_pairs().size());
  EXPECT_EQ(reason(*later, kFirst, {1, 0}), "excluded by the SRDF");
  EXPECT_EQ(reason(*later, kSecond, kTip), "one rigid body");
  CollisionContext context(later);
  for (std::size_t i = 0; i < later->tested_pairs().size(); ++i) {
    const auto& [a, b] = later->tested_pairs()[i];
    EXPECT_EQ(context.tested_closer(i, 0.5), context.closer(a, b, 0.5));
  }
}

TEST(CollisionScene, NoPairIsTestedWithoutSelfCollision) {
  SceneInstance robot = beads();
  robot.self_collision = false;
  const CollisionScene scene({robot});
  EXPECT_THAT(scene.tested_pairs(), IsEmpty());
  EXPECT_EQ(reason(scene, kFirst, kSecond), "self-collision is off");
}

TEST(CollisionContext, DistanceNamesNearestShapesAndTheirPoints) {
  CollisionContext context(std::make_shared<const CollisionScene>(std::vector{beads()}));
  context.set_configuration(0, q(0.3, 0));
  const PairDistance found = context.distance();
  EXPECT_EQ(found.a, kFirst);
  EXPECT_EQ(found.b, kSecond);
  EXPECT_EQ(found.shape_b, (ShapeId{2, 0, 0}));
  EXPECT_NEAR(found.distance, 0.5, 1e-9);
  EXPECT_LT((found.p_a_W - Eigen::Vector3d(0.4, 0, 0.5)).norm(), 1e-9);
  EXPECT_LT((found.p_b_W - Eigen::Vector3d(0.9, 0, 0.5)).norm(), 1e-9);
  EXPECT_LT((found.normal_W - Eigen::Vector3d::UnitX()).norm(), 1e-9);
  EXPECT_EQ(context.distance(0.4).distance, kFarAway) << "nothing is within 0.4 m";
  EXPECT_FALSE(context.in_collision());
  EXPECT_TRUE(context.in_collision(0.51));
  EXPECT_THAT(context.contacts(), IsEmpty());
}

TEST(CollisionContext, ContactsHaveTheirDepth) {
  CollisionContext context(std::make_shared<const CollisionScene>(std::vector{beads()}));
  context.set_configuration(0, q(0.85, 0));
  EXPECT_TRUE(context.in_collision());
  ASSERT_EQ(context.contacts().size(), 1u);
  EXPECT_NEAR(context.contacts()[0].distance, -0.05, 1e-9);
  context.set_configuration(0, q(0.8, 0));
  EXPECT_TRUE(context.in_collision()) << "face to face";
  EXPECT_FALSE(context.in_collision(-kTouching));
}

TEST(CollisionContext, GroundIsHalfSpace) {
  SceneInstance robot = beads();
  robot.X_WR.translation().z() = -0.45;
  SceneOptions options;
  options.ground = true;
  CollisionContext context(std::make_shared<const CollisionScene>(std::vector{robot}, options));
  const PairDistance found = context.distance({}, kFirst);
  EXPECT_TRUE(found.a.is_ground());
  EXPECT_NEAR(found.distance, -0.05, 1e-9);
  EXPECT_LT((found.normal_W - Eigen::Vector3d::UnitZ()).norm(), 1e-9);
  EXPECT_TRUE(context.in_collision());
  context.set_root(0, Pose::Identity());
  EXPECT_NEAR(context.distance({}, kFirst).distance, 0.4, 1e-9);
}

TEST(CollisionContext, HeldObjectMovesWithItsLinkAndMayTouchIt) {
  SceneInstance can = object("can", Sphere{0.05}, {0, 0, 0});
  can.held = HeldBy{kTip};
  can.held->X_LO.translation().z() = 0.05;
  SceneInstance wall = object("wall", Box{{0.1, 1, 2}}, {2, 0, 0});
  CollisionContext context(std::make_shared<const CollisionScene>(std::vector{beads(), can, wall}));
  const CollisionScene& scene = context.scene();
  EXPECT_EQ(reason(scene, kTip, {1, 0}), "held by tip");
  EXPECT_EQ(reason(scene, kSecond, {1, 0}), "held by tip");
  EXPECT_THAT(scene.tested_pairs(), Contains(std::pair(kFirst, BodyId{1, 0})));
  context.set_configuration(0, q(0, 0.5));
  EXPECT_NEAR(context.distance({1, 0}, {2, 0}).distance, 0.4, 1e-9);
  context.set_configuration(0, q(0, 0.95));
  EXPECT_TRUE(context.closer({1, 0}, {2, 0}, kTouching));

  can.held->touch_links = {1};
  const CollisionScene touched({beads(), can});
  EXPECT_EQ(reason(touched, kFirst, {1, 0}), "a touch link");
}

TEST(CollisionContext, MovingObjectIsTestedAgainstWhatIsFixed) {
  SceneInstance ball = object("ball", Sphere{0.1}, {0, 0, 3});
  ball.moves = true;
  CollisionContext context(
      std::make_shared<const CollisionScene>(std::vector{object("wall", Box{{0.1, 1, 2}}, {2, 0, 0}), ball}));
  EXPECT_FALSE(context.in_collision());
  Pose X = Pose::Identity();
  X.translation() << 1.9, 0, 0;
  context.set_root(1, X);
  EXPECT_TRUE(context.in_collision());
}

TEST(CollisionContext, TerrainIsMeasuredFromBothSides) {
  auto field = std::make_shared<HeightField>();
  field->columns = field->rows = 5;
  field->size = {4, 4};
  field->heights.assign(25, 0.25F);
  SceneInstance terrain;
  terrain.name = "hill";
  terrain.shapes = {{CollisionShape{SharedField(field)}}};
  for (const bool first : {true, false}) {
    std::vector instances{terrain, beads()};
    if (!first) std::swap(instances[0], instances[1]);
    CollisionContext context(std::make_shared<const CollisionScene>(instances));
    const PairDistance found = context.distance({first ? 0 : 1, 0}, {first ? 1 : 0, 1});
    EXPECT_NEAR(found.distance, 0.15, 1e-6);
    EXPECT_NEAR(found.normal_W.z(), first ? 1 : -1, 1e-6) << "from the first body to the second";
    EXPECT_NEAR((first ? found.p_a_W : found.p_b_W).z(), 0.25, 1e-6);
  }
}

TEST(CollisionScene, ShapesOfAnotherModelAreRefused) {
  SceneInstance robot = beads();
  robot.shapes.pop_back();
  EXPECT_THROW(CollisionScene({robot}), std::invalid_argument);
  SceneInstance can = object("can", Sphere{0.05}, {0, 0, 0});
  can.held = HeldBy{{1, 0}};
  EXPECT_THROW(CollisionScene({can, beads()}), std::invalid_argument);
}

}  // namespace
}  // namespace doppel
