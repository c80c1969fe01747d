// Contacts, exclusions, rays and the objects of a world.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "doppel/physics/contract/test/engine_fixture.h"
#include "doppel/physics/contract/test/hand.h"

namespace doppel {
namespace {

using test::make_object;
using test::Rig;
using ::testing::HasSubstr;

World with(const WorldObject& object) {
  World world;
  world.objects.push_back(object);
  return world;
}

// Three bars in a row, joined by hinges about y; bars two joints apart overlap where `fat`.
RobotDescription make_bars(double radius) {
  RobotDescription robot;
  robot.name = "bars";
  for (int i = 0; i < 3; ++i) {
    const std::string name = "bar" + std::to_string(i);
    Link link = test::make_link(name, 0.3, {0, 0, 0.05}, {3e-4, 3e-4, 1e-4});
    link.collisions.push_back({"", {{0, 0, 0.05}, {}, {}}, Capsule{radius, 0.06}, {}});
    if (i > 0) {
      robot.joints.push_back(test::make_joint("bend" + std::to_string(i), JointType::revolute,
                                              robot.links.back().name, name, {0, 0, 0.1}, {0, 1, 0}));
      test::limit(robot.joints.back(), -3, 3, 20, 5);
    }
    robot.links.push_back(link);
  }
  return robot;
}

std::string reason(const Rig& rig, const std::string& a, const std::string& b) {
  for (const test::NamedPair& pair : rig.excluded_pairs()) {
    if (pair.link_a == a && pair.link_b == b) return pair.reason;
  }
  return "";
}

TEST(Exclusions, ExclusionsNamePairsAndReason) {
  Rig thin(make_bars(0.01), World{});
  EXPECT_EQ(reason(thin, "bar0", "bar1"), "joined by bend1");
  EXPECT_EQ(reason(thin, "bar1", "bar2"), "joined by bend2");
  EXPECT_EQ(reason(thin, "bar0", "bar2"), "");
  EXPECT_EQ(reason(thin, "bar0", "ground"), "fixed to the world");

  Rig fat(make_bars(0.08), World{});
  EXPECT_EQ(reason(fat, "bar0", "bar2"), "touching at the start");
  std::vector<Contact> contacts;
  fat.engine->contacts(contacts);
  for (const Contact& contact : contacts) EXPECT_TRUE(contact.a.is_ground() || contact.b.is_ground());
}

TEST(Exclusions, FixedJointsAreMerged) {
  RobotDescription robot = make_bars(0.01);
  robot.joints[0].type = JointType::fixed;
  Rig rig(robot, World{});
  EXPECT_EQ(reason(rig, "bar0", "bar1"), "one rigid body");
  EXPECT_EQ(reason(rig, "bar0", "bar2"), "joined by bend2");
}

TEST(Exclusions, LinksApartAtStartCollide) {
  const RobotDescription robot = make_bars(0.02);
  for (const bool self_collision : {true, false}) {
    World space = test::empty_space();
    space.gravity.setZero();
    InstanceOptions options;
    options.self_collision = self_collision;
    Rig rig(robot, space, options);
    rig.hold_all();
    // Without contact the third bar would fold through the first.
    rig.robot.set_target(rig.joint("bend1"), 1.2);
    rig.robot.set_target(rig.joint("bend2"), 2.8);
    rig.run(3.0);
    std::vector<Contact> contacts;
    rig.engine->contacts(contacts);
    ASSERT_EQ(contacts.empty(), !self_collision);
    if (self_collision) {
      EXPECT_EQ(std::min(contacts[0].a, contacts[0].b), (BodyId{0, 0}));
      EXPECT_EQ(std::max(contacts[0].a, contacts[0].b), (BodyId{0, 2}));
    }
  }
}

TEST(Contacts, ContactForcesCarryWeight) {
  Rig rig(test::make_post(), with(make_object("box", Box{{0.1, 0.1, 0.1}}, {0, 0, 0.05}, 2.0)));
  rig.run(1.0);
  std::vector<Contact> contacts;
  rig.engine->contacts(contacts);
  ASSERT_GE(contacts.size(), 3u);
  Eigen::Vector3d on_box = Eigen::Vector3d::Zero();
  for (const Contact& contact : contacts) {
    const bool box_is_b = rig.engine->world().name_of(contact.b) == "box";
    EXPECT_TRUE((box_is_b ? contact.a : contact.b).is_ground());
    EXPECT_NEAR(std::abs(contact.normal_W.z()), 1, 1e-9);
    EXPECT_NEAR(contact.normal_W.z(), box_is_b ? 1 : -1, 1e-9) << "expected a normal from a to b";
    on_box += box_is_b ? contact.force_W : Eigen::Vector3d(-contact.force_W);
    EXPECT_LT(contact.depth, 1e-3);
  }
  EXPECT_NEAR((on_box - Eigen::Vector3d(0, 0, 2.0 * 9.81)).norm(), 0, 0.02);
}

// MuJoCo 2.2.2 by itself finds one contact of a cylinder or hull on a box, at a place that changes from step to step.
TEST(Contacts, CanOnTableStandsStill) {
  for (const FrictionRule rule : {FrictionRule::larger, FrictionRule::smaller}) {
    World world = with(make_object("table", Box{{0.8, 0.8, 0.4}}, {0, 0, 0.2}, 0));
    world.friction_rule = rule;
    world.objects.push_back(make_object("can", Cylinder{0.033, 0.115}, {0.11, 0.07, 0.4575}, 0.35));
    world.objects.push_back(make_object("on can", Cylinder{0.033, 0.115}, {0.11, 0.07, 0.5725}, 0.35));
    world.objects.push_back(make_object("disc", Cylinder{0.1, 0.02}, {-0.2, 0.1, 0.41}, 0.2));
    Rig rig(test::make_post(), world);
    rig.run(1.0);
    std::vector<Pose> before;
    for (const char* name : {"can", "on can", "disc"}) before.push_back(rig.pose(name));
    rig.run(10.0);
    for (const char* name : {"can", "on can", "disc"}) {
      const Pose moved = before.front().inverse() * rig.pose(name);
      before.erase(before.begin());
      EXPECT_LT(6 * moved.translation().norm(), 1e-5) << name << ": more than 0.01 mm a minute";
      EXPECT_LT(6 * Eigen::AngleAxisd(moved.linear()).angle(), 1e-3) << name;
    }
  }
}

// Acceleration (m/s^2) of a body that starts at rest on a box that is tilted about y, from 0.5 to 1.5 s.
double acceleration_on_box(const Geometry& shape, const Eigen::Matrix3d& R_SO, double angle, double friction,
                           FrictionRule rule) {
  World world;
  world.ground = false;
  world.friction_rule = rule;
  WorldObject slab = make_object("slab", Box{{20, 4, 0.2}}, {0, 0, 0}, 0);
  slab.X_WO.linear() = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()).toRotationMatrix();
  WorldObject body = make_object("body", shape, {0, 0, 0}, 1);
  body.X_WO = slab.X_WO * Eigen::Translation3d(-3, 0, 0.2) * Pose(R_SO);
  body.friction = slab.friction = friction;
  world.objects = {slab, body};
  Rig rig(test::make_post(), world);
  const Eigen::Vector3d along = slab.X_WO.linear().col(0);
  rig.run(0.5);
  const double before = along.dot(rig.object("body").base_velocity().linear_W);
  rig.run(1.0);
  return along.dot(rig.object("body").base_velocity().linear_W) - before;
}

TEST(Contacts, SlidingAndRollingOnBoxFollowClosedForms) {
  const Eigen::Matrix3d upright = Eigen::Matrix3d::Identity(),
                        lying = Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitX())
                                    .toRotationMatrix();
  for (const FrictionRule rule : {FrictionRule::larger, FrictionRule::smaller}) {
    for (const auto& [degrees, friction] : {std::pair{20.0, 0.3}, {20.0, 0.355}, {10.0, 0.1}, {30.0, 0.5}}) {
      const double angle = degrees * std::numbers::pi / 180,
                   exact = 9.81 * (std::sin(angle) - friction * std::cos(angle));
      EXPECT_NEAR(acceleration_on_box(Box{{0.2, 0.2, 0.2}}, upright, angle, friction, rule), exact,
                  2e-4 * exact)
          << degrees << " degrees, friction " << friction;
    }
    const double angle = 10 * std::numbers::pi / 180, fall = 9.81 * std::sin(angle);
    EXPECT_NEAR(acceleration_on_box(Cylinder{0.1, 0.2}, lying, angle, 0.8, rule), 2.0 / 3.0 * fall,
                1e-4 * fall);
    EXPECT_NEAR(acceleration_on_box(Sphere{0.1}, upright, angle, 0.8, rule), 5.0 / 7.0 * fall, 1e-4 * fall);
  }
}

