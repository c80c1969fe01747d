// Reach with collisions, and maps of it against closed forms.
#include <gtest/gtest.h>

#include <cmath>

#include "doppel/description/urdf/load.h"
#include "doppel/robot/reach/arm_group.h"
#include "doppel/robot/reach/arm_reach.h"
#include "doppel/robot/reach/reach_files.h"

namespace doppel {
namespace {

// Two links of 0.3 m and 0.2 m that turn about z, 0.1 m above a base, with a tip that has no shape.
constexpr const char* kPlanar = R"(<robot name="planar">
<link name="base"/>
<link name="upper">
<collision><origin xyz="0.15 0 0"/><geometry><box size="0.26 0.02 0.02"/></geometry></collision></link>
<link name="lower">
<collision><origin xyz="0.12 0 0"/><geometry><box size="0.16 0.02 0.02"/></geometry></collision></link>
<link name="tip"/>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
<origin xyz="0 0 0.1"/><axis xyz="0 0 1"/>
<limit lower="-3.14" upper="3.14" effort="1" velocity="1"/></joint>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/>
<origin xyz="0.3 0 0"/><axis xyz="0 0 1"/>
<limit lower="-3.1" upper="3.1" effort="1" velocity="1"/></joint>
<joint name="end" type="fixed"><parent link="lower"/><child link="tip"/><origin xyz="0.2 0 0"/></joint>
</robot>)";

struct PlanarArm {
  PlanarArm() {
    PackageResolver resolver;
    Diagnostics diagnostics;
    robot = parse_urdf(kPlanar, "planar.urdf", resolver, diagnostics);
    model = std::make_shared<const Model>(compile_model(robot, BaseKind::fixed, diagnostics));
    chain = make_chain(*model, 0, model->find_link("tip"));
  }
  RobotDescription robot;
  std::shared_ptr<const Model> model;
  Chain chain;
};

SceneInstance ball_at(const Eigen::Vector3d& place, double radius) {
  SceneInstance out;
  out.name = "ball";
  out.shapes = {{collision_shape(Sphere{radius}, nullptr, Pose::Identity(), Friction{})}};
  out.X_WR.translation() = place;
  return out;
}

ReachQuery query_at(double x, double y) {
  ReachQuery out;
  out.X_WT.translation() = Eigen::Vector3d(x, y, 0.1);
  return out;
}

TEST(ArmReach, BothElbowsReachPosition) {
  const PlanarArm arm;
  Diagnostics notes;
  ArmReach reach(arm.model, arm.chain, reach_scene(arm.robot, arm.model, &arm.chain, {}, notes));
  ReachQuery query = query_at(0.3, 0.1);
  query.every_branch = true;
  query.task = IkTask::position;
  const ReachAnswer answer = reach.answer(query);
  ASSERT_EQ(answer.branches.size(), 2U);
  // The law of cosines.
  const double squared = 0.3 * 0.3 + 0.1 * 0.1;
  const double elbow = std::acos((squared - 0.09 - 0.04) / (2 * 0.3 * 0.2));
  EXPECT_NEAR(std::abs(answer.branches[0].solution.u[1]), elbow, 1e-8);
  EXPECT_NEAR(answer.branches[0].solution.u[1], -answer.branches[1].solution.u[1], 1e-8);
}

TEST(ArmReach, ObstacleLeavesOtherElbow) {
  const PlanarArm arm;
  Diagnostics notes;
  ReachSurroundings around;
  around.others = {ball_at({0.2, -0.12, 0.1}, 0.06)};
  ArmReach reach(arm.model, arm.chain, reach_scene(arm.robot, arm.model, &arm.chain, around, notes));
  ReachQuery query = query_at(0.3, 0);
  query.task = IkTask::position;
  query.every_branch = true;
  const ReachAnswer answer = reach.answer(query);
  ASSERT_EQ(answer.branches.size(), 1U);
  EXPECT_GT(answer.branches[0].solution.u[0], 0);  // the shoulder turns away from the ball
  EXPECT_GT(answer.branches[0].clearance, 0);
  query.collisions = false;
  EXPECT_EQ(reach.answer(query).branches.size(), 2U);
}

// "No is an answer": which pair by how many millimetres.
TEST(ArmReach, PoseInsideObstacleNamesPairAndItsDepth) {
  const PlanarArm arm;
  Diagnostics notes;
  ReachSurroundings around;
  around.others = {ball_at({0.45, 0, 0.1}, 0.1)};
  ArmReach reach(arm.model, arm.chain, reach_scene(arm.robot, arm.model, &arm.chain, around, notes));
  ReachQuery query = query_at(0.45, 0);
  query.task = IkTask::position;
  const ReachAnswer answer = reach.answer(query);
  EXPECT_FALSE(answer.solved);
  ASSERT_TRUE(answer.failure);
  EXPECT_EQ(answer.failure->obstacle, IkObstacle::refused);
  EXPECT_NE(answer.message.find("'lower' and 'ball' touch by"), std::string::npos) << answer.message;
  ASSERT_TRUE(answer.nearest);
  EXPECT_TRUE(answer.nearest->touching.empty());  // the nearest pose that works
}

// Three joints or fewer reach positions; the note says what else was asked for.
TEST(ArmReach, PoseOfPlanarArmIsItsPositionWithNote) {
  const PlanarArm arm;
  ArmReach reach(arm.model, arm.chain, nullptr);
  ReachQuery query = query_at(0.3, 0.1);
  query.X_WT.linear() = rotation_from_rpy({0.5, 0, 0});
  const ReachAnswer answer = reach.answer(query);
  ASSERT_TRUE(answer.solved) << answer.message;
  EXPECT_EQ(answer.task, IkTask::position);
  EXPECT_NE(answer.note.find("only the position is met"), std::string::npos) << answer.note;
}

// The reach of two links is a ring: the area between the circles of their sum and their difference.
TEST(ReachMap, AreaOfPlanarArmIsThatOfItsRing) {
  const PlanarArm arm;
  ReachMapOptions options;
  options.cell = 0.02;
  options.directions = 1;
  options.collisions = false;
  const ReachMap map = make_reach_map(arm.model, arm.chain, nullptr, options);
  int in_plane = 0, outside = 0;
  for (int z = 0; z < map.nz; ++z) {
    for (int y = 0; y < map.ny; ++y) {
      for (int x = 0; x < map.nx; ++x) {
        if (!map.at(x, y, z).in_reach) continue;
        const Eigen::Vector3d p = map.center(x, y, z);
        const double radius = p.head<2>().norm();
        if (std::abs(p.z() - 0.1) > 1e-9 || radius > 0.5 || radius < 0.1) ++outside;
        ++in_plane;
      }
    }
  }
  EXPECT_EQ(outside, 0);
  EXPECT_NEAR(in_plane * 0.02 * 0.02, M_PI * (0.25 - 0.01), 0.02 * 2 * M_PI * 0.6);
  const ReachFacts facts = reach_facts(map, {0, 0, 0.1});
  EXPECT_NEAR(facts.farthest, 0.5, 0.021);
}

TEST(ReachMap, NumberOfThreadsDoesNotChangeMap) {
  const PlanarArm arm;
  ReachMapOptions options;
  options.cell = 0.05;
  options.directions = 10;
  options.threads = 1;
  const ReachMap one = make_reach_map(arm.model, arm.chain, nullptr, options);
  options.threads = 4;
  EXPECT_EQ(reach_binary(make_reach_map(arm.model, arm.chain, nullptr, options)), reach_binary(one));
}

// A client may ask for any cell: the memory of a map is bounded.
TEST(ReachMap, TooManyCellsAreRefusedWithSmallestSize) {
  const PlanarArm arm;
  ReachMapOptions options;
  for (const double cell : {1e-3, 1e-9, 1e-300}) {
    options.cell = cell;
    try {
      (void)make_reach_map(arm.model, arm.chain, nullptr, options);
      FAIL() << cell;
    } catch (const InputError& problem) {
      EXPECT_NE(std::string(problem.what()).find("use cells of at least 0.0038 m"), std::string::npos)
          << problem.what();
    }
  }
}

TEST(ReachMap, ProgressThatReturnsFalseCancels) {
  const PlanarArm arm;
  ReachMapOptions options;
  options.cell = 0.02;
  options.progress = [](double) { return false; };
  EXPECT_TRUE(make_reach_map(arm.model, arm.chain, nullptr, options).cancelled);
}

TEST(ReachFiles, EveryCellInReachIsOneLine) {
  const PlanarArm arm;
  ReachMapOptions options;
  options.cell = 0.05;
  options.directions = 6;
  const ReachMap map = make_reach_map(arm.model, arm.chain, nullptr, options);
  const auto reached =
      std::count_if(map.cells.begin(), map.cells.end(), [](const ReachCell& cell) { return cell.in_reach; });
  const std::string csv = reach_csv(map), ply = reach_ply(map);
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), reached + 1);
  EXPECT_NE(ply.find("element vertex " + std::to_string(reached) + "\n"), std::string::npos);
  EXPECT_TRUE(reach_binary(map).starts_with("doppel reach map 1\n"));
  const std::string svg = reach_svg(map, {{1, 0}, {2, 0.1}}, ReachValue::share, {}, "A < B");
  EXPECT_NE(svg.find("A &lt; B"), std::string::npos);
}

