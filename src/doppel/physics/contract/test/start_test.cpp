// The pose of a robot at the start, and that it stays there.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>

#include "doppel/physics/contract/test/engine_fixture.h"

namespace doppel {
namespace {

using test::make_frame;
using test::make_joint;
using test::make_link;
using test::Rig;

Collision shape(const Geometry& geometry, const Eigen::Vector3d& xyz) {
  Collision out;
  out.geometry = geometry;
  out.origin.xyz = xyz;
  return out;
}

// A leg that hangs from a pelvis at the origin, with its shank in the ground.
RobotDescription make_leg() {
  RobotDescription robot;
  robot.name = "leg";
  robot.links = {make_link("pelvis", 5, {0, 0, 0}, {0.05, 0.05, 0.05}),
                 make_link("thigh", 1, {0, 0, -0.2}, {0.01, 0.01, 0.01}),
                 make_link("shank", 1, {0, 0, -0.2}, {0.01, 0.01, 0.01})};
  robot.links[2].collisions.push_back(shape(Box{{0.05, 0.05, 0.4}}, {0.1, 0, -0.2}));
  robot.joints = {make_joint("hip", JointType::revolute, "pelvis", "thigh", {0, 0, 0}, {0, 1, 0}),
                  make_joint("knee", JointType::revolute, "thigh", "shank", {0, 0, -0.4}, {0, 1, 0})};
  for (Joint& joint : robot.joints) test::limit(joint, -2, 2, 88, 10);
  return robot;
}

World on_ground() {
  World world;
  world.ground = true;
  return world;
}

double fastest(const Rig& rig) {
  double out = 0;
  for (const double v : rig.robot.v()) out = std::max(out, std::abs(v));
  return out;
}

TEST(SimulationStart, FixedRobotInsideGroundStaysAtRest) {
  Rig rig(make_leg(), on_ground());
  rig.hold_all();
  rig.run(0.5);
  EXPECT_LT(fastest(rig), 1e-3);
  const auto pairs = rig.excluded_pairs();
  const auto shank =
      std::find_if(pairs.begin(), pairs.end(), [](const test::NamedPair& p) { return p.link_b == "ground"; });
  ASSERT_NE(shank, pairs.end());
  EXPECT_EQ(shank->link_a, "shank");
  EXPECT_EQ(shank->reason, "inside at the start");
  EXPECT_NEAR(shank->depth, 0.8, 1e-6);
}

// MuJoCo reads a file in memory, which a full machine or a limit cuts off.
TEST(SimulationStart, DescriptionThatDoesNotFitIsRefusedWithReason) {
  constexpr rlim_t kMaxFile = 1000;
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit limit{kMaxFile, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &limit), 0);
  std::string problem;
  try {
    const Rig rig(make_leg(), on_ground());
  } catch (const InputError& error) {
    problem = error.what();
  }
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_THAT(problem, testing::HasSubstr("for the physics engine cannot be written: File too large"));
}

TEST(SimulationStart, FloatingRobotIsSetOnGround) {
  InstanceOptions options;
  options.set_on_ground = true;
  Rig rig(make_leg(), on_ground(), options, BaseKind::floating);
  EXPECT_NEAR(rig.robot.link_pose(rig.model.find_link("pelvis")).translation().z(), 0.8, 1e-9);
  for (const test::NamedPair& pair : rig.excluded_pairs()) EXPECT_NE(pair.link_b, "ground");
  rig.hold_all();
  rig.run(0.05);
  EXPECT_NEAR(rig.robot.link_pose(rig.model.find_link("pelvis")).translation().z(), 0.8, 5e-3)
      << "expected the robot to stand instead of falling through the ground";
}

TEST(SimulationStart, FloatingRobotOfEveryShapeTouchesGroundWithItsLowestPoint) {
  const Geometry shapes[] = {Geometry(Box{{0.2, 0.3, 0.4}}), Geometry(Cylinder{0.1, 0.5}),
                             Geometry(Capsule{0.1, 0.5}), Geometry(Sphere{0.1})};
  const double lowest[] = {0.5 * (0.4 * std::cos(0.5) + 0.3 * std::sin(0.5)),
                           0.25 * std::cos(0.5) + 0.1 * std::sin(0.5), 0.1 + 0.25 * std::cos(0.5), 0.1};
  for (std::size_t i = 0; i < std::size(shapes); ++i) {
    RobotDescription robot;
    robot.name = "body";
    robot.links = {make_link("body", 1, {0, 0, 0}, {0.01, 0.01, 0.01})};
    robot.links[0].collisions.push_back(shape(shapes[i], {0, 0, 0}));
    robot.links[0].collisions[0].origin.rpy = {0.5, 0, 0};
    InstanceOptions options;
    options.set_on_ground = true;
    Rig rig(robot, on_ground(), options, BaseKind::floating);
    EXPECT_NEAR(rig.robot.link_pose(1).translation().z(), lowest[i], 1e-9) << i;
  }
}

TEST(SimulationStart, FloatingRobotIsLiftedToGround) {
  Rig rig(make_leg(), on_ground(), {}, BaseKind::floating);
  std::vector<double> q(rig.robot.q().begin(), rig.robot.q().end());
  const std::vector<double> still(static_cast<std::size_t>(rig.model.nv), 0.0);
  q[0] = 0.3;
  q[2] = 0.5;
  rig.robot.set_state(q, still);
  rig.robot.lift_out_of_ground();
  EXPECT_NEAR(rig.robot.link_pose(1).translation().x(), 0.3, 1e-12);
  EXPECT_NEAR(rig.robot.link_pose(1).translation().z(), 0.8, 1e-9);
  q[2] = 2.0;
  rig.robot.set_state(q, still);
  rig.robot.lift_out_of_ground();
  EXPECT_NEAR(rig.robot.link_pose(1).translation().z(), 2.0, 1e-12);
}

TEST(SimulationStart, PlaceOfWorldFileIsKept) {
  World world = on_ground();
  world.X_WR.translation() = Eigen::Vector3d(1, 2, 1.5);
  InstanceOptions options;
  options.set_on_ground = true;
  Rig rig(make_leg(), world, options, BaseKind::floating);
  EXPECT_NEAR(rig.robot.link_pose(rig.model.find_link("pelvis")).translation().z(), 1.5, 1e-9);
}

TEST(SimulationStart, LinkInsideObjectPassesThroughThatObjectOnly) {
  World world = on_ground();
  world.X_WR.translation() = Eigen::Vector3d(0, 0, 2);
  world.objects = {test::make_object("crate", Box{{0.3, 0.3, 0.3}}, {0.1, 0, 1.4}, 0),
                   test::make_object("shelf", Box{{0.3, 0.3, 0.3}}, {0.6, 0, 1.4}, 0)};
  Rig rig(make_leg(), world);
  rig.hold_all();
  rig.run(0.5);
  EXPECT_LT(fastest(rig), 1e-3);
  std::vector<std::string> inside;
  for (const test::NamedPair& pair : rig.excluded_pairs()) {
    if (pair.depth > 0) inside.push_back(pair.link_a + " " + pair.link_b);
  }
  EXPECT_THAT(inside, ::testing::ElementsAre("shank crate"));
  // Objects that are added and removed later do not change the exclusion.
  rig.spawn(test::make_object("ball", Sphere{0.05}, {2, 0, 1}, 0.1));
  rig.run(0.2);
  EXPECT_LT(std::abs(rig.v("knee")), 1e-3);
}

// Constraint forces belong to the step that is taken: with the drives' damping left out of the matrix that
// they are solved with, a held joint with friction moved at 0.15 rad/s and coupled fingers diverged.
TEST(SimulationStart, HeldJointsWithFrictionAndFollowersAreAtRestAtEveryStep) {
  for (const double step : {1e-3, 2e-3, 5e-3}) {
    RobotDescription robot = make_leg();
    robot.links[0].collisions.clear();
    robot.links[2].collisions.clear();
    robot.links.push_back(make_link("toe", 0.01, {0.02, 0, 0}, {1e-6, 1e-6, 1e-6}));
    robot.joints.push_back(
        make_joint("toe_joint", JointType::revolute, "shank", "toe", {0, 0, -0.4}, {0, 1, 0}));
    test::limit(robot.joints[2], -2, 2, 88, 10);
    robot.joints[2].mimic = Mimic{"knee", 0.5, 0.0, {}};
    for (Joint& joint : robot.joints) joint.dynamics = JointDynamics{0.5, 2.0, {}};
    Rig rig(robot, test::empty_space(step));
    rig.set_state({0.7, -0.9, -0.45});
    rig.hold_all();
    rig.run(1.0);
    EXPECT_LT(fastest(rig), 1e-3) << step;
    EXPECT_NEAR(rig.q("toe_joint"), 0.5 * rig.q("knee"), 1e-4) << step;
  }
}

TEST(SimulationStart, LinksWithoutGravityNeedNoEffort) {
  RobotDescription robot = make_leg();
  robot.links[2].collisions.clear();
  GazeboExtension off;
  off.reference = "shank";
  off.gravity = false;
  robot.gazebo.push_back(off);
  Rig rig(robot);
  rig.set_state({0.0, 0.5});
  Data data(rig.model);
  gravity_torques(rig.model, data, Eigen::Vector2d(0.3, 0.5), {0, 0, -9.81});
  EXPECT_NEAR(data.tau[1], 0.0, 1e-12) << "expected no torque: the shank has no weight";
  EXPECT_NEAR(data.tau[0], 1.0 * 9.81 * 0.2 * std::sin(0.3), 1e-9)
      << "expected the torque of the thigh's weight";
  rig.run(0.3);
  EXPECT_NEAR(rig.v("knee"), 0.0, 1e-9);
  EXPECT_NEAR(rig.q("knee"), 0.5, 1e-9);
  // An external wrench acts in addition.
  rig.robot.apply_wrench(2, {0, 0, -0.2}, {1, 0, 0}, Eigen::Vector3d::Zero());
  rig.run(0.1);
  EXPECT_GT(std::abs(rig.v("knee")), 1e-2);
}

// 5 N m on 1e-6 kg m^2 would be 5000 rad/s after one step.
TEST(SimulationStart, EffortOnBareHornIncludesRotorInertia) {
  RobotDescription robot = make_leg();
  robot.links[2] = make_link("shank", 1e-4, {0, 0, 0}, {1e-6, 1e-6, 1e-6});
  test::limit(robot.joints[1], -100, 100, 5, 1.5);
  Rig rig(robot);
  EXPECT_NEAR(rig.servos()[static_cast<std::size_t>(rig.joint("knee"))].rotor_inertia, 5 * 1e-4 / 1.5, 2e-6);
  EXPECT_EQ(rig.servos()[static_cast<std::size_t>(rig.joint("hip"))].rotor_inertia, 0.0);
  rig.robot.set_drive(rig.joint("hip"), DriveMode::position);
  rig.robot.set_drive(rig.joint("knee"), DriveMode::effort);
  rig.robot.set_target(rig.joint("knee"), 5.0);
  rig.engine->step();
  EXPECT_NEAR(std::abs(rig.v("knee")), 1.5, 0.02) << "expected the velocity limit after 1 ms";
}

TEST(SimulationStart, TinyBodiesAreAccepted) {
  RobotDescription robot = make_leg();
  robot.links[2] = make_link("shank", 1e-8, {0, 0, 0}, {1e-20, 1e-20, 1e-20});
  Rig rig(robot);
  rig.hold_all();
  rig.run(0.2);
  EXPECT_LT(fastest(rig), 1e-3);
}

}  // namespace
}  // namespace doppel
