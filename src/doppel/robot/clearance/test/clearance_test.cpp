// States and edges against FCL's triangles, and against contacts that are known.
#include "doppel/robot/clearance/clearance.h"

#include <gtest/gtest.h>

#include "doppel/robot/clearance/test/clearance_robots.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

constexpr unsigned kSeed = 23;
constexpr int kStates = 400, kEdges = 12, kPartsOfSpan = 64;

const fs::path& robots() {
  static const fs::path folder = fs::path(DOPPEL_SOURCE_DIR) / "robots";
  return folder;
}

class ClearanceOfRobot : public testing::TestWithParam<const char*> {};

// planning.md B45: "a state that FCL calls touching is never called free"; collision checking of states by
// FCL: planning_scene.cpp of moveit2 jazzy, checkCollision.
TEST_P(ClearanceOfRobot, StateThatTouchesByFclIsNeverFree) {
  SCOPED_TRACE("seed 23");
  const test::TriangleRobot robot = test::load_triangles(GetParam(), robots());
  Clearance clearance(robot.scene, robot.covers);
  CollisionContext context(robot.scene);
  Data data(*robot.model);
  std::mt19937_64 random(kSeed);
  Eigen::MatrixXd states(robot.model->nq, kStates);
  int free = 0, by_spheres = 0;
  std::vector<bool> is_free;
  for (int i = 0; i < kStates; ++i) {
    const Eigen::VectorXd q = test::random_state(*robot.model, random);
    states.col(i) = q;
    const StateClearance found = clearance.state(q);
    is_free.push_back(found.free);
    forward_kinematics(*robot.model, data, q);
    bool touching = false;
    for (const auto& [a, b] : robot.scene->tested_pairs())
      touching = touching || robot.touch(a.link, b.link, data.X_WL);
    ASSERT_EQ(found.free, !touching) << "state " << i;
    free += found.free ? 1 : 0;
    by_spheres += found.by_scene ? 0 : 1;
    if (!found.free) {
      EXPECT_TRUE(robot.touch(found.a.link, found.b.link, data.X_WL)) << "state " << i;
    }
  }
  EXPECT_GT(free, 0);
  EXPECT_GT(by_spheres, 0) << "spheres alone prove some";
  const auto results = std::make_unique<bool[]>(kStates);
  clearance.free_states(states, {results.get(), kStates});
  for (int i = 0; i < kStates; ++i) EXPECT_EQ(results[i], is_free[static_cast<std::size_t>(i)]) << i;
}

// planning.md B45: distances agree with FCL to 1e-4 m (that of hulls: collision/test/fcl_agreement_test.cpp),
// and what the spheres say is never more than the distance of the triangles.
TEST_P(ClearanceOfRobot, BoundOfDistanceIsNotMoreThanDistance) {
  SCOPED_TRACE("seed 23");
  const test::TriangleRobot robot = test::load_triangles(GetParam(), robots());
  Clearance clearance(robot.scene, robot.covers);
  const test::FclReference hulls(robot.scene->instances()[0].shapes);
  Data data(*robot.model);
  std::mt19937_64 random(kSeed);
  int apart = 0;
  for (int i = 0; i < kStates / 8; ++i) {
    const Eigen::VectorXd q = test::random_state(*robot.model, random);
    const double bound = clearance.distance_bound(q), coarse = clearance.distance_bound(q, 1);
    forward_kinematics(*robot.model, data, q);
    double by_hulls = kFarAway;
    bool touching = false;
    for (const auto& [a, b] : robot.scene->tested_pairs()) {
      touching = touching || robot.touch(a.link, b.link, data.X_WL);
      by_hulls = std::min(by_hulls, hulls.distance(a.link, b.link, data.X_WL));
    }
    if (touching) {
      EXPECT_LE(std::max(bound, coarse), 0) << "state " << i;
    }
    const double distance = clearance.distance(q).distance;
    if (by_hulls <= 0) continue;
    ++apart;
    EXPECT_NEAR(distance, by_hulls, 1e-4) << "state " << i;
    EXPECT_LE(bound, by_hulls + 1e-3) << "hulls are reduced by less than a millimetre; state " << i;
    const double near = clearance.distance_bound(q, 2, 1e-3);
    EXPECT_GE(near, std::min(bound, 1e-3)) << "bounding spheres may say more; state " << i;
    EXPECT_LE(near, std::min(std::max(by_hulls, 0.0) + 1e-3, 1e-3)) << "state " << i;
  }
  RecordProperty("apart", apart);
}