TEST(RayCast, RayHitsLinksAndObjects) {
  Rig rig(make_bars(0.01), with(make_object("ball", Sphere{0.1}, {1, 0, 0.5}, 0)));
  RayHit hit = rig.engine->cast_ray({1, 0, 2}, {0, 0, -3});
  EXPECT_NEAR(hit.distance, 1.4, 1e-9);
  EXPECT_EQ(rig.engine->world().name_of(hit.body), "ball");
  hit = rig.engine->cast_ray({-1, 0, 0.15}, {1, 0, 0});
  EXPECT_NEAR(hit.distance, 0.99, 1e-9);
  EXPECT_EQ(hit.body, (BodyId{0, 1}));
  EXPECT_LT(rig.engine->cast_ray({0, 0, 2}, {0, 0, 1}).distance, 0);
}

TEST(WorldObjects, ObjectsCanBeAddedAndRemoved) {
  Rig rig(make_bars(0.01), with(make_object("first", Sphere{0.05}, {1, 0, 2}, 0.1)));
  Rig alone(make_bars(0.01), with(make_object("first", Sphere{0.05}, {1, 0, 2}, 0.1)));
  for (Rig* each : {&rig, &alone}) {
    each->set_state({0.4, 0.2});
    each->hold_all();
    each->robot.set_target(0, 0.8);
    each->run(0.2);
  }
  rig.spawn(make_object("second", Box{{0.1, 0.1, 0.1}}, {-1, 0, 1}, 0.2));
  EXPECT_THROW(rig.spawn(make_object("second", Sphere{0.1}, {0, 1, 0}, 0)), InputError);
  EXPECT_THROW(rig.spawn(make_object("ground", Sphere{0.1}, {0, 1, 0}, 0)), InputError);
  for (Rig* each : {&rig, &alone}) each->run(0.1);
  EXPECT_EQ(rig.engine->time(), time_from_nanoseconds(300'000'000));
  EXPECT_EQ(rig.q("bend1"), alone.q("bend1")) << "expected drives and state to be preserved";
  EXPECT_EQ(rig.robot.drive(0), DriveMode::position);
  Pose a, b;
  a = rig.pose("first");
  b = alone.pose("first");
  EXPECT_EQ(a.translation().z(), b.translation().z());
  a = rig.pose("second");
  EXPECT_LT(a.translation().z(), 0.99);
  EXPECT_TRUE(rig.engine->remove("first"));
  EXPECT_FALSE(rig.engine->remove("first"));
  EXPECT_FALSE(rig.is_there("first"));
  rig.run(0.1);
  rig.engine->reset();
  a = rig.pose("second");
  EXPECT_EQ(a.translation().z(), 1.0) << "expected a spawned object to return to its initial pose";
}