TEST(ReachScene, LinksWithOnlyShapelessLinksBetweenThemMayTouch) {
  // A thigh that overlaps the body in each position, behind a hip without a shape.
  constexpr const char* kLeg = R"(<robot name="leg">
<link name="body"><collision><geometry><box size="0.3 0.2 0.1"/></geometry></collision></link>
<link name="hip"/>
<link name="thigh"><collision><geometry><sphere radius="0.05"/></geometry></collision></link>
<joint name="roll" type="revolute"><parent link="body"/><child link="hip"/><axis xyz="1 0 0"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="pitch" type="revolute"><parent link="hip"/><child link="thigh"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
</robot>)";
  PackageResolver resolver;
  Diagnostics notes;
  const RobotDescription robot = parse_urdf(kLeg, "leg.urdf", resolver, notes);
  const auto model = std::make_shared<const Model>(compile_model(robot, BaseKind::fixed, notes));
  const Chain chain = make_chain(*model, 0, model->find_link("thigh"));
  ArmReach reach(model, chain, reach_scene(robot, model, &chain, {}, notes));
  EXPECT_TRUE(reach.is_free(model->neutral()));
}

TEST(ArmGroup, DefaultHasMostJoints) {
  const PlanarArm arm;
  const Chain torso = make_chain(*arm.model, 0, arm.model->find_link("upper"));
  const std::vector<ArmGroup> arms{{"torso", torso}, {"left_arm", arm.chain}, {"right_arm", arm.chain}};
  EXPECT_EQ(choose_arm(arms, "").name, "left_arm");
}

TEST(ArmGroup, UnknownGroupIsRefusedWithNearestName) {
  const PlanarArm arm;
  const std::vector<ArmGroup> arms{{"left_arm", arm.chain}, {"right_arm", arm.chain}};
  EXPECT_EQ(choose_arm(arms, "").name, "left_arm");
  try {
    (void)choose_arm(arms, "rigth_arm");
    FAIL();
  } catch (const InputError& problem) {
    EXPECT_NE(std::string(problem.what()).find("did you mean 'right_arm'"), std::string::npos)
        << problem.what();
  }
}

}  // namespace
}  // namespace doppel
