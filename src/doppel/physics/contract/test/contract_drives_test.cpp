// The contract for every engine: drives, limits, friction and couplings of joints.

#include <algorithm>
#include <cmath>
#include <random>

#include "contract_rig.h"
#include "doppel/base/xml/xml.h"
#include "doppel/robot/kinematics/dynamics.h"

namespace doppel::test {
namespace {

class DrivesContract : public Contract {
 protected:
  // The torque of gravity on the horizontal pendulum of 1 kg at 0.5 m.
  static constexpr double kLoad = 1.0 * 0.5 * kGravity;
  static RobotDescription arm(double effort, double velocity) {
    RobotDescription out = make_pendulum(1.0, 0.5);
    limit(out.joints[0], -3, 3, effort, velocity);
    out.joints[0].type = JointType::revolute;
    return out;
  }
  // Two sliders side by side, the second of which follows the first.
  static RobotDescription gripper(double multiplier, double offset, double leader_mass = 0.2) {
    RobotDescription out;
    out.name = "gripper";
    out.links = {make_frame("palm"), make_link("left", leader_mass, {0, 0, 0}, {1e-4, 1e-4, 1e-4}),
                 make_link("right", 0.3, {0, 0, 0}, {1e-4, 1e-4, 1e-4})};
    out.joints = {
        make_joint("left_slide", JointType::prismatic, "palm", "left", {0, 0.1, 0.5}, {0, 0, 1}),
        make_joint("right_slide", JointType::prismatic, "palm", "right", {0, -0.1, 0.5}, {0, 0, 1})};
    limit(out.joints[0], -1, 1, 100, 1);
    limit(out.joints[1], -10, 10, 100, 10);
    out.joints[1].mimic = Mimic{"left_slide", multiplier, offset, {}};
    return out;
  }
  // A body of 40 kg on two legs of five joints each, whose drives are too weak to stop a fall.
  static RobotDescription biped() {
    RobotDescription out;
    out.name = "biped";
    out.links = {make_link("pelvis", 40, {0, 0, 0.2}, {1.5, 1.2, 0.8})};
    for (const std::string side : {"left_", "right_"}) {
      const double y = side == "left_" ? 0.1 : -0.1;
      std::string above = "pelvis";
      const auto add = [&](const std::string& name, const Eigen::Vector3d& at, const Eigen::Vector3d& axis,
                           double mass, double length) {
        const double across = mass * length * length / 12.0;
        out.links.push_back(
            make_link(side + name, mass, {0, 0, -0.5 * length}, {across, across, 0.2 * across}));
        out.joints.push_back(
            make_joint(side + name + "_joint", JointType::revolute, above, side + name, at, axis));
        limit(out.joints.back(), -2, 2, 15, kInfinity);
        above = side + name;
      };
      add("hip", {0, y, 0}, {1, 0, 0}, 1.5, 0.15);
      add("thigh", {0, 0, 0}, {0, 1, 0}, 5, 0.4);
      add("shank", {0, 0, -0.4}, {0, 1, 0}, 3, 0.4);
      add("heel", {0, 0, -0.4}, {0, 1, 0}, 0.3, 0.08);
      add("foot", {0, 0, 0}, {1, 0, 0}, 0.8, 0.1);
      out.links.back().collisions.push_back({"", {{0.03, 0, -0.06}, {}, {}}, Box{{0.2, 0.08, 0.03}}, {}});
    }
    return out;
  }
  // limit: of the velocity, rad/s.
  auto make_weightless_arm(double limit) {
    WorldSettings in = settings();
    in.gravity.setZero();
    InstanceOptions options;
    options.gravity.setZero();
    return make(in, {robot(arm(300, limit), options)});
  }
};
DOPPEL_FOR_EVERY_ENGINE(DrivesContract);

TEST_P(DrivesContract, HoldingAccelerationTakesInverseDynamicsEffort) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto engine = make(settings(), {robot(make_random_chain(six_hinges(), random))});
  Instance chain = engine->instance(0);
  const Model& model = chain.model();
  const Eigen::VectorXd q = Eigen::VectorXd::NullaryExpr(6, [&] { return unit(random); });
  set(chain, copy({q.data(), 6}));
  hold_all(chain);
  run(*engine, 2.0);
  Data data(model);
  gravity_torques(model, data, vector(chain.q()), {0, 0, -kGravity});
  for (int i = 0; i < 6; ++i)
    EXPECT_NEAR(chain.drive_effort()[static_cast<std::size_t>(i)], data.tau[i],
                within().holding * data.tau.cwiseAbs().maxCoeff());
}

// Targets that move at the velocity limit, as a limiter or a trajectory at the limit sends them, from 0 to
// 2.3 rad: the reference passes the binades 0.125, 0.25, 0.5, 1 and 2, where rounding changes. A critically
// damped drive that starts at once is at most 1 + exp(-2) times as fast as its reference.
TEST_P(DrivesContract, TargetsAtVelocityLimitMoveJointEvenly) {
  constexpr double kLimit = 2.0, kEnd = 2.3;
  for (const double hertz : {100.0, 500.0, 1000.0}) {
    for (const double start : {0.0, 0.0137, -0.31}) {
      WorldSettings in = settings();
      in.gravity.setZero();
      InstanceOptions options;
      options.gravity.setZero();
      const auto engine = make(in, {robot(arm(300, kLimit), options)});
      Instance pendulum = engine->instance(0);
      set(pendulum, {start});
      hold_all(pendulum);
      const int gap = static_cast<int>(std::lround(1000.0 / hertz));
      double target = start, fastest_at_start = 0, fastest = 0, slowest = 1e9, last = 0;
      for (int i = 0; i < 3000; ++i) {
        if (i % gap == 0) pendulum.set_target(0, target = std::min(target + kLimit / hertz, kEnd));
        engine->step();
        const double v = pendulum.v()[0], t = 1e-3 * (i + 1);
        if (t < 0.2) fastest_at_start = std::max(fastest_at_start, v);
        if (t >= 0.2) fastest = std::max(fastest, v);
        if (t >= 0.2 && t < (kEnd - start) / kLimit - 0.01) slowest = std::min(slowest, v);
        last = pendulum.q()[0];
      }
      EXPECT_LE(fastest_at_start, kLimit * (1 + std::exp(-2.0))) << hertz << " Hz from " << start;
      EXPECT_LE(fastest, 1.01 * kLimit) << hertz << " Hz from " << start;
      EXPECT_GE(slowest, 0.99 * kLimit) << hertz << " Hz from " << start;
      EXPECT_NEAR(last, kEnd, 1e-6);
    }
  }
}

// A reference that reaches the limit gradually, by 4 rad/s^2, and stays there: the joint neither lags nor
// exceeds.
TEST_P(DrivesContract, TrajectoryToVelocityLimitKeepsSpeed) {
  constexpr double kLimit = 2.0, kRamp = 4.0;
  const auto engine = make_weightless_arm(kLimit);
  Instance pendulum = engine->instance(0);
  set(pendulum, {-2.5});
  hold_all(pendulum);
  const auto speed = [&](double t) { return std::min(kRamp * t, kLimit); };
  double target = -2.5;
  for (int i = 0; i < 2200; ++i) {
    if (i % 10 == 0) {
      for (int k = 0; k < 10; ++k) target += 1e-3 * speed(1e-3 * (i + k) + 5e-4);
      pendulum.set_target(0, target);
    }
    engine->step();
    const double t = 1e-3 * (i + 1), v = pendulum.v()[0];
    EXPECT_LE(v, 1.03 * kLimit) << t;
    const double allowed = t > 0.8 ? 0.01 : t > 0.1 ? 0.04 : 1.0;
    EXPECT_NEAR(v, speed(t - 0.01), allowed * kLimit) << t;
  }
}

// Targets that run away from the limited reference: it is late when they stop, and the joint does not pass
// the end.
TEST_P(DrivesContract, TargetsBeyondVelocityLimitDoNotOvershootEnd) {
  constexpr double kLimit = 2.0, kEnd = 1.5;
  const auto engine = make_weightless_arm(kLimit);
  Instance pendulum = engine->instance(0);
  set(pendulum, {0.0});
  hold_all(pendulum);
  double fastest = 0, furthest = 0;
  for (int i = 0; i < 2000; ++i) {
    if (i % 10 == 0) pendulum.set_target(0, std::min(1.5 * kLimit * 1e-3 * (i + 10), kEnd));
    engine->step();
    fastest = std::max(fastest, pendulum.v()[0]);
    furthest = std::max(furthest, pendulum.q()[0]);
  }
  EXPECT_LE(fastest, 1.01 * kLimit);
  EXPECT_LE(furthest, kEnd + 1e-3);
  EXPECT_NEAR(pendulum.q()[0], kEnd, 1e-6);
}

// However many drives reach their bounds in one step, each exerts what its law requires at the velocity at
// the end of the step. An engine with iterated contacts may fail this in one of a hundred steps.
TEST_P(DrivesContract, DriveAtBoundsFollowsControlLaw) {
  if (!can().contacts || !can().floating) GTEST_SKIP() << "the engine has no contacts or no floating bodies";
  WorldSettings in = settings();
  in.ground = true;
  InstanceOptions options;
  options.X_WR = at(0, 0, 0.95);
  const auto engine = make(in, {robot(biped(), options, BaseKind::floating)});
  Instance legs = engine->instance(0);
  std::vector<double> q = copy(legs.q()), v(static_cast<std::size_t>(legs.model().nv), 0.0);
  for (std::size_t j = 0; j < legs.model().joints.size(); ++j) {
    const std::string& name = legs.model().joints[j].name;
    const double bent = name.ends_with("shank_joint") ? 0.8 : name.ends_with("hip_joint") ? 0.0 : -0.4;
    if (legs.model().joints[j].scalar() && !name.ends_with("foot_joint"))
      q[static_cast<std::size_t>(legs.model().joints[j].q)] = bent;
  }
  v[2] = -1.5;  // m/s down
  set(legs, q, v);
  hold_all(legs);
  int at_bounds = 0;
  int wrong = 0;
  for (int step = 0; step < 500; ++step) {
    const std::vector<double> before = copy(legs.q());
    engine->step();
    for (std::size_t j = 0; j < legs.model().joints.size(); ++j) {
      const ModelJoint& joint = legs.model().joints[j];
      if (!joint.scalar()) continue;
      const ServoParameters& servo = legs.made_of().servos[j];
      const auto k = static_cast<std::size_t>(joint.q);
      const double error =
          std::clamp(q[k] - before[k], -servo.effort / servo.stiffness, servo.effort / servo.stiffness);
      const double damping = std::max(servo.damping, servo.stiffness * 1e-3);
      const double asked = servo.stiffness * error - damping * legs.v()[static_cast<std::size_t>(joint.v)];
      const double effort = legs.drive_effort()[j];
      if (std::abs(effort - std::clamp(asked, -servo.effort, servo.effort)) > 1e-3) ++wrong;
      at_bounds += std::abs(effort) >= servo.effort ? 1 : 0;
    }
  }
  EXPECT_GT(at_bounds, 50);
  EXPECT_LE(100 * wrong, at_bounds);
}

TEST_P(DrivesContract, HeldJointSagsByTorqueOverStiffness) {
  const auto engine = make(settings(), {robot(arm(50, 10))});
  Instance pendulum = engine->instance(0);
  set(pendulum, {1.2});
  pendulum.set_drive(0, DriveMode::position);
  run(*engine, 2.0);
  const double sag = pendulum.q()[0] - pendulum.drive_reference(0);
  const double torque = kLoad * std::sin(pendulum.q()[0]);
  const double expected = -torque / pendulum.made_of().servos[0].stiffness;
  EXPECT_NEAR(sag, expected, within().sag * std::abs(expected));
  EXPECT_NEAR(pendulum.v()[0], 0.0, 1e-9);
}

// An undamped natural frequency of sqrt(stiffness / (inertia + armature)), without gravity.
TEST_P(DrivesContract, DescribedServoActs) {
  RobotDescription description = arm(50, 10);
  GazeboExtension extension;
  extension.reference = description.joints[0].name;
  extension.node = std::make_shared<const XmlNode>(
      parse_xml("<gazebo><doppel:servo stiffness='200' damping='4' armature='1.75'/></gazebo>", "arm.urdf"));
  description.gazebo.push_back(extension);
  WorldSettings weightless = settings();
  weightless.gravity.setZero();
  const auto engine = make(weightless, {robot(description)});
  Instance pendulum = engine->instance(0);
  EXPECT_EQ(pendulum.made_of().servos[0].stiffness, 200);
  pendulum.set_drive(0, DriveMode::position);
  pendulum.set_target(0, 0.1);
  std::vector<double> crossings;  // s
  double before = -0.1;
  for (int i = 1; i < 2000; ++i) {
    engine->step();
    const double now = pendulum.q()[0] - 0.1;
    if (before < 0 && now >= 0) crossings.push_back(1e-3 * (i - now / (now - before)));
    before = now;
  }
  ASSERT_GE(crossings.size(), 2U);
  const double frequency = 10, ratio = 4 / (2 * std::sqrt(200.0 * 2.0));
  EXPECT_NEAR(crossings[1] - crossings[0], 2 * M_PI / (frequency * std::sqrt(1 - ratio * ratio)), 0.01);
}

TEST_P(DrivesContract, DriveEffortIsLimited) {
  const auto engine = make(settings(1e-4), {robot(arm(2.0, 100))});
  Instance pendulum = engine->instance(0);
  pendulum.set_drive(0, DriveMode::position);
  pendulum.set_target(0, 2.5);
  double most = 0;
  for (int i = 0; i < 20000; ++i) {
    engine->step();
    most = std::max(most, std::abs(pendulum.drive_effort()[0]));
  }
  EXPECT_LE(most, 2.0);
  EXPECT_GT(most, 1.999);
  EXPECT_LT(pendulum.q()[0], 0.7);  // 2 N m of 4.9: it stalls where sin(q) = 0.41
}

TEST_P(DrivesContract, ServoThatIsSetActsUntilReset) {
  const auto engine = make(settings(), {robot(arm(50, 10))});
  Instance pendulum = engine->instance(0);
  pendulum.set_drive(0, DriveMode::position);
  pendulum.set_target(0, 1.2);
  run(*engine, 2.0);
  EXPECT_NEAR(pendulum.q()[0], 1.2, 0.01);
  ServoParameters weak = pendulum.made_of().servos[0];
  weak.effort = 2.0;
  pendulum.set_servo(0, weak);
  run(*engine, 0.3);
  EXPECT_NEAR(pendulum.drive_effort()[0], 2.0, 1e-9);
  EXPECT_LT(pendulum.q()[0], 1.1) << "2 N m of 4.6 do not hold it";
  const auto copy = engine->clone();
  copy->step();
  EXPECT_NEAR(copy->instance(0).drive_effort()[0], 2.0, 1e-9);
  engine->reset();
  pendulum.set_drive(0, DriveMode::position);
  pendulum.set_target(0, 1.2);
  run(*engine, 2.0);
  EXPECT_NEAR(pendulum.q()[0], 1.2, 0.01);
}

TEST_P(DrivesContract, DriveAtEffortLimitHasNoDamping) {
  WorldSettings in = settings(1e-4);
  in.gravity.setZero();
  const auto engine = make(in, {robot(arm(0.5, 1000))});
  Instance pendulum = engine->instance(0);
  pendulum.set_drive(0, DriveMode::position);
  pendulum.set_target(0, 3.0);
  run(*engine, 0.1);
  EXPECT_NEAR(pendulum.v()[0], 0.5 / 0.250001 * 0.1, 1e-6);
}

TEST_P(DrivesContract, DriveVelocityIsLimited) {
  const auto engine = make(settings(), {robot(arm(100, 0.7))});
  Instance pendulum = engine->instance(0);
  pendulum.set_drive(0, DriveMode::position);
  pendulum.set_target(0, 2.0);
  double fastest = 0;
  for (int i = 0; i < 2000; ++i) {
    engine->step();
    fastest = std::max(fastest, std::abs(pendulum.v()[0]));
  }
  EXPECT_LE(fastest, 0.7 * 1.001);
  EXPECT_GT(fastest, 0.65);
}

TEST_P(DrivesContract, VelocityDriveReachesItsVelocity) {
  WorldSettings in = settings();
  in.gravity.setZero();
  const auto engine = make(in, {robot(arm(100, 2))});
  Instance pendulum = engine->instance(0);
  pendulum.set_drive(0, DriveMode::velocity);
  pendulum.set_target(0, 0.5);
  run(*engine, 1.0);
  EXPECT_NEAR(pendulum.v()[0], 0.5, 1e-6);
}

TEST_P(DrivesContract, EffortDriveBalancesLoad) {
  const auto engine = make(settings(), {robot(arm(100, 10))});
  Instance pendulum = engine->instance(0);
  set(pendulum, {0.8});
  pendulum.set_drive(0, DriveMode::effort);
  pendulum.set_target(0, kLoad * std::sin(0.8));
  run(*engine, 0.5);
  EXPECT_NEAR(pendulum.q()[0], 0.8, 1e-4);
  EXPECT_DOUBLE_EQ(pendulum.drive_effort()[0], kLoad * std::sin(0.8));
}

TEST_P(DrivesContract, JointWithoutDriveFalls) {
  const auto engine = make(settings(), {robot(arm(100, 10))});
  Instance pendulum = engine->instance(0);
  set(pendulum, {1.0});
  pendulum.set_drive(0, DriveMode::position);
  pendulum.set_drive(0, DriveMode::passive);
  run(*engine, 0.2);
  EXPECT_LT(pendulum.q()[0], 0.9);
  EXPECT_EQ(pendulum.drive_effort()[0], 0.0);
}

TEST_P(DrivesContract, IdealServoLandsOnItsTarget) {
  if (!can().ideal) GTEST_SKIP() << "the engine has no ideal servos";
  InstanceOptions options;
  const RobotDescription description = arm(1.0, 10);
  Diagnostics notes;
  ServoOptions servo;
  servo.ideal = true;
  options.servos =
      choose_servos(compile_model(description, BaseKind::fixed, notes), servo, {0, 0, -kGravity});
  const auto engine = make(settings(), {robot(description, options)});
  Instance pendulum = engine->instance(0);
  pendulum.set_drive(0, DriveMode::position);
  pendulum.set_target(0, 1.0);
  run(*engine, 0.5);
  EXPECT_NEAR(pendulum.q()[0], 1.0, 1e-6);
}

TEST_P(DrivesContract, FrictionHoldsJointBelowItsEffort) {
  if (!can().friction) GTEST_SKIP() << "the engine has no joint friction";
  RobotDescription description = make_pendulum(1.0, 0.5);
  description.joints[0].dynamics = JointDynamics{0.0, 1.1 * kLoad, {}};
  const auto engine = make(settings(), {robot(description)});
  Instance pendulum = engine->instance(0);
  set(pendulum, {1.5707963});
  run(*engine, 1.0);
  EXPECT_LT(std::abs(pendulum.v()[0]), within().stiction);
  EXPECT_NEAR(pendulum.q()[0], 1.5707963, 1e-3);
}

TEST_P(DrivesContract, FrictionReducesEffort) {
  if (!can().friction) GTEST_SKIP() << "the engine has no joint friction";
  RobotDescription description = make_pendulum(1.0, 0.5);
  description.joints[0].dynamics = JointDynamics{0.0, 0.3, {}};
  WorldSettings in = settings();
  in.gravity.setZero();
  const auto engine = make(in, {robot(description)});
  engine->instance(0).apply_joint_effort(0, 0.8);
  run(*engine, 0.2);
  EXPECT_NEAR(engine->instance(0).v()[0], 0.5 / 0.250001 * 0.2, 2e-3);
}

// Without gravity 5 N m turn 0.25 kg m^2 up to the limit in 5 ms, and hold it there; the reverse effort
// brakes at once.
TEST_P(DrivesContract, EffortAcceleratesUpToVelocityLimit) {
  WorldSettings in = settings();
  in.gravity.setZero();
  RobotDescription description = arm(5, 0.1);
  description.joints[0].type = JointType::continuous;
  const auto engine = make(in, {robot(description)});
  Instance pendulum = engine->instance(0);
  pendulum.set_drive(0, DriveMode::effort);
  pendulum.set_target(0, 5.0);
  run(*engine, 0.5);
  EXPECT_NEAR(pendulum.v()[0], 0.1, 1e-3);
  EXPECT_NEAR(pendulum.drive_effort()[0], 0.0, 0.05);
  pendulum.set_target(0, -5.0);
  run(*engine, 1e-3);
  EXPECT_NEAR(pendulum.drive_effort()[0], -5.0, 1e-9);
}

TEST_P(DrivesContract, MimicFollowsItsLeaderUnderLoad) {
  if (!can().mimics) GTEST_SKIP() << "the engine has no mimic joints";
  const auto engine = make(settings(), {robot(gripper(-2.0, 0.3))});
  Instance pendulum = engine->instance(0);
  hold_all(pendulum);
  pendulum.set_target(0, 0.2);
  pendulum.apply_joint_effort(1, 15.0);
  double strayed = 0;
  for (int i = 0; i < 2000; ++i) {
    engine->step();
    strayed = std::max(strayed, std::abs(pendulum.q()[1] - (-2.0 * pendulum.q()[0] + 0.3)));
  }
  EXPECT_LT(strayed, within().mimic);
  EXPECT_NEAR(pendulum.q()[0], 0.2, 0.02);
}

// The coupling acts in both directions: a force on the follower moves the leader.
TEST_P(DrivesContract, LoadOnMimicMovesItsLeader) {
  if (!can().mimics) GTEST_SKIP() << "the engine has no mimic joints";
  WorldSettings in = settings(1e-4);
  in.gravity.setZero();
  const auto engine = make(in, {robot(gripper(2.0, 0.0))});
  Instance pendulum = engine->instance(0);
  pendulum.apply_joint_effort(1, 1.4);
  run(*engine, 0.1);
  // (m1 + 4 m2) a = 2 * 1.4
  EXPECT_NEAR(pendulum.v()[0], 2 * 1.4 / (0.2 + 4 * 0.3) * 0.1, 2e-3);
  EXPECT_NEAR(pendulum.v()[1], 2 * pendulum.v()[0], 1e-3);
}

// A leader without mass of its own, as the input of a hand's synergy: both sliders fall as one body with
// (m1 + r^2 m2) a = -(m1 + r m2) g, whatever the ratio.
TEST_P(DrivesContract, MimicsOfWeightlessLeaderMoveAsOneBody) {
  if (!can().mimics) GTEST_SKIP() << "the engine has no mimic joints";
  for (const double ratio : {-0.05, 0.3, 1.0, 4.0}) {
    SCOPED_TRACE(ratio);
    const auto engine = make(settings(1e-4), {robot(gripper(ratio, 0.1, 1e-8))});
    Instance pendulum = engine->instance(0);
    const double duration = 0.02;
    run(*engine, duration);
    const double acceleration = -kGravity / ratio;
    EXPECT_NEAR(pendulum.v()[0], acceleration * duration, 1e-3 * std::abs(acceleration * duration));
    EXPECT_NEAR(pendulum.v()[1], -kGravity * duration, 1e-3 * kGravity * duration);
    EXPECT_NEAR(pendulum.q()[1], ratio * pendulum.q()[0] + 0.1, within().mimic);
  }
}

TEST_P(DrivesContract, MimicsOfWeightlessLeaderHoldTheirLoad) {
  if (!can().mimics) GTEST_SKIP() << "the engine has no mimic joints";
  for (const double ratio : {-0.05, 0.3, 1.0, 4.0}) {
    SCOPED_TRACE(ratio);
    const auto engine = make(settings(), {robot(gripper(ratio, 0.1, 1e-8))});
    Instance pendulum = engine->instance(0);
    hold_all(pendulum);
    pendulum.set_target(0, 0.02);
    pendulum.apply_joint_effort(1, -5.0);
    run(*engine, 2.0);
    const double load = ratio * (0.3 * kGravity + 5.0);
    const double sag = load / pendulum.made_of().servos[0].stiffness;
    EXPECT_NEAR(pendulum.q()[0], 0.02 - sag, 1e-5);
    EXPECT_NEAR(pendulum.q()[1], ratio * pendulum.q()[0] + 0.1, within().mimic);
    EXPECT_NEAR(pendulum.drive_effort()[0], load, 1e-3 * std::abs(load));
  }
}

// The limit of a leader without mass stops what it leads.
TEST_P(DrivesContract, LimitOfWeightlessLeaderStopsItsMimic) {
  if (!can().mimics) GTEST_SKIP() << "the engine has no mimic joints";
  RobotDescription description = gripper(0.5, 0.0, 1e-8);
  description.joints[0].limits->lower = -0.1;
  const auto engine = make(settings(), {robot(description)});
  Instance pendulum = engine->instance(0);
  run(*engine, 2.0);
  EXPECT_NEAR(pendulum.q()[0], -0.1, 2e-3);
  EXPECT_NEAR(pendulum.q()[1], -0.05, 1e-3);
  EXPECT_NEAR(pendulum.v()[0], 0.0, 1e-3);
}

TEST_P(DrivesContract, JointStopsAtItsLimit) {
  RobotDescription description = arm(100, 10);
  description.joints[0].limits->lower = 0.4;
  const auto engine = make(settings(), {robot(description)});
  Instance pendulum = engine->instance(0);
  set(pendulum, {1.0});
  run(*engine, 3.0);
  EXPECT_NEAR(pendulum.q()[0], 0.4, 2e-3);
  EXPECT_NEAR(pendulum.v()[0], 0.0, 1e-3);
}

TEST_P(DrivesContract, SoftLimitYieldsByLoadOverStiffness) {
  if (!can().stops) GTEST_SKIP() << "the engine has no stops with a stiffness";
  RobotDescription description = arm(100, 10);
  description.joints[0].limits->lower = 0.4;
  Diagnostics notes;
  auto shared = std::make_shared<const RobotDescription>(description);
  Model model = compile_model(description, BaseKind::fixed, notes);
  model.joints[0].stop_stiffness = 500;
  const auto engine =
      make(settings(), {make_instance(shared, std::make_shared<const Model>(model), {}, meshes_, notes)});
  Instance pendulum = engine->instance(0);
  set(pendulum, {0.5});
  run(*engine, 3.0);
  EXPECT_NEAR(pendulum.q()[0], 0.4 - kLoad * std::sin(pendulum.q()[0]) / 500, 1e-5);
}

}  // namespace
}  // namespace doppel::test
