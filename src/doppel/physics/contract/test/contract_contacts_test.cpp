// The contract for every engine that has contacts: what is in contact, with which forces, and what a ray
// hits.

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

#include "contract_rig.h"
#include "doppel/physics/contract/test/mobile_base.h"

namespace doppel::test {
namespace {

class ContactContract : public Contract {
 protected:
  void SetUp() override {
    if (!can().contacts) GTEST_SKIP() << "the engine has no contacts";
  }
  static WorldSettings ground(double step = 1e-3) {
    WorldSettings out = settings(step);
    out.ground = true;
    return out;
  }
  static Eigen::Vector3d force_on(Engine& engine, BodyId body) {
    std::vector<Contact> contacts;
    engine.contacts(contacts);
    Eigen::Vector3d out = Eigen::Vector3d::Zero();
    for (const Contact& contact : contacts) {
      if (contact.b == body) out += contact.force_W;
      if (contact.a == body) out -= contact.force_W;
    }
    return out;
  }
  static BodyId body_of(Engine& engine, const std::string& name) {
    const Instance of = *engine.find(name);
    return {of.index(), of.made_of().base_link()};
  }
  static double height(Engine& engine, const std::string& name) {
    return engine.find(name)->base_pose().translation().z();
  }
};
DOPPEL_FOR_EVERY_ENGINE(ContactContract);

TEST_P(ContactContract, RestingBodyPressesWithItsWeight) {
  const std::pair<Geometry, double> bodies[] = {{Box{{0.1, 0.2, 0.1}}, 0.05},
                                                {Sphere{0.07}, 0.07},
                                                {Cylinder{0.05, 0.12}, 0.06},
                                                {Capsule{0.05, 0.1}, 0.1}};
  for (const auto& [shape, half] : bodies) {
    const auto engine = make(ground(), {object("body", shape, at(0, 0, half + 0.001), 1.0)});
    run(*engine, 1.0);
    if (std::holds_alternative<Capsule>(shape)) continue;  // it balances on a point until it falls
    EXPECT_NEAR(force_on(*engine, body_of(*engine, "body")).z(), kGravity, 0.02 * kGravity) << shape.index();
    EXPECT_NEAR(height(*engine, "body"), half, within().penetration) << shape.index();
    EXPECT_LT(engine->find("body")->base_velocity().linear_W.norm(), 1e-3) << shape.index();
  }
}

// -- impacts with a restitution (Newton's law)

class BounceContract : public ContactContract {
 protected:
  void SetUp() override {
    if (!can().contacts || !can().bounce) GTEST_SKIP() << "the engine has no restitution";
  }
  ModelInstance bouncing(const std::string& name, const Geometry& shape, const Pose& X_WO, double mass,
                         std::optional<double> restitution) {
    WorldObject out;
    out.name = name;
    out.shape = shape;
    out.X_WO = X_WO;
    out.mass = mass;
    out.restitution = restitution;
    return make_instance(out, meshes_, heard_);
  }
  // Speed after over speed before the first impact of a body that falls by 1 m.
  double rebound(const WorldSettings& in, const Geometry& shape, double half,
                 std::optional<double> restitution, double extra = 0) {
    const auto engine = make(in, {bouncing("body", shape, at(0, 0, half + 1 + extra), 0.5, restitution)});
    double down = 0, up = 0;
    for (double t = 0; t < 0.55; t += to_seconds(in.step)) {
      const double v = engine->instance(0).base_velocity().linear_W.z();
      down = std::min(down, v);
      up = std::max(up, v);
      engine->step();
    }
    return up / -down;
  }
};
DOPPEL_FOR_EVERY_ENGINE(BounceContract);

TEST_P(BounceContract, ReboundSpeedIsRestitutionTimesImpactSpeed) {
  for (const double e : {0.0, 0.25, 0.5, 0.8, 1.0}) {
    for (const double extra : {0.0, 0.0011, 0.0023, 0.0037}) {  // different parts of a step before the impact
      const WorldSettings in = ground();
      EXPECT_NEAR(rebound(in, Sphere{0.1}, 0.1, e, extra), e, 0.03) << "ball, e " << e << ", " << extra;
      EXPECT_NEAR(rebound(in, Box{{0.2, 0.2, 0.2}}, 0.1, e, extra), e, 0.03)
          << "box, e " << e << ", " << extra;
    }
  }
}

TEST_P(BounceContract, ReboundDependsNeitherOnStepNorOnIntegrator) {
  for (const Integrator integrator : can().integrators) {
    for (const double step : {5e-4, 2e-3, 5e-3}) {
      WorldSettings in = ground(step);
      in.integrator = integrator;
      EXPECT_NEAR(rebound(in, Sphere{0.1}, 0.1, 0.7), 0.7, 0.03) << name_of(integrator) << " " << step;
    }
  }
}

TEST_P(BounceContract, SmallerRestitutionOfPairActs) {
  WorldSettings in = ground();
  in.ground_restitution = 0.4;
  EXPECT_NEAR(rebound(in, Sphere{0.1}, 0.1, 0.9), 0.4, 0.03);
  EXPECT_NEAR(rebound(in, Sphere{0.1}, 0.1, 0.2), 0.2, 0.03);
  EXPECT_NEAR(rebound(in, Sphere{0.1}, 0.1, std::nullopt), 0.4, 0.03) << "expected that of the ground";
}

// The bounces of a ball from the height H end after sqrt(2 H / g) (1 + e) / (1 - e).
TEST_P(BounceContract, BouncesEndAfterGeometricSeries) {
  constexpr double kRestitution = 0.7;
  const double fall = std::sqrt(2.0 / kGravity), end = fall * (1 + kRestitution) / (1 - kRestitution);
  const auto engine = make(ground(), {bouncing("ball", Sphere{0.1}, at(0, 0, 1.1), 0.5, kRestitution)});
  double last_air = 0, deepest = 1;
  for (double t = 0; t < end + 0.5; t += 1e-3) {
    engine->step();
    if (height(*engine, "ball") > 0.1 + 5e-4) last_air = t;
    if (t > end + 0.3) deepest = std::min(deepest, height(*engine, "ball"));
  }
  EXPECT_NEAR(last_air, end, 0.15 * end);
  EXPECT_NEAR(deepest, 0.1, within().penetration);
  EXPECT_LT(engine->instance(0).base_velocity().linear_W.norm(), 1e-3);
}

// Two balls that meet head-on in empty space: momentum is kept, and they part with e times the speed at which
// they meet.
TEST_P(BounceContract, CollisionOfTwoBallsFollowsNewtonsLaw) {
  WorldSettings in = settings();
  in.gravity.setZero();
  const double m1 = 0.5, m2 = 2.0, v1 = 3.0, v2 = -1.0, e = 0.6;
  const auto engine = make(in, {bouncing("a", Sphere{0.1}, at(-0.5, 0, 1), m1, e),
                                bouncing("b", Sphere{0.1}, at(0.5, 0, 1), m2, e)});
  engine->instance(0).set_base_velocity({{v1, 0, 0}, {0, 0, 0}});
  engine->instance(1).set_base_velocity({{v2, 0, 0}, {0, 0, 0}});
  run(*engine, 0.4);
  const double centre = (m1 * v1 + m2 * v2) / (m1 + m2);
  EXPECT_NEAR(engine->instance(0).base_velocity().linear_W.x(), centre - e * m2 / (m1 + m2) * (v1 - v2),
              0.03);
  EXPECT_NEAR(engine->instance(1).base_velocity().linear_W.x(), centre + e * m1 / (m1 + m2) * (v1 - v2),
              0.03);
}

// The smallest speed with which a box rests is not a rebound, and an impact without a restitution remains as
// it was.
TEST_P(BounceContract, BoxWithRestitutionRests) {
  const auto engine = make(ground(), {bouncing("low", Box{{0.2, 0.2, 0.1}}, at(0, 0, 0.051), 1.0, 0.9),
                                      bouncing("high", Box{{0.1, 0.1, 0.1}}, at(0, 0, 0.152), 0.5, 0.9)});
  run(*engine, 1.0);
  const double before = height(*engine, "high");
  run(*engine, 1.0);
  EXPECT_NEAR(height(*engine, "low"), 0.05, within().penetration);
  EXPECT_NEAR(height(*engine, "high"), before, 1e-5);
  EXPECT_NEAR(force_on(*engine, body_of(*engine, "low")).z(), 1.0 * kGravity, 0.02 * kGravity);
  EXPECT_LT(engine->find("high")->base_velocity().linear_W.norm(), 1e-3);
}

TEST_P(ContactContract, StackIsAtRestAndLowestCarriesAll) {
  const auto engine = make(ground(), {object("low", Box{{0.2, 0.2, 0.1}}, at(0, 0, 0.051), 1.0),
                                      object("high", Box{{0.1, 0.1, 0.1}}, at(0.02, 0, 0.152), 0.5)});
  run(*engine, 2.0);
  EXPECT_NEAR(height(*engine, "low"), 0.05, 2 * within().penetration);
  EXPECT_NEAR(height(*engine, "high"), 0.15, 3 * within().penetration);
  EXPECT_NEAR(force_on(*engine, body_of(*engine, "high")).z(), 0.5 * kGravity, 0.05 * kGravity);
  EXPECT_NEAR(force_on(*engine, body_of(*engine, "low")).z(), 1.0 * kGravity, 0.05 * kGravity);
  EXPECT_LT(engine->find("high")->base_pose().translation().head<2>().norm(), 0.03);
}

TEST_P(ContactContract, HullRestsOnGroundAndOnBox) {
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "contract_wedge.obj";
  std::ofstream(file) << "v -0.05 -0.05 0\nv 0.05 -0.05 0\nv 0.05 0.05 0\nv -0.05 0.05 0\nv 0 0 0.08\n"
                         "f 1 3 2\nf 1 4 3\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n";
  const MeshGeometry wedge{file.string(), Eigen::Vector3d::Ones(), file.string()};
  const auto engine = make(ground(), {object("on_ground", wedge, at(0, 0, 0.001), 0.4),
                                      object("table", Box{{0.4, 0.4, 0.1}}, at(1, 0, 0.05), 0.0),
                                      object("on_table", wedge, at(1, 0, 0.101), 0.4)});
  run(*engine, 1.0);
  EXPECT_NEAR(height(*engine, "on_ground"), 0.0, within().penetration);
  EXPECT_NEAR(height(*engine, "on_table"), 0.1, within().penetration);
  double mean = 0;  // the contact points of a hull may change from step to step
  for (int i = 0; i < 100; ++i) {
    engine->step();
    mean += force_on(*engine, body_of(*engine, "on_table")).z() / 100;
  }
  EXPECT_NEAR(mean, 0.4 * kGravity, 0.04 * kGravity);
}

TEST_P(ContactContract, FrictionHoldsInsideConeAndSlidesOutside) {
  const double friction = 0.5;
  for (const double degrees : {20.0, 35.0}) {
    const double slope = degrees * 3.14159265358979 / 180;
    const Pose X_WS = make_pose({0, 0, 1}, {0, slope, 0});
    Pose X_WB = X_WS;
    X_WB.translation() += X_WS.linear() * Eigen::Vector3d(0, 0, 0.1 + 0.0249);
    const auto engine = make(settings(), {object("slope", Box{{20, 1, 0.2}}, X_WS, 0.0, friction),
                                          object("box", Box{{0.1, 0.1, 0.05}}, X_WB, 1.0, friction)});
    run(*engine, 0.2);  // it settles
    const auto speed = [&] {
      return X_WS.linear().col(0).dot(engine->find("box")->base_velocity().linear_W);
    };
    const double before = speed();
    run(*engine, 0.5);
    const double expected = degrees < 26 ? 0.0 : kGravity * (std::sin(slope) - friction * std::cos(slope));
    EXPECT_NEAR((speed() - before) / 0.5, expected, 0.02 * kGravity) << degrees;
  }
}

// A base that drives towards its ball. Its wheels spin and push with mu times their load, from which the
// acceleration takes off what it puts on the ball, or gives what it takes off it.
class SpinningBase : public ContactContract {
 protected:
  static constexpr double kMass = 10.0, kWheelMass = 0.5;  // kg
  static constexpr double kCentre = 0.1, kBall = 0.3;      // m, of the body and of the ball from the axle
  static constexpr double kRimSpeed = 8.0;                 // m/s
  struct Expected {
    double acceleration, load, effort;  // m/s^2; N on both wheels; N m of each
  };
  struct Range {
    double least = kInfinity, most = -kInfinity;
    void enter(double x) {
      least = std::min(least, x);
      most = std::max(most, x);
    }
  };
  static BaseShape shape_of(double friction) {
    BaseShape out;
    out.body_mass = kMass;
    out.wheel_mass = kWheelMass;
    out.friction = friction;
    return out;
  }
  static RobotDescription description(const BaseShape& shape) {
    RobotDescription out = make_base(shape);
    Inertial& body = *std::ranges::find(out.links, "base_link", &Link::name)->inertial;
    body.origin.xyz = {-kCentre, 0, 0};
    body.iyy = 0.2;
    std::ranges::find(out.joints, "ball_joint", &Joint::name)->origin.xyz.x() = -kBall;
    for (Joint& joint : out.joints) {
      if (joint.limits) joint.limits->velocity = 1000;
    }
    return out;
  }
  static Expected closed_form(const BaseShape& base) {
    const double mass = base.body_mass + 2 * base.wheel_mass, ball = kCasterFriction;
    const double behind = kCentre * base.body_mass / mass, height = base.radius;
    // N_ball = m (g behind - a height) / kBall,  m a = mu (m g - N_ball) - mu_ball N_ball
    const double both = (base.friction + ball) / kBall;
    const double a = kGravity * (base.friction - both * behind) / (1 - both * height);
    const double load = mass * (kGravity - (kGravity * behind - a * height) / kBall);
    return {a, load, base.friction * load * base.radius / 2};
  }
};
DOPPEL_FOR_EVERY_ENGINE(SpinningBase);

TEST_P(SpinningBase, SpinningWheelsPushEvenlyWithFrictionTimesLoad) {
  for (const double friction : {0.2, 0.5}) {
    const BaseShape shape = shape_of(friction);
    const Expected expected = closed_form(shape);
    WorldSettings world = ground();
    world.ground_friction = friction;
    const auto engine = make(
        world, {robot(description(shape), DrivenBase::options_for(Pose::Identity()), BaseKind::floating)});
    Instance base = engine->instance(0);
    const Model& model = base.model();
    run(*engine, 0.2);
    const int left = model.find_joint("left_wheel_joint"), right = model.find_joint("right_wheel_joint");
    for (const int wheel : {left, right}) {
      base.set_drive(wheel, DriveMode::velocity);
      base.set_target(wheel, -kRimSpeed / shape.radius);
    }
    run(*engine, 0.4);
    const BodyId wheel{base.index(), model.find_link("left_wheel")};
    const double before = base.base_velocity().linear_W.x();
    Range effort, rim, load;
    for (int i = 0; i < 200; ++i) {
      engine->step();
      effort.enter(-base.drive_effort()[static_cast<std::size_t>(left)]);
      rim.enter(-shape.radius * base.v()[static_cast<std::size_t>(model.joints[left].v)]);
      load.enter(2 * force_on(*engine, wheel).z());
    }
    const double acceleration = (before - base.base_velocity().linear_W.x()) / 0.2;
    EXPECT_NEAR(acceleration, expected.acceleration, 0.005 * expected.acceleration) << friction;
    for (const double measured : {effort.least, effort.most})
      EXPECT_NEAR(measured, expected.effort, 0.02 * expected.effort) << friction;
    for (const double measured : {rim.least, rim.most}) EXPECT_NEAR(measured, kRimSpeed, 0.02) << friction;
    for (const double measured : {load.least, load.most})
      EXPECT_NEAR(measured, expected.load, 0.02 * expected.load) << friction;
  }
}

// Boxes that touch with a face, parallel except for rounding: no contact is deeper than the boxes overlap.
// MuJoCo 2.2.2 alone reports decimetres for some of those that are turned about an edge only.
TEST_P(ContactContract, BarelyTouchingBoxesAreNoDeeperThanTheyOverlap) {
  const unsigned seed = 7;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1), size(0.05, 0.6), exponent(-7, -4);
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector3d a(size(random), size(random), size(random)),
        b(size(random), size(random), size(random));
    const double overlap = std::pow(10.0, exponent(random)), turn = std::pow(10.0, 2 * exponent(random) + 4);
    Eigen::Vector3d rpy(unit(random), unit(random), unit(random));
    if (i % 2 == 0) rpy.x() = rpy.z() = 0;
    const Pose X_WB = make_pose({a.x() / 2 + b.x() / 2 - overlap,
                                 i % 4 == 0 ? 0.0 : 0.4 * unit(random) * a.y(), 0.4 * unit(random) * a.z()},
                                turn * rpy);
    const auto engine =
        make(settings(), {object("a", Box{a}, at(0, 0, 0), 0.0), object("b", Box{b}, X_WB, 1.0)});
    std::vector<Contact> contacts;
    engine->contacts(contacts);
    for (const Contact& contact : contacts)
      ASSERT_LT(contact.depth, overlap + turn + 1e-5) << "seed " << seed << ", pair " << i;
  }
}