// planning.md B46: "certified edges: none touches at 64 times the resolution"; not copied: waypoints only
// (isPathValid, planning_scene.cpp:2365 of moveit2 jazzy).
TEST_P(ClearanceOfRobot, CertifiedEdgeTouchesNowhere) {
  SCOPED_TRACE("seed 23");
  const test::TriangleRobot robot = test::load_triangles(GetParam(), robots());
  Clearance clearance(robot.scene, robot.covers);
  Data data(*robot.model);
  std::mt19937_64 random(kSeed);
  const auto touches_at = [&](const Eigen::VectorXd& q) {
    forward_kinematics(*robot.model, data, q);
    return std::ranges::any_of(robot.scene->tested_pairs(), [&](const auto& pair) {
      return robot.touch(pair.first.link, pair.second.link, data.X_WL);
    });
  };
  int certified = 0, refused = 0;
  for (int i = 0; i < kEdges; ++i) {
    const Eigen::VectorXd q0 = test::random_state(*robot.model, random);
    const Eigen::VectorXd q1 = q0 + 0.3 * (test::random_state(*robot.model, random) - q0);
    const EdgeClearance any = clearance.edge(q0, q1, false), found = clearance.edge(q0, q1);
    EXPECT_EQ(any.free, found.free) << "edge " << i;
    EXPECT_LE(found.parameter, any.parameter) << "edge " << i;
    const Eigen::VectorXd end = q0 + found.parameter * (q1 - q0);
    const int states = kPartsOfSpan * 8;
    for (int k = 0; k < states && found.parameter > 0; ++k)
      ASSERT_FALSE(touches_at(q0 + k * (end - q0) / states)) << "edge " << i << ", part " << k;
    certified += found.free ? 1 : 0;
    if (found.free) continue;
    ++refused;
    if (!found.resolution) {
      EXPECT_TRUE(touches_at(end)) << "edge " << i;
    }
  }
  EXPECT_EQ(certified + refused, kEdges);
  RecordProperty("certified", certified);
}

INSTANTIATE_TEST_SUITE_P(Robots, ClearanceOfRobot,
                         testing::Values("omarm_one", "omarm_zero", "lab_arm", "kate"),
                         [](const auto& robot) { return std::string(robot.param); });

// Two balls on a rail, 1 m apart, of radius 0.1 m: they touch when the first has moved by 0.8 m.
constexpr const char* kRail = R"(<robot name="beads"><link name="rail"/>
<link name="first"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>
<link name="second"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>
<joint name="x1" type="prismatic"><parent link="rail"/><child link="first"/><origin xyz="0 0 0.5"/>
<axis xyz="1 0 0"/><limit lower="-5" upper="5" effort="1" velocity="1"/></joint>
<joint name="x2" type="prismatic"><parent link="rail"/><child link="second"/><origin xyz="1 0 0.5"/>
<axis xyz="1 0 0"/><limit lower="-5" upper="5" effort="1" velocity="1"/></joint>
</robot>)";

// Two balls on the ends of arms of 1 m that turn about one axis.
constexpr const char* kHands = R"(<robot name="hands"><link name="rail"/>
<link name="first"><collision><origin xyz="1 0 0"/>
<geometry><sphere radius="0.1"/></geometry></collision></link>
<link name="second"><collision><origin xyz="0 1 0"/>
<geometry><sphere radius="0.1"/></geometry></collision></link>
<joint name="a" type="continuous"><parent link="rail"/><child link="first"/><axis xyz="0 0 1"/></joint>
<joint name="b" type="continuous"><parent link="rail"/><child link="second"/><axis xyz="0 0 1"/></joint>
</robot>)";

SceneInstance parsed(const char* text) {
  PackageResolver resolver;
  Diagnostics diagnostics;
  const RobotDescription robot = parse_urdf(text, "parsed.urdf", resolver, diagnostics);
  SceneInstance out = described_robot(robot, compile_model(robot, BaseKind::fixed, diagnostics));
  out.description = nullptr;
  return out;
}

