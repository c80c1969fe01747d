#include "doppel/physics/contract/engine.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <numbers>

#include "doppel/physics/contract/test/allocation_counter.h"
#include "doppel/physics/contract/test/engine_fixture.h"
#include "doppel/physics/contract/test/mujoco_extras.h"
#include "doppel/robot/kinematics/test/integrate.h"

namespace doppel {
namespace {

using test::Rig;
using ::testing::HasSubstr;

// A six-axis arm on a plate, with two mimicking fingers and shapes: a typical robot.
RobotDescription make_arm() {
  RobotDescription robot;
  robot.name = "arm";
  robot.links.push_back(test::make_link("base", 0.5, {0, 0, 0.02}, {1e-3, 1e-3, 1e-3}));
  robot.links[0].collisions.push_back({"", {{0, 0, 0.02}, {}, {}}, Box{{0.1, 0.1, 0.04}}, {}});
  for (int i = 1; i <= 6; ++i) {
    const std::string name = "link " + std::to_string(i);
    const Eigen::Vector3d axis = i % 3 == 1 ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d::UnitY();
    robot.joints.push_back(test::make_joint("Revolute " + std::to_string(i), JointType::revolute,
                                            robot.links.back().name, name, {0, 0, i == 1 ? 0.04 : 0.07},
                                            axis));
    test::limit(robot.joints.back(), -2, 2, 3.5, 5.2);
    robot.joints.back().dynamics = JointDynamics{0.05, 0.02, {}};
    Link link = test::make_link(name, 0.12, {0, 0, 0.03}, {1e-4, 1e-4, 5e-5});
    link.collisions.push_back({"", {{0, 0, 0.035}, {}, {}}, Capsule{0.015, 0.04}, {}});
    robot.links.push_back(link);
  }
  for (const int side : {-1, 1}) {
    const std::string name = side < 0 ? "left" : "right";
    robot.joints.push_back(test::make_joint(name, JointType::revolute, "link 6", name + " finger",
                                            {0, side * 0.012, 0.075}, {side * -1.0, 0, 0}));
    test::limit(robot.joints.back(), 0, 1.6, 0.18, 8);
    Link finger = test::make_link(name + " finger", 0.015, {0, 0, 0.025}, {4e-6, 4e-6, 2e-6});
    finger.collisions.push_back({"", {{0, 0, 0.025}, {}, {}}, Box{{0.01, 0.006, 0.05}}, {}});
    robot.links.push_back(finger);
  }
  robot.joints.back().mimic = Mimic{"left", 1.0, 0.05, {}};
  return robot;
}

void move(Rig& rig, int step) {
  for (int joint = 0; joint < static_cast<int>(rig.model.joints.size()); ++joint) {
    const ModelJoint& moved = rig.model.joints[joint];
    if (moved.scalar() && !moved.mimics())
      rig.robot.set_target(joint, 0.4 + 0.4 * std::sin(1e-3 * step + joint));
  }
}

TEST(Engine, NewEngineIsNamedAndAtRest) {
  Rig rig(make_arm(), World{});
  EXPECT_EQ(rig.engine->world().capabilities().name, "mujoco");
  EXPECT_EQ(rig.engine->world().capabilities().version, "2.2.2");
  EXPECT_EQ(rig.engine->time(), time_from_nanoseconds(0));
  EXPECT_TRUE(rig.diagnostics.all().empty()) << rig.diagnostics.all()[0].str();
  for (const double v : rig.robot.v()) EXPECT_EQ(v, 0);
  EXPECT_NEAR(rig.q("right"), 0.05, 1e-15) << "expected the mimic joint's offset";
}

TEST(Engine, TimeIsCountedInSteps) {
  World world = test::empty_space(1.0 / 3);
  world.step = Duration(333'333);
  Rig rig(test::make_pendulum(1, 1), world);
  for (int i = 0; i < 3000; ++i) rig.engine->step();
  EXPECT_EQ(rig.engine->time(), time_from_nanoseconds(999'999'000));
}

TEST(Engine, StepDoesNotAllocate) {
  Rig rig(make_arm(), World{});
  rig.hold_all();
  rig.robot.apply_wrench(3, {0, 0, 0.01}, {0.1, 0, 0}, {0, 0, 0});
  const std::uint64_t before_any = test::heap_allocations();
  const RobotDescription something = make_arm();
  ASSERT_GT(test::heap_allocations(), before_any) << "expected the counter to count";
  const std::uint64_t before = test::heap_allocations();
  for (int i = 0; i < 500; ++i) {
    if (i % 10 == 0) move(rig, i);
    rig.engine->step();
  }
  rig.robot.set_drive(1, DriveMode::passive);
  rig.engine->clear_applied();
  EXPECT_EQ(test::heap_allocations() - before, 0u);
  const std::vector<double> q(rig.robot.q().begin(), rig.robot.q().end());
  const std::vector<double> v(rig.robot.v().begin(), rig.robot.v().end());
  const std::uint64_t before_state = test::heap_allocations();
  rig.robot.set_state(q, v);
  EXPECT_EQ(test::heap_allocations() - before_state, 0u);
}

TEST(Engine, TwoRunsAreBitIdentical) {
  Rig first(make_arm(), World{}), second(make_arm(), World{});
  for (Rig* rig : {&first, &second}) rig->hold_all();
  std::vector<Contact> contacts;
  for (int i = 0; i < 3000; ++i) {
    for (Rig* rig : {&first, &second}) {
      if (i % 10 == 0) move(*rig, i);
      rig->engine->step();
    }
    // Reading must not change anything.
    second.engine->contacts(contacts);
    (void)second.engine->kinetic_energy();
    (void)second.engine->cast_ray({0, 0, 1}, {0, 0, -1});
    for (const auto& [a, b] :
         {std::pair(first.robot.q(), second.robot.q()), std::pair(first.robot.v(), second.robot.v()),
          std::pair(first.robot.drive_effort(), second.robot.drive_effort())}) {
      ASSERT_EQ(std::memcmp(a.data(), b.data(), a.size_bytes()), 0) << "step " << i;
    }
  }
}

TEST(Engine, ResetRunIsBitIdentical) {
  Rig rig(make_arm(), World{});
  std::vector<double> ends[2];
  for (auto& end : ends) {
    rig.engine->reset();
    EXPECT_EQ(rig.engine->time(), time_from_nanoseconds(0));
    EXPECT_EQ(rig.robot.drive(0), DriveMode::passive);
    rig.hold_all();
    move(rig, 0);
    rig.run(1.0);
    end.assign(rig.robot.q().begin(), rig.robot.q().end());
  }
  EXPECT_EQ(ends[0], ends[1]);
}

TEST(Engine, PassiveArmCollapsesAndHeldArmStands) {
  for (const bool held : {false, true}) {
    Rig rig(make_arm(), World{});
    std::vector<double> q(static_cast<std::size_t>(rig.model.nq), 0.0);
    q[1] = 0.3;
    rig.set_state(q);
    if (held) rig.hold_all();
    rig.run(2.0);
    const double tip = rig.robot.link_pose(6).translation().z();
    if (held) {
      EXPECT_GT(tip, 0.35);
    } else {
      EXPECT_LT(tip, 0.25);
    }
  }
}

TEST(Engine, MimicHoldsUnderFingertipLoad) {
  Rig rig(make_arm(), World{});
  rig.hold_all();
  rig.robot.set_target(rig.joint("left"), 0.5);
  rig.run(1.0);
  rig.robot.apply_wrench(rig.model.find_link("right finger"), {0, 0, 0.05}, {0, 1, 0}, {0, 0, 0});
  rig.run(1.0);
  EXPECT_NEAR(rig.q("right"), rig.q("left") + 0.05, 1e-3);
  EXPECT_EQ(rig.effort("right"), 0) << "expected no effort: a mimic joint has no drive";
}

TEST(Engine, MimicKeepsMultiplierWhileMoving) {
  RobotDescription robot = make_arm();
  robot.joints.back().mimic = Mimic{"left", 0.5, 0.1, {}};
  Rig rig(robot, World{});
  rig.hold_all();
  rig.robot.set_target(rig.joint("left"), 1.0);
  for (int i = 0; i < 1000; ++i) {
    rig.engine->step();
    ASSERT_NEAR(rig.q("right"), 0.5 * rig.q("left") + 0.1, 5e-3);
  }
}

TEST(Engine, LimitStopsJoint) {
  RobotDescription robot = test::make_pendulum(1.0, 0.2);
  robot.joints[0].type = JointType::revolute;
  test::limit(robot.joints[0], -0.5, 2.0, 20, 5);
  Rig rig(robot);
  rig.robot.set_drive(0, DriveMode::effort);
  rig.robot.set_target(0, -3.0);
  rig.run(2.0);
  EXPECT_NEAR(rig.q("swing"), -0.5, 5e-3);
  EXPECT_NEAR(rig.v("swing"), 0, 1e-4);
}

TEST(Engine, SetStateSetsMimicsAndReferences) {
  Rig rig(make_arm(), World{});
  rig.hold_all();
  std::vector<double> q(static_cast<std::size_t>(rig.model.nq), 0.0);
  q[2] = 0.4;
  q[6] = 0.3;
  rig.set_state(q);
  EXPECT_NEAR(rig.q("right"), 0.35, 1e-15);
  rig.run(0.5);
  EXPECT_NEAR(rig.q("Revolute 3"), 0.4, 0.01) << "expected the joint to stay where it was placed";
}

TEST(Engine, PosesMatchJointsInTime) {
  Rig rig(make_arm(), World{});
  Data data(rig.model);
  for (int i = 0; i < 200; ++i) {
    rig.engine->step();
    const Eigen::VectorXd q = Eigen::Map<const Eigen::VectorXd>(rig.robot.q().data(), rig.model.nq);
    forward_kinematics(rig.model, data, q);
    ASSERT_NEAR((rig.robot.link_pose(6).matrix() - data.X_WL[6].matrix()).norm(), 0, 1e-12);
  }
}

TEST(Engine, WrenchesActAtTheirPoint) {
  // A bar on a hinge about z, pushed sideways at 0.5 m: torque 1 N m, inertia 1/3 kg m^2.
  RobotDescription robot;
  robot.links = {test::make_frame("post"),
                 test::make_link("bar", 1.0, {0.5, 0, 0}, {1e-3, 1.0 / 12, 1.0 / 12})};
  robot.joints = {test::make_joint("turn", JointType::continuous, "post", "bar", {0, 0, 0}, {0, 0, 1})};
  Rig rig(robot);
  rig.robot.apply_wrench(1, {0.5, 0, 0}, {0, 2, 0}, {0, 0, 0});
  rig.engine->step();
  EXPECT_NEAR(rig.v("turn"), 1.0 / (1.0 / 3) * 1e-3, 1e-6);
  rig.engine->reset();
  rig.robot.apply_wrench(1, {0, 0, 0}, {0, 2, 0}, {0, 0, 1});
  rig.engine->step();
  EXPECT_NEAR(rig.v("turn"), 1.0 / (1.0 / 3) * 1e-3, 1e-6)
      << "expected a force through the axis not to turn the bar, and a torque to turn it";
}

TEST(Engine, FloatingBasesFallAndLand) {
  World world;
  world.X_WR = make_pose({0, 0, 0.5}, {0, 0, 0.7});
  Rig rig(make_arm(), world, {}, BaseKind::floating);
  EXPECT_NEAR((rig.robot.link_pose(1).matrix() - world.X_WR.matrix()).norm(), 0, 1e-12);
  rig.hold_all();
  rig.run(0.2);
  EXPECT_NEAR(rig.robot.link_pose(1).translation().z(), 0.5 - 0.5 * 9.81 * 0.04, 3e-3);
  rig.run(2.0);
  const Pose landed = rig.robot.link_pose(1);
  EXPECT_NEAR(landed.translation().z(), 0.0, 3e-3);
  EXPECT_NEAR(landed.linear()(2, 2), 1.0, 1e-3) << "expected an upright object";
  // The order of the quaternion's values: the same pose computed from q by the kinematics.
  Data data(rig.model);
  forward_kinematics(rig.model, data, Eigen::Map<const Eigen::VectorXd>(rig.robot.q().data(), rig.model.nq));
  EXPECT_NEAR((world.X_WR.matrix() * data.X_WL[1].matrix() - landed.matrix()).norm(), 0, 1e-9);
}

TEST(Engine, DivergenceStopsStep) {
  const auto log = std::filesystem::current_path() / "MUJOCO_LOG.TXT";
  std::filesystem::remove(log);
  Rig rig(test::make_pendulum(1, 1));
  rig.set_state({0.5});
  rig.run(0.1);
  const double before = rig.q("swing");
  rig.robot.apply_joint_effort(0, 1e300);
  rig.engine->step();
  EXPECT_TRUE(rig.engine->diverged());
  EXPECT_EQ(rig.q("swing"), before) << "expected the last valid state";
  EXPECT_EQ(rig.engine->time(), time_from_nanoseconds(100'000'000));
  rig.engine->step();
  EXPECT_EQ(rig.engine->time(), time_from_nanoseconds(100'000'000));
  rig.engine->reset();
  EXPECT_FALSE(rig.engine->diverged());
  rig.run(0.1);
  EXPECT_FALSE(std::filesystem::exists(log));
}

TEST(Engine, MasslessFramesAreAccepted) {
  RobotDescription robot = test::make_pendulum(1, 0.5);
  // The mass is two fixed joints below the link that moves.
  robot.links[1].inertial.reset();
  robot.links.push_back(test::make_frame("flange"));
  robot.links.push_back(test::make_link("tool", 2, {0, 0, -0.5}, {1e-3, 1e-3, 1e-3}));
  robot.joints.push_back(test::make_joint("weld1", JointType::fixed, "bob", "flange", {0, 0, 0}, {1, 0, 0}));
  robot.joints.push_back(
      test::make_joint("weld2", JointType::fixed, "flange", "tool", {0, 0, -0.1}, {1, 0, 0}));
  Rig rig(robot);
  EXPECT_TRUE(rig.diagnostics.all().empty());
  rig.set_state({0.5});
  rig.hold_all();
  rig.run(1.0);
  EXPECT_NEAR(rig.effort("swing"), 2 * 9.81 * 0.6 * std::sin(rig.q("swing")), 1e-5);
}

#ifndef __SANITIZE_ADDRESS__  // which itself reserves more than that
// In a process with little memory, because the world of a test should be small.
TEST(EngineDeathTest, WorldThatGetsNoMemoryIsRefusedWithItsLimit) {
  const auto refused = [] {
    const rlimit little{rlim_t{2} << 30, rlim_t{2} << 30};
    setrlimit(RLIMIT_AS, &little);
    World world;
    for (int i = 0; i < 600; ++i) {
      WorldObject ball;
      ball.name = "ball " + std::to_string(i);
      ball.shape = Sphere{0.1};
      ball.mass = 1;
      ball.X_WO.translation() = Eigen::Vector3d(i, 0, 1);
      world.objects.push_back(ball);
    }
    try {
      Rig rig(make_arm(), world);
    } catch (const InputError& error) {
      std::fputs(error.what(), stderr);
      std::exit(2);
    }
    std::exit(0);
  };
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(refused(), ::testing::ExitedWithCode(2), "no memory for the 600 shapes of the world that move");
}
#endif

TEST(Engine, BareRateIsMeasuredOnCopy) {
  Rig rig(make_arm(), World{});
  rig.hold_all();
  rig.run(0.1);
  const std::vector<double> q(rig.robot.q().begin(), rig.robot.q().end());
  EXPECT_GT(measure_bare_step_rate(*rig.engine, 100), 0);
  EXPECT_EQ(q, std::vector<double>(rig.robot.q().begin(), rig.robot.q().end()));
}

// An error deep in MuJoCo reaches the engine as a result, and leaves every frame above it properly.
TEST(MujocoEngine, ErrorInsideMujocoReleasesFrames) {
  const Rig rig(test::make_pendulum(1.0, 0.5));
  EXPECT_TRUE(mujoco_error_unwinds(*rig.engine));
}

}  // namespace
}  // namespace doppel