TEST_P(ContactContract, ContactsNameBodiesAndNormal) {
  const auto engine = make(ground(), {object("box", Box{{0.1, 0.1, 0.1}}, at(0, 0, 0.0499), 1.0)});
  run(*engine, 0.5);
  std::vector<Contact> contacts;
  engine->contacts(contacts);
  ASSERT_FALSE(contacts.empty());
  for (const Contact& contact : contacts) {
    EXPECT_TRUE(contact.a.is_ground() != contact.b.is_ground());
    const double up = contact.a.is_ground() ? 1.0 : -1.0;
    EXPECT_NEAR(contact.normal_W.z(), up, 1e-6);
    EXPECT_GE(contact.force_W.dot(contact.normal_W), 0.0);
    EXPECT_NEAR(contact.p_W.z(), 0.0, 1e-3);
  }
}

TEST_P(ContactContract, RobotAndObjectPushEachOther) {
  RobotDescription pusher;
  pusher.name = "pusher";
  pusher.links = {make_frame("rail"), make_link("plate", 1.0, {0, 0, 0}, {0.01, 0.01, 0.01})};
  Collision shape;
  shape.geometry = Box{{0.02, 0.3, 0.08}};
  pusher.links[1].collisions = {shape};
  pusher.joints = {make_joint("slide", JointType::prismatic, "rail", "plate", {0, 0, 0.05}, {1, 0, 0})};
  limit(pusher.joints[0], -1, 1, 100, 0.5);
  const auto engine =
      make(ground(), {robot(pusher), object("box", Box{{0.1, 0.1, 0.1}}, at(0.2, 0, 0.05), 1.0)});
  hold_all(engine->instance(0));
  engine->instance(0).set_target(0, 0.3);
  run(*engine, 2.0);
  EXPECT_NEAR(engine->find("box")->base_pose().translation().x(), 0.36, 0.02);
}

