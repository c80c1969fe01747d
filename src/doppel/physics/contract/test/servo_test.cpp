#include "doppel/physics/contract/servo.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "doppel/physics/contract/test/engine_fixture.h"

namespace doppel {
namespace {

using test::Rig;

const Eigen::Vector3d kGravity(0, 0, -9.81);

Model arm(double mass, double length, double effort) {
  RobotDescription robot = test::make_pendulum(mass, length);
  robot.joints[0].type = JointType::revolute;
  test::limit(robot.joints[0], -3, 3, effort, 5);
  Diagnostics diagnostics;
  return compile_model(robot, BaseKind::fixed, diagnostics);
}

TEST(Servo, StiffnessFollowsInertia) {
  const Model model = arm(2.0, 1.0, 100);
  const ServoParameters servo = choose_servos(model, {}, Eigen::Vector3d::Zero())[0];
  EXPECT_NEAR(servo.stiffness, 2.0 * 60 * 60, 0.1);
  EXPECT_NEAR(servo.damping, 2 * 2.0 * 60, 0.01);
  EXPECT_EQ(servo.velocity, 5);
  EXPECT_EQ(servo.effort, 100);
}

TEST(Servo, FullEffortIsReachedAtSmallError) {
  const Model wrist = arm(0.1, 0.1, 2.0);  // 1e-3 kg m^2
  EXPECT_NEAR(choose_servos(wrist, {}, Eigen::Vector3d::Zero())[0].stiffness, 20.0, 1e-9);
  const Model exported = arm(0.1, 0.1, 1000.0);  // an exporter's effort must not result in a loop of 3 kHz
  EXPECT_NEAR(choose_servos(exported, {}, Eigen::Vector3d::Zero())[0].stiffness, 250.0, 1.0);
}

TEST(Servo, StiffnessIsRaisedForGravity) {
  const Model model = arm(1.3, 0.15, 10);  // 1.9 N m when horizontal, 0.03 kg m^2
  const auto servos = choose_servos(model, {}, kGravity);
  EXPECT_GT(servos[0].stiffness, 250);
  Data data(model);
  const Eigen::VectorXd level = Eigen::VectorXd::Constant(1, std::numbers::pi / 2);
  StaticSag found;
  static_sag(model, data, servos, level, kGravity, found);
  const auto& sags = found.sags;
  ASSERT_EQ(sags.size(), 1u);
  EXPECT_NEAR(sags[0].torque, 1.3 * 9.81 * 0.15, 1e-9);
  EXPECT_LT(std::abs(sags[0].sag), 1.02 * kMaxSag);
  EXPECT_NEAR(sags[0].margin, 10 - 1.3 * 9.81 * 0.15, 1e-9);
}

TEST(Servo, WeakDriveHasNegativeMargin) {
  const Model model = arm(1.3, 0.15, 1.0);
  const auto servos = choose_servos(model, {}, kGravity);
  Data data(model);
  StaticSag found;
  static_sag(model, data, servos, Eigen::VectorXd::Constant(1, std::numbers::pi / 2), kGravity, found);
  EXPECT_NEAR(found.sags[0].margin, 1.0 - 1.3 * 9.81 * 0.15, 1e-9);
}

TEST(Servo, FrictionGivesSagInterval) {
  RobotDescription robot = test::make_pendulum(1.0, 0.2);
  robot.joints[0].type = JointType::revolute;
  test::limit(robot.joints[0], -3, 3, 20, 2);
  robot.joints[0].dynamics = JointDynamics{0.0, 0.5, {}};
  std::vector<double> found;
  for (const double from : {0.5, 1.5}) {  // from below and from above
    Rig rig(robot);
    rig.set_state({from});
    rig.hold_all();
    rig.robot.set_target(0, 1.0);
    rig.run(3.0);
    Data data(rig.model);
    StaticSag sag;
    const Eigen::VectorXd q = Eigen::VectorXd::Constant(1, rig.q("swing"));
    static_sag(rig.model, data, {rig.servos().begin(), rig.servos().end()}, q, kGravity, sag);
    const Sag& s = sag.sags[0];
    EXPECT_EQ(s.friction, 0.5);
    EXPECT_NEAR(s.most - s.sag, 0.5 / rig.servos()[0].stiffness, 1e-12);
    EXPECT_NEAR(s.sag - s.least, 0.5 / rig.servos()[0].stiffness, 1e-12);
    found.push_back(1.0 - rig.q("swing"));
    EXPECT_GT(found.back(), s.least - 1e-6);
    EXPECT_LT(found.back(), s.most + 1e-6);
  }
  EXPECT_GT(found[0] - found[1], 1e-4)
      << "expected a position within the friction band that depends on the direction of approach";
}

TEST(Servo, JointOnLimitDoesNotSag) {
  RobotDescription robot = test::make_pendulum(1.0, 0.2);
  robot.joints[0].type = JointType::revolute;
  test::limit(robot.joints[0], 0.5, 3, 1.0, 2);
  Rig rig(robot);
  rig.set_state({0.5});
  rig.hold_all();
  rig.run(2.0);
  EXPECT_NEAR(rig.q("swing"), 0.5, kOnLimit);
  Data data(rig.model);
  StaticSag sag;
  const Eigen::VectorXd q = Eigen::VectorXd::Constant(1, rig.q("swing"));
  const std::vector<ServoParameters> servos(rig.servos().begin(), rig.servos().end());
  static_sag(rig.model, data, servos, q, kGravity, sag);
  EXPECT_TRUE(sag.sags[0].on_limit);
  EXPECT_GT(sag.sags[0].torque, 0.9);
  EXPECT_EQ(sag.sags[0].sag, 0.0);
  EXPECT_EQ(sag.sags[0].most, 0.0);
  EXPECT_EQ(sag.sags[0].margin, 1.0);
}

TEST(Servo, MimicsAndFixedJointsHaveNoServo) {
  RobotDescription robot = test::make_double_pendulum(1, 0.5, 0.4, 0.3);
  robot.joints[1].mimic = Mimic{"swing", 1, 0, {}};
  Diagnostics diagnostics;
  const auto servos = choose_servos(compile_model(robot, BaseKind::fixed, diagnostics), {}, kGravity);
  EXPECT_GT(servos[0].stiffness, 0);
  EXPECT_EQ(servos[1].stiffness, 0);
}

// ------------------------------------------------------------------------------------------- in the engine

RobotDescription limited_pendulum(double effort, double velocity) {
  RobotDescription robot = test::make_pendulum(1.0, 0.2);
  robot.joints[0].type = JointType::revolute;
  test::limit(robot.joints[0], -3, 3, effort, velocity);
  return robot;
}

TEST(Servo, SagIsTorqueOverStiffness) {
  Rig rig(limited_pendulum(20, 2));
  rig.hold_all();
  rig.robot.set_target(0, 1.0);
  rig.run(3.0);
  const double torque = 1.0 * 9.81 * 0.2 * std::sin(rig.q("swing"));
  const double sag = 1.0 - rig.q("swing");
  EXPECT_NEAR(sag, torque / rig.servos()[0].stiffness, 0.01 * sag);
  EXPECT_NEAR(rig.effort("swing"), torque, 1e-6);
}

TEST(Servo, LoadBeyondEffortSinks) {
  Rig rig(limited_pendulum(1.0, 2));  // 1.96 N m would be needed when horizontal
  rig.set_state({std::numbers::pi / 2});
  rig.hold_all();
  double worst = 0;
  for (int i = 0; i < 5000; ++i) {
    rig.engine->step();
    worst = std::max(worst, std::abs(rig.effort("swing")));
  }
  EXPECT_LE(worst, 1.0 + 1e-12);
  EXPECT_LT(rig.q("swing"), 0.7) << "expected less than asin(1 / 1.96), where the effort would just hold";
}

TEST(Servo, StepTakesTimeOfVelocityLimit) {
  Rig rig(limited_pendulum(50, 0.5), [] {
    World space = test::empty_space();
    space.gravity.setZero();
    return space;
  }());
  rig.hold_all();
  rig.robot.set_target(0, 1.0);
  double fastest = 0, arrival = 0;
  for (int i = 0; i < 4000; ++i) {
    rig.engine->step();
    fastest = std::max(fastest, rig.v("swing"));
    if (arrival == 0 && rig.q("swing") > 0.99) arrival = to_seconds(rig.engine->time());
  }
  EXPECT_LE(fastest, 0.5 * 1.005);
  EXPECT_NEAR(arrival, 2.0, 0.05);
  EXPECT_NEAR(rig.q("swing"), 1.0, 1e-6);
}

TEST(Servo, ReleasedJointIsNotAccelerated) {
  Rig rig(limited_pendulum(5, 0.5));
  rig.hold_all();
  rig.robot.set_target(0, 2.0);
  rig.robot.apply_joint_effort(0, -7.0);  // held down by more than the drive can exert
  rig.run(3.0);
  EXPECT_LT(rig.q("swing"), 0.0);
  rig.engine->clear_applied();
  double fastest = 0;
  for (int i = 0; i < 12000; ++i) {
    rig.engine->step();
    if (rig.q("swing") > 0.2) fastest = std::max(fastest, rig.v("swing"));
  }
  EXPECT_LT(fastest, 0.55);
  EXPECT_NEAR(rig.q("swing"), 2.0, 0.01);
}

TEST(Servo, VelocityAndEffortAreHeld) {
  Rig rig(limited_pendulum(20, 2));
  rig.robot.set_drive(0, DriveMode::velocity);
  rig.robot.set_target(0, 0.5);
  rig.run(2.0);
  EXPECT_NEAR(rig.v("swing"), 0.5, 0.01);
  EXPECT_NEAR(rig.q("swing"), 1.0, 0.05);
  Rig pushed(limited_pendulum(20, 2));
  pushed.robot.set_drive(0, DriveMode::effort);
  pushed.robot.set_target(0, 0.5);
  pushed.engine->step();
  EXPECT_NEAR(pushed.v("swing"), 0.5 / 0.04 * 1e-3, 1e-5);
  EXPECT_EQ(pushed.effort("swing"), 0.5);
}

TEST(Servo, IdealServoFollowsExactly) {
  InstanceOptions options;
  Diagnostics diagnostics;
  const RobotDescription robot = limited_pendulum(0.1, 2);  // far too weak if it were real
  const Model model = compile_model(robot, BaseKind::fixed, diagnostics);
  ServoOptions ideal;
  ideal.ideal = true;
  options.servos = choose_servos(model, ideal, kGravity);
  Rig rig(robot, test::empty_space(), options);
  rig.hold_all();
  rig.robot.set_target(0, 1.0);
  rig.run(0.25);
  EXPECT_NEAR(rig.q("swing"), 0.5, 1e-6) << "expected a position on the way at 2 rad/s";
  rig.run(0.5);
  EXPECT_NEAR(rig.q("swing"), 1.0, 1e-6);

  World explicit_world = test::empty_space();
  explicit_world.integrator = Integrator::rk4;
  EXPECT_THROW(Rig(robot, explicit_world, options), InputError);
}

// A joint with a hundredth of the inertia that its servo was designed for must not vibrate.
TEST(Servo, SmallInertiaIsStable) {
  const RobotDescription robot = limited_pendulum(20, 2);
  InstanceOptions options;
  for (const double factor : {1.0, 10.0, 100.0}) {
    ServoParameters servo;
    servo.stiffness = 0.04 * 3600 * factor;
    servo.damping = 2 * std::sqrt(servo.stiffness * 0.04 * factor);
    servo.effort = 20;
    servo.velocity = 2;
    options.servos = {servo};
    Rig rig(robot, test::empty_space(), options);
    rig.hold_all();
    rig.robot.set_target(0, 1.0);
    rig.run(3.0);
    EXPECT_NEAR(rig.v("swing"), 0, 1e-5) << factor;
    EXPECT_NEAR(rig.q("swing"), 1.0, 0.02) << factor;
  }
}

// Stiffness without any damping, at a frequency beyond the step's: the minimum of the damping keeps it
// stable.
TEST(Servo, FrequencyBeyondStepIsStable) {
  InstanceOptions options;
  options.servos = {{0.04 * 9e6, 0.0, kInfinity, 2.0, false}};  // 3000 rad/s at 1 kHz
  Rig rig(limited_pendulum(20, 2), test::empty_space(), options);
  rig.hold_all();
  rig.robot.set_target(0, 1.0);
  rig.run(2.0);
  EXPECT_NEAR(rig.q("swing"), 1.0, 1e-4);
  EXPECT_NEAR(rig.v("swing"), 0.0, 1e-3);
}

}  // namespace
}  // namespace doppel