TEST(WorldObjects, PoseCanBeSet) {
  World world = with(make_object("ball", Sphere{0.05}, {1, 0, 2}, 0.1));
  world.objects.push_back(make_object("wall", Box{{0.1, 1, 1}}, {2, 0, 0.5}, 0));
  Rig rig(test::make_post(), world);
  rig.run(0.5);
  rig.object("ball").place(make_pose({0, 1, 3}, {0, 0, 0}));
  rig.object("wall").place(make_pose({-2, 0, 0.5}, {0, 0, 0.3}));
  Pose X;
  X = rig.pose("wall");
  EXPECT_NEAR(X.translation().x(), -2, 1e-12);
  rig.engine->step();
  X = rig.pose("ball");
  EXPECT_NEAR(X.translation().z(), 3, 1e-4) << "expected the object at rest where it was placed";
  rig.engine->reset();
  X = rig.pose("wall");
  EXPECT_NEAR(X.translation().x(), 2, 1e-12);
}

TEST(WorldObjects, VelocityCanBeSet) {
  Rig rig(test::make_post(), with(make_object("ball", Sphere{0.05}, {0, 0, 2}, 0.1)));
  rig.run(0.1);
  FrameVelocity velocity;
  velocity = rig.object("ball").base_velocity();
  EXPECT_NEAR(velocity.linear_W.z(), -0.981, 1e-3);
  const Eigen::Vector3d upward(0.5, 0, 2), spin(0, 3, 0);
  rig.object("ball").place(make_pose({0, 0, 2}, {0.3, 1.0, -2.0}));
  rig.object("ball").set_base_velocity({upward, spin});
  velocity = rig.object("ball").base_velocity();
  EXPECT_TRUE(velocity.linear_W.isApprox(upward, 1e-9)) << velocity.linear_W.transpose();
  EXPECT_TRUE(velocity.angular_W.isApprox(spin, 1e-9)) << velocity.angular_W.transpose();
  rig.run(0.1);
  Pose X;
  X = rig.pose("ball");
  EXPECT_NEAR(X.translation().x(), 0.05, 1e-3);
}