Clearance clearance_of(std::vector<SceneInstance> instances, const ClearanceOptions& options = {},
                       const SceneOptions& scene = {}) {
  std::vector<std::shared_ptr<const InstanceCovers>> covers;
  for (const SceneInstance& instance : instances) {
    CoverOptions of_instance;
    of_instance.still = instance.model == nullptr && !instance.held;
    covers.push_back(make_covers(instance, of_instance));
  }
  return {std::make_shared<const CollisionScene>(std::move(instances), scene), covers, options};
}

TEST(CertifiedEdge, ContactOfTwoBallsOnRailIsAtKnownParameter) {
  Clearance clearance = clearance_of({parsed(kRail)});
  const EdgeClearance found = clearance.edge(Eigen::Vector2d(0, 0), Eigen::Vector2d(2, 0));
  EXPECT_FALSE(found.free);
  EXPECT_NEAR(found.parameter, 0.4, 1e-4 / 2 + 1e-9) << "0.1 mm of 2 m";
  EXPECT_LE(found.parameter, 0.4);
  EXPECT_EQ(found.a, (BodyId{0, 1}));
  EXPECT_EQ(found.b, (BodyId{0, 2}));
  EXPECT_TRUE(clearance.edge(Eigen::Vector2d(0, 0), Eigen::Vector2d(0.7998, 0)).free);
  EXPECT_FALSE(clearance.edge(Eigen::Vector2d(0, 0), Eigen::Vector2d(0.8001, 0), false).free);
  EXPECT_TRUE(clearance.edge(Eigen::Vector2d(-1, -1), Eigen::Vector2d(3, 3)).free) << "both move alike";
  EXPECT_FALSE(clearance.edge(Eigen::Vector2d(0, 0), Eigen::Vector2d(5, -5), false).free)
      << "free ends, and a contact between them";
}

TEST(CertifiedEdge, ContactOfTurningArmsIsAtKnownParameter) {
  Clearance clearance = clearance_of({parsed(kHands)});
  const double touching = M_PI / 2 - 2 * std::asin(0.1);  // a chord of 0.2 m
  const EdgeClearance found = clearance.edge(Eigen::Vector2d(0, 0), Eigen::Vector2d(2, 0));
  EXPECT_FALSE(found.free);
  EXPECT_NEAR(found.parameter * 2, touching, 2e-4);
  EXPECT_LE(found.parameter * 2, touching + 1e-9);
  EXPECT_TRUE(clearance.edge(Eigen::Vector2d(0, 0), Eigen::Vector2d(touching - 3e-4, 0)).free);
}

TEST(CertifiedEdge, ThinWallBetweenFreeEndsIsFound) {
  SceneInstance wall = test::placed_object("wall", Box{{0.0005, 2, 2}}, {0.5, 0, 0.5});
  Clearance clearance = clearance_of({parsed(kRail), wall});
  const EdgeClearance found = clearance.edge(Eigen::Vector2d(-2, 3), Eigen::Vector2d(4.5, 5), true);
  EXPECT_FALSE(found.free);
  EXPECT_NEAR(found.parameter, (0.5 - 0.00025 - 0.1 + 2) / 6.5, 1e-4);
  EXPECT_EQ(found.b, (BodyId{1, 0}));
}

TEST(Clearance, PaddingCountsAsTouching) {
  ClearanceOptions options;
  options.padding = 0.05;
  Clearance clearance = clearance_of({parsed(kRail)}, options);
  EXPECT_TRUE(clearance.is_free(Eigen::Vector2d(0.699, 0)));
  EXPECT_FALSE(clearance.is_free(Eigen::Vector2d(0.701, 0)));
  EXPECT_NEAR(clearance.edge(Eigen::Vector2d(0, 0), Eigen::Vector2d(1, 0)).parameter, 0.7, 2e-4);
  EXPECT_NEAR(clearance.distance_bound(Eigen::Vector2d(0, 0)), 0.7, 1e-6);
  options.paddings = {{BodyId{0, 2}, 0.0}};
  Clearance single = clearance_of({parsed(kRail)}, options);
  EXPECT_TRUE(single.is_free(Eigen::Vector2d(0.749, 0)));
  EXPECT_FALSE(single.is_free(Eigen::Vector2d(0.751, 0)));
}

