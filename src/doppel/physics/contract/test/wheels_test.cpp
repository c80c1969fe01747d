// Wheels and casters: which parts roll, and the motion of a base on them against closed forms.

#include "doppel/physics/contract/wheels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>
#include <random>

#include "doppel/physics/contract/test/mobile_base.h"
#include "doppel/physics/contract/test/mujoco_extras.h"

namespace doppel {
namespace {

using test::BaseShape;
using test::DrivenBase;

constexpr double kPi = std::numbers::pi;
constexpr double kEarthG = 9.81;

const RollingPart* part(const DrivenBase& base, const std::string& link) {
  for (const RollingPart& part : base.robot.made_of().rolling) {
    if (base.model.links[static_cast<std::size_t>(part.link)].name == link) return &part;
  }
  return nullptr;
}

const CollisionShape& shape_of(const DrivenBase& base, const std::string& link) {
  return base.robot.made_of().shapes[static_cast<std::size_t>(base.model.find_link(link))].front();
}

TEST(Wheels, CylinderAboutAxleBecomesEllipsoid) {
  const DrivenBase base;
  const RollingPart* wheel = part(base, "left_wheel");
  ASSERT_NE(wheel, nullptr);
  EXPECT_EQ(wheel->kind, RollingPart::Kind::wheel);
  EXPECT_DOUBLE_EQ(wheel->radius, 0.0975);
  EXPECT_DOUBLE_EQ(wheel->width, 0.048);
  const auto* ellipsoid = std::get_if<Ellipsoid>(&shape_of(base, "left_wheel").geometry);
  ASSERT_NE(ellipsoid, nullptr);
  EXPECT_TRUE(ellipsoid->radii.isApprox(Eigen::Vector3d(0.0975, 0.0975, 0.024)));
  EXPECT_NEAR(std::abs(shape_of(base, "left_wheel").X_LS.linear()(1, 2)), 1.0, 1e-12);
}

TEST(Wheels, FixedBallIsCasterOfLowFriction) {
  const DrivenBase base;
  const RollingPart* ball = part(base, "ball");
  ASSERT_NE(ball, nullptr);
  EXPECT_EQ(ball->kind, RollingPart::Kind::caster);
  EXPECT_EQ(ball->friction.along, kCasterFriction);
  EXPECT_TRUE(ball->friction.decides);
}

TEST(Wheels, ContactKeywordKeepsShape) {
  BaseShape shape;
  shape.contact = "cylinder";
  const DrivenBase base(shape);
  EXPECT_TRUE(std::holds_alternative<Cylinder>(shape_of(base, "left_wheel").geometry));
  EXPECT_NE(part(base, "left_wheel"), nullptr);
}

TEST(Wheels, MeshOfRoundWheelBecomesEllipsoid) {
  BaseShape shape;
  shape.wheel = test::make_wheel_mesh(shape.radius, shape.width, 24, "wheel24");
  const DrivenBase base(shape);
  const auto* ellipsoid = std::get_if<Ellipsoid>(&shape_of(base, "right_wheel").geometry);
  ASSERT_NE(ellipsoid, nullptr);
  EXPECT_NEAR(ellipsoid->radii.x(), shape.radius, 1e-6);
  EXPECT_NEAR(ellipsoid->radii.z(), shape.width / 2, 1e-6);
}

TEST(Wheels, SquareOrOffCentreShapeKeepsItsForm) {
  BaseShape square;
  square.wheel = Box{{0.195, 0.048, 0.195}};
  square.wheel_rpy.setZero();
  EXPECT_EQ(part(DrivenBase(square), "left_wheel"), nullptr);
  BaseShape crooked;
  crooked.wheel_rpy = {1.2, 0, 0};
  EXPECT_EQ(part(DrivenBase(crooked), "left_wheel"), nullptr);
}

// A disc about a knee is round about a joint that turns on, but the foot behind it reaches further.
TEST(Wheels, DiscFromWhichFootProtrudesIsNoWheel) {
  RobotDescription robot = test::make_base();
  for (const char* name : {"left_wheel", "right_wheel"}) {
    for (Link& link : robot.links) {
      if (link.name == name) link.collisions.push_back({"", {{0, 0, -0.2}, {}, {}}, Sphere{0.02}, {}});
    }
  }
  const DrivenBase base(robot);
  EXPECT_TRUE(base.robot.made_of().rolling.empty());
  EXPECT_TRUE(std::holds_alternative<Cylinder>(shape_of(base, "left_wheel").geometry));
}

TEST(Wheels, DrumHighAboveGroundIsNoWheel) {
  RobotDescription robot = test::make_base();
  robot.links.push_back(test::make_link("drum", 0.1, {0, 0, 0}, {1e-4, 1e-4, 1e-4}));
  robot.links.back().collisions.push_back({"", {{}, {kPi / 2, 0, 0}, {}}, Cylinder{0.05, 0.04}, {}});
  robot.joints.push_back(
      test::make_joint("winch", JointType::continuous, "base_link", "drum", {0, 0, 0.4}, {0, 1, 0}));
  const DrivenBase base(robot);
  EXPECT_NE(part(base, "left_wheel"), nullptr);
  EXPECT_EQ(part(base, "drum"), nullptr);
}

TEST(Wheels, ArmOnFixedBaseKeepsItsShapes) {
  RobotDescription robot = test::make_base();
  Diagnostics heard;
  CollisionMeshes meshes;
  auto shared = std::make_shared<const RobotDescription>(robot);
  auto model = std::make_shared<const Model>(compile_model(robot, BaseKind::fixed, heard));
  EXPECT_TRUE(make_instance(shared, model, {}, meshes, heard).rolling.empty());
}

TEST(ContactRules, EmptyRulesGiveEnginesOwnStep) {
  World world;
  world.objects.push_back(test::make_object("box", Box{{0.1, 0.1, 0.1}}, {1, 0, 0.05}, 1.0));
  world.objects.push_back(test::make_object("ball", Sphere{0.05}, {1, 0.02, 0.149}, 0.5));
  DrivenBase base({}, world);
  base.drive(5, 3);
  for (int i = 0; i < 400; ++i) {
    base.engine->step();
    ASSERT_TRUE(empty_contact_rules_change_nothing(*base.engine)) << "step " << i;
  }
}

// -- motion

// Drives at `speed` rad/s until the wheels have turned by `angle`, with 1 m/s^2.
void drive_straight(DrivenBase& base, double speed, double angle) {
  constexpr double kRamp = 1.0 / 0.0975;  // rad/s^2
  double now = 0;
  while (now > 0 || base.angle("left_wheel_joint") < angle / 2) {
    const double braking = now * now / (2 * kRamp);
    const bool stop = base.angle("left_wheel_joint") + braking >= angle;
    now = stop ? std::max(now - 0.01 * kRamp, 0.0) : std::min(now + 0.01 * kRamp, speed);
    base.drive(now, now);
    base.run(0.01);
  }
  base.run(0.5);
}

TEST(DrivenBase, FiveMetresStraightHaveLessSlipThanHalfPerMille) {
  DrivenBase base;
  base.run(0.5);
  const double start = base.position().x(), before = base.angle("left_wheel_joint");
  drive_straight(base, 8.0, 5.0 / 0.0975);
  const double rolled = 0.0975 * (base.angle("left_wheel_joint") - before);
  const double way = base.position().x() - start;
  std::cout << "slip " << 100 * (1 - way / rolled) << " %, sideways " << base.position().y() << " m\n";
  EXPECT_GT(way, 4.9);
  EXPECT_NEAR(way / rolled, 1.0, 5e-4);
  EXPECT_NEAR(base.position().y(), 0.0, 2e-3);
}

TEST(DrivenBase, MeshWheelRollsAsItsPrimitive) {
  double way[2] = {};
  int index = 0;
  for (const bool mesh : {false, true}) {
    BaseShape shape;
    if (mesh) shape.wheel = test::make_wheel_mesh(shape.radius, shape.width, 24, "wheel24");
    DrivenBase base(shape);
    base.run(0.5);
    const double start = base.position().x(), before = base.angle("left_wheel_joint");
    drive_straight(base, 8.0, 20.0);
    way[index++] = (base.position().x() - start) / (base.angle("left_wheel_joint") - before);
  }
  EXPECT_NEAR(way[1] / way[0], 1.0, 1e-3);
}

// Turns on the spot until the wheels have turned by `angle`; returns the effective track, m.
double effective_track(DrivenBase& base, double speed, double angle) {
  base.drive(-speed, speed);
  base.run(1.0);  // until it is steady
  base.heading();
  const double start = base.heading();
  const double left = base.angle("left_wheel_joint"), right = base.angle("right_wheel_joint");
  while (base.angle("right_wheel_joint") - right < angle) {
    base.run(0.01);
    base.heading();
  }
  const double rolled = (base.angle("right_wheel_joint") - right) - (base.angle("left_wheel_joint") - left);
  return 0.0975 * rolled / (base.heading() - start);
}

TEST(DrivenBase, TurnOnSpotHasGeometricTrack) {
  DrivenBase base;
  EXPECT_NEAR(effective_track(base, 3.0, 20.0) / 0.33, 1.0, 2e-3);
}

// Friction and torsion of a contact share one ellipsoid, and the slip is normal to it (associated flow): a
// wheel that pivots at w with the torque T = 2 T_wheel to overcome slips by v = w (f / mu^2) / (t / mu_t^2),
// f = 2 t / track. So the effective track is track (1 + 4 (mu_t / mu)^2 / track^2).
TEST(DrivenBase, TorsionWidensTrackByClosedForm) {
  BaseShape shape;
  shape.patch = 0.05;
  const double torsion = 3 * kPi / 16 * shape.patch;
  const double expected = 0.33 * (1 + 4 * std::pow(torsion / shape.friction / 0.33, 2));
  DrivenBase base(shape);
  const double found = effective_track(base, 3.0, 20.0);
  std::cout << "effective track " << found << " m, closed form " << expected << " m\n";
  EXPECT_GT(expected, 1.01 * 0.33);
  EXPECT_NEAR(found / expected, 1.0, 0.01);
}

// -- pushing and standing

// A table of this mass and friction, in front of the base, which pushes it at its middle with a smooth front: a
// rough one lifts the table while it pushes, so that less friction holds it.
DrivenBase pusher(double mass, double friction) {
  BaseShape shape;
  shape.front_friction = 0.0;
  World world;
  world.friction_rule = FrictionRule::smaller;
  WorldObject table = test::make_object("table", Box{{0.4, 0.6, 0.3}}, {0.4, 0, 0.15}, mass);
  table.friction = friction;
  world.objects.push_back(table);
  return DrivenBase(shape, world);
}

TEST(DrivenBase, TableMovesBelowTractionAndStaysAboveIt) {
  const unsigned seed = 20261123;
  std::cout << "seed " << seed << '\n';
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> mass(2.0, 40.0), friction(0.1, 0.8);
  int moved = 0, stayed = 0;
  while (moved + stayed < 30) {
    const double m = mass(random), mu = friction(random);
    // The wheels push with 0.8 of the load on them, from which the push itself takes off: it acts at the lower
    // edge of the front, 0.1175 m high, and the ball is 0.2 m behind the axle.
    const double traction = 0.8 * 2 * 33.898 / (1 + 0.8 * 0.1175 / 0.2);
    const double ratio = mu * m * kEarthG / traction;
    if (ratio > 0.8 && ratio < 1.2) continue;
    DrivenBase base = pusher(m, mu);
    base.run(0.3);
    const double start = base.pose("table").translation().x();
    for (double speed = 0; speed < 2.0; speed += 0.02) {
      base.drive(speed, speed);
      base.run(0.02);
    }
    const double way = base.pose("table").translation().x() - start;
    ratio < 1 ? ++moved : ++stayed;
    if (ratio < 1) {
      EXPECT_GT(way, 0.02) << m << " kg, mu " << mu << ", " << ratio << " of the traction";
    } else {
      EXPECT_LT(way, 0.005) << m << " kg, mu " << mu << ", " << ratio << " of the traction";
    }
  }
  EXPECT_GE(moved, 5);
  EXPECT_GE(stayed, 5);
}

TEST(DrivenBase, ParkedOnSlopeCreepsLessThanTenthOfMillimetrePerMinute) {
  // A slope as steep as 80 % of what the wheels hold, whose load is less than on level ground: the ball, 0.2 m
  // behind the axle, carries W (0.045 cos + 0.143 sin) / 0.2 of the weight W.
  const double hold = 0.8 * 0.8;
  const double slope = std::atan(hold * (1 - 0.0452 / 0.2) / (1 + hold * 0.143 / 0.2));
  World world;
  world.gravity = kEarthG * Eigen::Vector3d(-std::sin(slope), 0, -std::cos(slope));
  DrivenBase base({}, world);
  base.drive(0, 0);
  base.run(2.0);
  const double before = base.position().x();
  base.run(20.0);
  const double creep = 3 * std::abs(base.position().x() - before);
  std::cout << "creep " << 1e3 * creep << " mm a minute\n";
  EXPECT_LT(creep, 1e-4);
}

TEST(ContactRules, SmallerFrictionOfPairHolds) {
  for (const double slope : {0.29, 0.31}) {
    World world;
    world.friction_rule = FrictionRule::smaller;
    world.ground_friction = 100;
    const double angle = std::atan(slope);
    world.gravity = kEarthG * Eigen::Vector3d(std::sin(angle), 0, -std::cos(angle));
    WorldObject cube = test::make_object("cube", Box{{0.1, 0.1, 0.1}}, {0, 0, 0.05}, 1.0);
    cube.friction = 0.3;
    world.objects.push_back(cube);
    test::Rig rig(test::make_post(), world);
    rig.run(2.0);
    const double way = rig.pose("cube").translation().x();
    if (slope < 0.3) {
      EXPECT_LT(way, 1e-3);
    } else {
      EXPECT_NEAR(way, 0.5 * kEarthG * (std::sin(angle) - 0.3 * std::cos(angle)) * 4.0, 0.02);
    }
  }
}

// A box of 0.1 m as a robot of one link.
RobotDescription make_box(double mass, const ContactSurface& surface) {
  RobotDescription box;
  box.name = "box";
  const double moment = 2e-3 * mass;
  Link link = test::make_link("box", mass, {0, 0, 0}, {moment, moment, moment});
  Collision shape;
  shape.geometry = Box{{0.1, 0.1, 0.1}};
  shape.surface = surface;
  link.collisions.push_back(shape);
  box.links.push_back(link);
  return box;
}

// A box that slides along the direction of the smaller friction, and holds across it.
TEST(ContactRules, FrictionHasDirection) {
  ContactSurface surface;
  surface.mu = 0.1;
  surface.mu2 = 0.8;
  surface.fdir1 = Eigen::Vector3d(1, 0, 0);
  const RobotDescription box = make_box(1.0, surface);
  World world;
  const double angle = 0.3;
  // Down the slope along x and as steeply along y.
  world.gravity = kEarthG * Eigen::Vector3d(std::sin(angle), std::sin(angle), -std::cos(angle)).normalized();
  InstanceOptions options;
  options.set_on_ground = true;
  test::Rig rig(box, world, options, BaseKind::floating);
  rig.run(1.0);
  const Eigen::Vector3d way = rig.robot.base_pose().translation();
  const Eigen::Vector3d g = world.gravity;
  EXPECT_GT(way.x(), 0.4 * 0.5 * (g.x() + 0.1 * g.z()));
  EXPECT_LT(way.y(), 0.15 * way.x()) << "expected little motion across the direction";
  EXPECT_LT((rig.robot.base_pose().linear() - Eigen::Matrix3d::Identity()).norm(), 0.01);
}

// Four corners share the load, so that the box creeps by a quarter of the compliance of one.
TEST(ContactRules, SlipIsSpeedOverTangentialForce) {
  for (const double slip : {0.001, 0.02, 0.3}) {
    ContactSurface surface;
    surface.mu = 0.8;
    surface.slip1 = surface.slip2 = slip;
    const RobotDescription box = make_box(2.0, surface);
    World world;
    const double angle = 0.3;  // below the friction
    world.gravity = kEarthG * Eigen::Vector3d(std::sin(angle), 0, -std::cos(angle));
    InstanceOptions options;
    options.set_on_ground = true;
    test::Rig rig(box, world, options, BaseKind::floating);
    rig.run(1.0);
    const double before = rig.robot.base_pose().translation().x();
    rig.run(1.0);
    const double speed = rig.robot.base_pose().translation().x() - before;
    EXPECT_NEAR(speed, slip * 2.0 * kEarthG * std::sin(angle) / 4, 0.01 * speed) << slip << " m/s per N";
  }
}

TEST(ContactRules, DifferentSlipsAreReported) {
  ContactSurface surface;
  surface.slip2 = 0.1;
  const test::Rig rig(make_box(1.0, surface), World{}, {}, BaseKind::floating);
  const auto reported = [](const Diagnostic& d) { return d.rule == "physics.slip"; };
  EXPECT_EQ(std::ranges::count_if(rig.diagnostics.all(), reported), 1);
}

// As of a car whose wheels follow a virtual one.
TEST(Wheels, WheelThatMimicsAnotherRolls) {
  RobotDescription robot = test::make_base();
  Joint& follower = *std::ranges::find(robot.joints, "right_wheel_joint", &Joint::name);
  follower.mimic = Mimic{};
  follower.mimic->joint = "left_wheel_joint";
  const test::Rig rig(robot, {}, test::DrivenBase::options_for(Pose::Identity()), BaseKind::floating);
  EXPECT_EQ(std::ranges::count(rig.robot.made_of().rolling, RollingPart::Kind::wheel, &RollingPart::kind), 2);
}

TEST(ContactRules, SlidingContactStaysClosed) {
  World world;
  world.friction_rule = FrictionRule::smaller;
  WorldObject box = test::make_object("box", Box{{0.2, 0.2, 0.05}}, {0, 0, 0.025}, 2.0);
  box.friction = 0.3;
  world.objects.push_back(box);
  test::Rig rig(test::make_post(), world);
  rig.run(0.2);
  rig.object("box").set_base_velocity({{2.0, 0, 0}, {}});
  double least = 1e9, most = 0;
  for (int i = 0; i < 500; ++i) {
    rig.run(0.001);
    std::vector<Contact> contacts;
    rig.engine->contacts(contacts);
    double force = 0;
    for (const Contact& contact : contacts) force += std::abs(contact.force_W.z());
    if (i > 100) {
      least = std::min(least, force);
      most = std::max(most, force);
    }
  }
  EXPECT_NEAR(least, 2 * kEarthG, 0.005 * 2 * kEarthG);
  EXPECT_NEAR(most, 2 * kEarthG, 0.005 * 2 * kEarthG);
  EXPECT_NEAR(rig.object("box").base_velocity().linear_W.x(), 2.0 - 0.3 * kEarthG * 0.5, 0.02);
}

// The casters could carry all of the base, so that the driven wheels could spin without load.
TEST(ContactRules, WheelOfLargeFrictionGripsBesideCasters) {
  test::BaseShape shape;
  shape.friction = 200;
  RobotDescription robot = test::make_base(shape);
  for (const auto& [name, x] : {std::pair{"front_ball", 0.2}, std::pair{"rear_ball", -0.25}}) {
    Link ball = test::make_frame(name);
    ball.collisions.push_back({"", {}, Sphere{0.0375}, {}});
    robot.links.push_back(ball);
    robot.joints.push_back(test::make_joint(std::string(name) + "_joint", JointType::fixed, "base_link", name,
                                            {x, 0, 0.0375 - 0.0975}, {0, 0, 1}));
  }
  test::Rig rig(robot, {}, test::DrivenBase::options_for(Pose::Identity()), BaseKind::floating);
  for (const char* wheel : {"left_wheel_joint", "right_wheel_joint"}) {
    rig.robot.set_drive(rig.joint(wheel), DriveMode::velocity);
    rig.robot.set_target(rig.joint(wheel), 4.0);
  }
  rig.run(1.0);
  EXPECT_NEAR(rig.robot.base_pose().translation().x(), 0.0975 * rig.q("left_wheel_joint"), 0.01);
  EXPECT_GT(rig.q("left_wheel_joint"), 3.5);
}

}  // namespace
}  // namespace doppel