TEST_P(ContactContract, JoinedLinksNeverCollideAndOverlapsAreReported) {
  RobotDescription arm = make_double_pendulum(1, 0.2, 1, 0.2);
  Collision shape;
  shape.geometry = Sphere{0.15};  // deep penetration
  arm.links[1].collisions = arm.links[2].collisions = {shape};
  const auto engine = make(settings(), {robot(arm)});
  std::vector<Contact> contacts;
  engine->contacts(contacts);
  EXPECT_EQ(contacts.size(), 0u);
  const auto& excluded = engine->world().excluded_pairs();
  ASSERT_EQ(excluded.size(), 1u);
  EXPECT_EQ(excluded[0].reason, "joined by swing2");
}

TEST_P(ContactContract, RayHitsNearestSurface) {
  if (!can().rays) GTEST_SKIP() << "the engine has no rays";
  const auto engine = make(ground(), {object("box", Box{{0.2, 0.2, 0.2}}, at(0, 0, 0.5), 0.0),
                                      object("ball", Sphere{0.1}, at(1, 0, 0.5), 0.0),
                                      object("can", Cylinder{0.1, 0.3}, at(2, 0, 0.5), 0.0),
                                      object("pill", Capsule{0.1, 0.2}, at(3, 0, 0.5), 0.0)});
  const std::pair<const char*, double> down[] = {{"box", 1.4}, {"ball", 1.4}, {"can", 1.35}, {"pill", 1.3}};
  for (int i = 0; i < 4; ++i) {
    const RayHit hit = engine->cast_ray({static_cast<double>(i), 0.0, 2.0}, {0, 0, -3});
    EXPECT_NEAR(hit.distance, down[i].second, 1e-9) << down[i].first;
    EXPECT_EQ(hit.body, body_of(*engine, down[i].first));
    const RayHit side = engine->cast_ray({static_cast<double>(i), -2.0, 0.5}, {0, 1, 0});
    EXPECT_NEAR(side.distance, 1.9, 1e-9) << down[i].first;
  }
  const RayHit floor = engine->cast_ray({0.5, 0, 2}, {0, 0, -1});
  EXPECT_NEAR(floor.distance, 2.0, 1e-9);
  EXPECT_TRUE(floor.body.is_ground());
  EXPECT_LT(engine->cast_ray({0.5, 0, 2}, {0, 0, 1}).distance, 0);
  EXPECT_LT(engine->cast_ray({0.5, 0, 2}, {0, 0, 0}).distance, 0);
}

}  // namespace
}  // namespace doppel::test