TEST(WorldObjects, ShapeOriginIsApplied) {
  WorldObject can = make_object("can", Cylinder{0.03, 0.12}, {0, 0, 0.001}, 0.3);
  can.X_OS.translation().z() = 0.06;
  Rig rig(test::make_post(), with(can));
  rig.run(1.0);
  Pose X;
  X = rig.pose("can");
  EXPECT_NEAR(X.translation().z(), 0.0, 1e-3) << "expected the object to rest on its frame's origin";
  EXPECT_GT(X.linear()(2, 2), 0.999) << "expected an upright object: its mass is where its shape is";
}

TEST(WorldObjects, ReplacementIsAtomic) {
  World world = with(make_object("ball", Sphere{0.05}, {0, 0, 2}, 0.1));
  world.objects.push_back(make_object("gone", Sphere{0.05}, {1, 0, 2}, 0.1));
  Rig rig(test::make_post(), world);
  rig.run(0.1);
  Pose before, after;
  before = rig.pose("ball");
  std::vector<ModelInstance> instances = rig.engine->world().instances();
  instances[2] = make_instance(make_object("new", Sphere{0.05}, {1, 0, 1}, 0), rig.meshes, rig.diagnostics);
  std::swap(instances[1], instances[2]);
  rig.engine->set_instances(instances);
  after = rig.pose("ball");
  EXPECT_EQ(before.translation(), after.translation());
  EXPECT_FALSE(rig.is_there("gone"));
  EXPECT_EQ(rig.engine->world().instances().size(), 3u);
}

TEST(Contacts, FingersLiftBoxByFriction) {
  Rig rig(test::make_hand(), with(make_object("box", Box{{0.03, 0.03, 0.03}}, {0, 0, 0.015}, 0.05)));
  rig.hold_all();
  rig.robot.set_target(rig.joint("left"), 0.03);
  rig.run(1.0);
  EXPECT_NEAR(rig.q("left"), 0.015, 1e-3) << "expected the finger at the surface of the box";
  EXPECT_NEAR(rig.effort("left"), 4.0, 1e-9) << "expected the full effort";
  rig.robot.set_target(rig.joint("lift"), 0.1);
  rig.run(2.0);
  Pose lifted, later;
  lifted = rig.pose("box");
  EXPECT_NEAR(lifted.translation().z(), 0.115, 2e-3);
  rig.run(5.0);
  later = rig.pose("box");
  EXPECT_NEAR(later.translation().z(), lifted.translation().z(), 5e-4)
      << "expected no creep of a held object";
  rig.robot.set_target(rig.joint("left"), 0.0);
  rig.run(1.0);
  later = rig.pose("box");
  EXPECT_LT(later.translation().z(), 0.03) << "expected a released object to fall";
}

// 125 cubes that are pressed together touch in 325 pairs at four points each; 8 contacts for each cube and
// 100 for the robot would be too few.
TEST(Contact, BlockOfCubesLosesNoContact) {
  World world;
  constexpr double kSide = 0.05, kGap = -1e-5;
  for (int i = 0; i < 125; ++i) {
    const Eigen::Vector3d cell(i % 5, i / 5 % 5, i / 25);
    world.objects.push_back(make_object(std::to_string(i), Box{{kSide, kSide, kSide}},
                                        (kSide + kGap) * cell + Eigen::Vector3d(0, 0, 0.5 * kSide + kGap),
                                        0.1));
  }
  Rig rig(test::make_post(), world);
  EXPECT_EQ(rig.engine->dropped_contacts(), 0);
}