TEST(Clearance, GroundObjectsAndWhatIsHeldAreTested) {
  SceneInstance robot = parsed(kRail);
  robot.X_WR.translation().z() = -0.45;
  SceneOptions scene;
  scene.ground = true;
  Clearance low = clearance_of({robot}, {}, scene);
  EXPECT_FALSE(low.is_free(Eigen::Vector2d(0, 0)));
  robot.X_WR.translation().z() = -0.399;
  EXPECT_TRUE(clearance_of({robot}, {}, scene).is_free(Eigen::Vector2d(0, 0)));
  EXPECT_NEAR(clearance_of({robot}, {}, scene).distance_bound(Eigen::Vector2d(0, 0)), 0.001, 1e-4);

  SceneInstance can = test::placed_object("can", Cylinder{0.05, 0.3}, {0, 0, 0});
  can.held = HeldBy{{0, 1}};
  can.held->X_LO.translation().z() = 0.25;
  const SceneInstance post = test::placed_object("post", Cylinder{0.1, 1}, {2, 0, 1.2});
  Clearance held = clearance_of({parsed(kRail), can, post});
  EXPECT_TRUE(held.is_free(Eigen::Vector2d(1.84, 5)));
  EXPECT_FALSE(held.is_free(Eigen::Vector2d(1.86, 5))) << "the can touches the post, the ball does not";
  EXPECT_NEAR(held.edge(Eigen::Vector2d(1.2, 5), Eigen::Vector2d(2.2, 5)).parameter, 0.65, 2e-3)
      << "cylinders are polygons around them";
}

TEST(Clearance, ObjectsThatMoveAreFollowed) {
  SceneInstance ball = test::placed_object("ball", Sphere{0.1}, {0, 3, 0.5});
  Clearance clearance = clearance_of({parsed(kRail), ball});
  EXPECT_TRUE(clearance.is_free(Eigen::Vector2d(0, 0)));
  Pose X = Pose::Identity();
  X.translation() << 0.15, 0, 0.5;
  clearance.set_root(1, X);
  EXPECT_FALSE(clearance.is_free(Eigen::Vector2d(0, 0)));
  EXPECT_TRUE(clearance.is_free(Eigen::Vector2d(-0.1, 0)));
}

TEST(Clearance, PositionsThatAreNoNumbersAreNotFree) {
  Clearance clearance = clearance_of({parsed(kRail)});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(clearance.is_free(Eigen::Vector2d(nan, 0)));
  EXPECT_FALSE(clearance.edge(Eigen::Vector2d(0, 0), Eigen::Vector2d(nan, 0)).free);
  EXPECT_FALSE(clearance.is_free(Eigen::Vector2d(100.9, 100)))
      << "beyond the limits, where the scene decides";
  EXPECT_TRUE(clearance.is_free(Eigen::Vector2d(100, 100)));
}

TEST(Clearance, CoversOfAnotherSceneAreRefused) {
  auto scene = std::make_shared<const CollisionScene>(std::vector{parsed(kRail)});
  EXPECT_THROW(Clearance(scene, {}), std::invalid_argument);
  const SceneInstance ball = test::placed_object("ball", Sphere{0.1}, {0, 3, 0.5});
  EXPECT_THROW(Clearance(scene, {make_covers(ball)}), std::invalid_argument);
}

// planning.md P14: the same bits on every instruction set.
TEST(Clearance, KernelsFindSameEdges) {
  SCOPED_TRACE("seed 23");
  const test::TriangleRobot robot = test::load_triangles("lab_arm", robots());
  std::mt19937_64 random(kSeed);
  ClearanceOptions plain;
  plain.kernels = &lane_kernels("doppel_lane_kernels");
  Clearance first(robot.scene, robot.covers, plain), second(robot.scene, robot.covers);
  for (int i = 0; i < kEdges; ++i) {
    const Eigen::VectorXd q0 = test::random_state(*robot.model, random),
                          q1 = test::random_state(*robot.model, random);
    const EdgeClearance a = first.edge(q0, q1), b = second.edge(q0, q1);
    EXPECT_EQ(a.free, b.free);
    EXPECT_EQ(a.parameter, b.parameter);
    EXPECT_EQ(a.states, b.states);
    EXPECT_EQ(a.measured, b.measured);
  }
}

}  // namespace
}  // namespace doppel
