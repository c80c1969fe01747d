// What fingers hold: by friction, how long, how far it creeps, and which grasps are found.

#include "doppel/physics/contract/grasp.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <iostream>

#include "doppel/physics/contract/test/engine_fixture.h"
#include "doppel/physics/contract/test/hand.h"
#include "doppel/physics/contract/test/mujoco_extras.h"

namespace doppel {
namespace {

using test::make_object;
using test::Rig;

struct HeldCube : Rig {
  static constexpr double kEdge = 0.03;  // m
  // A cube on the ground between the fingers.
  static World cube(double mass, double friction) {
    World world;
    world.objects.push_back(make_object("cube", Box{{kEdge, kEdge, kEdge}}, {0, 0, kEdge / 2}, mass));
    world.objects.back().friction = friction;
    return world;
  }
  HeldCube(double mass, double friction, double grip, bool coupled = false)
      : Rig(test::make_hand({grip, coupled, friction, 0.02}), cube(mass, friction)) {
    hold_all();
  }
  void close() {
    for (const char* finger : {"left", "right"}) {
      if (!model.joints[static_cast<std::size_t>(joint(finger))].mimics())
        robot.set_target(joint(finger), 0.03);
    }
    run(1.0);
  }
  void open() {
    for (const char* finger : {"left", "right"}) {
      if (!model.joints[static_cast<std::size_t>(joint(finger))].mimics())
        robot.set_target(joint(finger), 0.0);
    }
  }
  void lift() {
    robot.set_target(joint("lift"), 0.15);
    run(2.0);
  }
  [[nodiscard]] double height() const { return pose("cube").translation().z(); }
  // m: the cube below the palm
  [[nodiscard]] double hanging() const {
    return robot.link_pose(model.find_link("palm")).translation().z() - height();
  }
  [[nodiscard]] std::vector<Grasp> grasps() const {
    std::vector<Contact> contacts;
    engine->contacts(contacts);
    std::vector<Grasp> out;
    find_grasps(engine->world(), contacts, out);
    return out;
  }
};

// G1 of the specification.
TEST(Grasp, HeldCubeSlipsLessThanHundredthOfMillimetrePerMinute) {
  for (const bool coupled : {false, true}) {
    HeldCube rig(0.2, 0.8, coupled ? 10.0 : 5.0, coupled);
    rig.close();
    rig.lift();
    ASSERT_GT(rig.height(), 0.15);
    const double before = rig.hanging();
    rig.run(60.0);
    const double slip = rig.hanging() - before;
    std::cout << "slip of 0.2 kg at 5 N a finger, mu 0.8, " << (coupled ? "coupled" : "free")
              << " fingers: " << 1e3 * slip << " mm a minute\n";
    EXPECT_LT(std::abs(slip), 1e-5);
    rig.open();
    rig.run(1.0);
    EXPECT_LT(rig.height(), 0.016) << "expected a released cube to fall";
  }
}

TEST(Grasp, CubeFallsWhereFrictionIsLessThanWeight) {
  HeldCube rig(0.2, 0.15, 5.0);  // 2 x 0.15 x 5 N = 1.5 N < 1.96 N
  rig.close();
  rig.lift();
  EXPECT_LT(rig.height(), 0.03);
}

// While it slides, the cube falls by g - (friction of both fingers) / mass.
TEST(Grasp, SlidingCubeFallsByWeightLessFriction) {
  HeldCube rig(0.2, 0.1, 5.0);
  Instance cube = rig.object("cube");
  Pose X = Pose::Identity();
  X.translation() << 0, 0, 0.265;
  rig.set_state({0.25, 0, 0});
  cube.place(X);
  cube.apply_wrench(cube.made_of().base_link(), {0, 0, 0}, {0, 0, 0.2 * 9.81}, {0, 0, 0});
  rig.close();
  ASSERT_NEAR(rig.height(), 0.265, 1e-4);
  rig.engine->clear_applied();
  rig.run(0.01);
  const double before = cube.base_velocity().linear_W.z();
  rig.run(0.04);
  const double acceleration = (cube.base_velocity().linear_W.z() - before) / 0.04;
  std::cout << "falls with " << acceleration << " m/s^2\n";
  EXPECT_NEAR(acceleration, -(9.81 - 2 * 0.1 * 5.0 / 0.2), 0.02);
}

TEST(Grasp, FingersAreFoundWithForceAndShareOfFriction) {
  HeldCube rig(0.2, 0.8, 5.0);
  EXPECT_THAT(rig.grasps(), testing::IsEmpty());
  rig.close();
  ASSERT_THAT(rig.grasps(), testing::SizeIs(1));
  EXPECT_TRUE(rig.grasps()[0].supported) << "expected the ground below it";
  rig.lift();
  const std::vector<Grasp> grasps = rig.grasps();
  ASSERT_THAT(grasps, testing::SizeIs(1));
  const Grasp& grasp = grasps[0];
  EXPECT_EQ(grasp.robot, 0);
  EXPECT_EQ(rig.engine->world().name_of(grasp.body), "cube");
  EXPECT_FALSE(grasp.supported);
  ASSERT_EQ(grasp.links.size(), 2U);
  EXPECT_EQ(rig.model.links[static_cast<std::size_t>(grasp.links[0].link)].name, "left finger");
  EXPECT_NEAR(grasp.pressure(), 10.0, 0.05);
  EXPECT_NEAR(grasp.capacity(), 8.0, 0.05);
  EXPECT_NEAR(grasp.friction_used(), 0.2 * 9.81 / 8.0, 5e-3);
  EXPECT_NEAR((grasp.links[0].friction_W + grasp.links[1].friction_W).z(), 0.2 * 9.81, 0.01);
  EXPECT_NEAR(grasp.links[0].normal_W.y(), 1.0, 1e-3);
}

TEST(Grasp, BodyOnOneLinkIsNotHeld) {
  World world;
  world.objects.push_back(make_object("cube", Box{{0.1, 0.1, 0.03}}, {0, 0, 0.13}, 0.2));
  RobotDescription robot = test::make_hand();
  robot.links[1].collisions.push_back({"", {}, Box{{0.2, 0.2, 0.02}}, {}});  // a tray
  Rig rig(robot, world);
  rig.hold_all();
  rig.run(0.5);
  std::vector<Contact> contacts;
  rig.engine->contacts(contacts);
  ASSERT_FALSE(contacts.empty());
  std::vector<Grasp> grasps;
  find_grasps(rig.engine->world(), contacts, grasps);
  EXPECT_THAT(grasps, testing::IsEmpty());
}

TEST(Grasp, StepIsEnginesOwnUntilSomethingIsHeld) {
  HeldCube rig(0.2, 0.8, 5.0);
  for (const char* finger : {"left", "right"}) rig.robot.set_target(rig.joint(finger), 0.03);
  while (rig.grasps().empty()) {
    ASSERT_TRUE(contact_rules_change_nothing(*rig.engine));
    rig.engine->step();
    ASSERT_LT(to_seconds(rig.engine->time()), 1.0);
  }
  EXPECT_FALSE(contact_rules_change_nothing(*rig.engine));
}

}  // namespace
}  // namespace doppel