// A body of 900 feet, of which the engine's sizes expect twelve at once to touch.
TEST(Contact, ContactWithoutRoomIsReported) {
  RobotDescription brush;
  brush.name = "brush";
  brush.links = {test::make_link("plate", 1.0, {0, 0, 0}, {1e-2, 1e-2, 1e-2})};
  for (int i = 0; i < 900; ++i)
    brush.links[0].collisions.push_back(
        {"", {{0.01 * (i % 30), 0.01 * (i / 30), 0.0}, {}, {}}, Box{{0.005, 0.005, 0.02}}, {}});
  InstanceOptions options;
  options.X_WR.translation() = Eigen::Vector3d(0, 0, 0.0095);
  options.passive = true;
  World world;
  Rig rig(brush, world, options, BaseKind::floating);
  rig.run(0.01);
  EXPECT_GT(rig.engine->dropped_contacts(), 0);
}

std::string error_of(const WorldObject& object) {
  try {
    Rig rig(test::make_post(), with(object));
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(WorldObjects, InvalidObjectIsRefusedByName) {
  EXPECT_THAT(error_of(make_object("flat one", Box{{0.1, 0.1, 0}}, {0, 0, 1}, 1)),
              HasSubstr("'flat one' has no size"));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(error_of(make_object("nowhere", Sphere{0.1}, {0, nan, 1}, 1)), HasSubstr("'nowhere'"));
  EXPECT_THAT(error_of(make_object("feather", Sphere{0.1}, {0, 0, 1}, 1e-20)),
              HasSubstr("'feather' has a mass of 1e-20 kg"));
}

TEST(Contact, ExcludedPairsFollowObjects) {
  RobotDescription robot = test::make_post();
  Collision shape;
  shape.geometry = Box{{0.1, 0.1, 0.1}};
  robot.links[0].collisions.push_back(shape);
  robot.links.push_back(test::make_frame("top"));  // with one link it would itself be an object
  robot.joints.push_back(test::make_joint("weld", JointType::fixed, "post", "top", {0, 0, 1}, {0, 0, 1}));
  Rig rig(robot);
  const auto mentions = [&rig](const std::string& name) {
    const auto pairs = rig.excluded_pairs();
    return std::count_if(pairs.begin(), pairs.end(),
                         [&](const test::NamedPair& pair) { return pair.link_b == name; });
  };
  EXPECT_EQ(mentions("wall"), 0);
  rig.spawn(make_object("wall", Box{{1, 1, 1}}, {3, 0, 0}, 0));
  EXPECT_EQ(mentions("wall"), 1);
  EXPECT_TRUE(rig.engine->remove("wall"));
  EXPECT_EQ(mentions("wall"), 0);
}

// A few pairs are listed one by one, many are found by MuJoCo's broad phase: contacts, forces and sliding do
// not depend on which of the two it is.
TEST(Contact, ListedAndUnlistedPairsGiveSameMotion) {
  const auto motion = [](int far_away) {
    World world;
    world.step = from_seconds(1e-3);
    world.ground_friction = 0.1;
    WorldObject slope = test::make_object("slope", Box{{2, 2, 0.1}}, {0, 0, 1}, 0);
    slope.X_WO = make_pose({0, 0, 1}, {0, 0.5, 0});
    slope.friction = 0.2;
    WorldObject box = test::make_object("box", Box{{0.1, 0.1, 0.05}}, {0, 0, 1.2}, 0.5);
    box.friction = 0.3;
    world.objects = {slope, box, test::make_object("ball", Sphere{0.05}, {0.1, 0.02, 1.5}, 0.2)};
    for (int i = 0; i < far_away; ++i)
      world.objects.push_back(
          test::make_object("far" + std::to_string(i), Sphere{0.1}, {100.0 + i, 0, 0.5}, 0));
    Rig rig(test::make_pendulum(1.0, 0.5), world);
    rig.set_state({0.7});
    std::vector<Eigen::Vector3d> places;
    std::vector<Contact> contacts;
    std::size_t touched = 0;
    for (int i = 0; i < 1500; ++i) {
      rig.engine->step();
      rig.engine->contacts(contacts);
      touched += contacts.size();
    }
    Pose X;
    for (const char* name : {"box", "ball"}) {
      X = rig.pose(name);
      places.push_back(X.translation());
    }
    EXPECT_GT(touched, 500U);
    return std::pair{places, touched};
  };
  const auto [listed, touched_listed] = motion(0);
  const auto [searched, touched_searched] = motion(220);  // more than kMaxListedPairs with the two free ones
  EXPECT_EQ(touched_listed, touched_searched);
  for (std::size_t i = 0; i < listed.size(); ++i)
    EXPECT_NEAR((listed[i] - searched[i]).norm(), 0.0, 1e-9) << i;
}

}  // namespace
}  // namespace doppel
