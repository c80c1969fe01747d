#include "doppel/robot/semantics/acceleration_limits.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "doppel/robot/kinematics/dynamics.h"
#include "doppel/robot/kinematics/test/robots.h"

namespace doppel {
namespace {

const Eigen::Vector3d kGravity(0, 0, -9.81);
constexpr double kRotor = 1e-6;  // kg m^2, of the bobs in test::make_pendulum

Model compiled(const RobotDescription& robot) {
  Diagnostics diagnostics;
  return compile_model(robot, BaseKind::fixed, diagnostics);
}

TEST(AccelerationLimits, PendulumGetsWhatGravityLeavesByItsInertia) {
  const double m = 0.7, l = 0.3, tau = 3.5, g = 9.81;
  RobotDescription robot = test::make_pendulum(m, l);
  robot.joints[0].type = JointType::revolute;
  // A right angle, where gravity is at its worst, is the middle of the range and nearly met by samples.
  test::limit(robot.joints[0], 0, M_PI, tau, 1);
  const AccelerationLimits found = acceleration_limits(compiled(robot), kGravity);
  ASSERT_EQ(found.joints.size(), 1U);
  EXPECT_EQ(found.joints[0].kind, AccelerationKind::derived);
  EXPECT_NEAR(found.joints[0].limit, (tau - m * g * l) / (m * l * l + kRotor), 1e-3);
  EXPECT_NEAR(found.joints[0].gravity, m * g * l, 1e-4);
  EXPECT_NEAR(found.joints[0].inertia, m * l * l + kRotor, 1e-12);
  EXPECT_EQ(found.share, 1);
  EXPECT_EQ(found.decisive, -1);
  // Without gravity it is the torque by the inertia.
  EXPECT_NEAR(acceleration_limits(compiled(robot), Eigen::Vector3d::Zero()).joints[0].limit,
              tau / (m * l * l + kRotor), 1e-9);
}

TEST(AccelerationLimits, SlideGetsForceByMass) {
  RobotDescription robot = test::make_pendulum(2.5, 0.3);
  robot.joints[0].type = JointType::prismatic;
  test::limit(robot.joints[0], -1, 1, 40, 1);  // along y, across gravity
  EXPECT_NEAR(acceleration_limits(compiled(robot), kGravity).joints[0].limit, 40 / 2.5, 1e-12);
  robot.joints[0].axis = Eigen::Vector3d::UnitZ();
  EXPECT_NEAR(acceleration_limits(compiled(robot), kGravity).joints[0].limit, 40 / 2.5 - 9.81, 1e-12);
}

TEST(AccelerationLimits, MimicLoadsDriveOfLeader) {
  RobotDescription robot = test::make_pendulum(1.0, 0.2);
  robot.links.push_back(test::make_link("other", 0.5, {0, 0, 0.1}, {1e-6, 1e-6, 1e-6}));
  robot.joints.push_back(
      test::make_joint("follower", JointType::continuous, "post", "other", {0, 0, 1}, {0, 1, 0}));
  test::limit(robot.joints[0], 0, 0, 5, 1);
  robot.joints[1].mimic = Mimic{"swing", -2.0, 0.0, {}};
  const AccelerationLimits found = acceleration_limits(compiled(robot), Eigen::Vector3d::Zero());
  const double inertia = 1.0 * 0.04 + kRotor + 4 * (0.5 * 0.01 + kRotor);
  EXPECT_NEAR(found.joints[0].limit, 5 / inertia, 1e-9);
  EXPECT_EQ(found.joints[1].kind, AccelerationKind::follows);
  EXPECT_NEAR(found.joints[1].limit, 2 * found.joints[0].limit, 1e-9);
}

TEST(AccelerationLimits, TwoLinkArmIsBoundedByDriveThatBothLoad) {
  const double m1 = 1.2, l1 = 0.7, m2 = 0.8, l2 = 0.5, tau1 = 30, tau2 = 10;
  RobotDescription robot = test::make_double_pendulum(m1, l1, m2, l2);
  test::limit(robot.joints[0], 0, 0, tau1, 1);
  test::limit(robot.joints[1], 0, 0, tau2, 1);
  // Without gravity, stretched (the first sample) all inertias are largest.
  const AccelerationLimits found = acceleration_limits(compiled(robot), Eigen::Vector3d::Zero());
  const double M11 = m1 * l1 * l1 + m2 * (l1 + l2) * (l1 + l2) + 2 * kRotor;
  const double M12 = m2 * (l2 * l2 + l1 * l2) + kRotor, M22 = m2 * l2 * l2 + kRotor;
  const double alone1 = std::min(tau1 / M11, tau2 / M12), alone2 = std::min(tau2 / M22, tau1 / M12);
  const double share = std::min(tau1 / (M11 * alone1 + M12 * alone2), tau2 / (M12 * alone1 + M22 * alone2));
  EXPECT_NEAR(found.joints[0].alone, alone1, 1e-9);
  EXPECT_NEAR(found.joints[1].alone, alone2, 1e-9);
  EXPECT_NEAR(found.share, share, 1e-12);
  EXPECT_NEAR(found.joints[0].limit, share * alone1, 1e-9);
  EXPECT_NEAR(found.joints[1].limit, share * alone2, 1e-9);
  EXPECT_GE(found.decisive, 0);
}

TEST(AccelerationLimits, JointsWithoutLimitHaveTheirReason) {
  RobotDescription robot = test::make_double_pendulum(1, 0.5, 0.5, 0.4);
  test::limit(robot.joints[1], 0, 0, 0.5, 1);  // holds 0.5 of 1.96 N m
  const AccelerationLimits found = acceleration_limits(compiled(robot), kGravity);
  EXPECT_EQ(found.joints[0].kind, AccelerationKind::no_effort);
  EXPECT_EQ(found.joints[1].kind, AccelerationKind::cannot_hold);
  EXPECT_NEAR(found.joints[1].gravity, 0.5 * 9.81 * 0.4, 1e-3);
  for (const JointAcceleration& joint : found.joints) EXPECT_EQ(joint.limit, kInfinity);
  EXPECT_EQ(found.share, 1);
}

TEST(AccelerationLimits, JointThatMovesNothingHasNone) {
  RobotDescription robot = test::make_pendulum(1, 0.5);
  robot.links[1].inertial.reset();
  test::limit(robot.joints[0], 0, 0, 5, 1);
  Model model = compiled(robot);
  model.links[1].inertia.reset();  // compile_model estimates one
  EXPECT_EQ(acceleration_limits(model, kGravity).joints[0].kind, AccelerationKind::no_inertia);
}

// At every sample, whatever directions the joints accelerate in, no drive is overloaded, and one of them is
// loaded fully.
TEST(AccelerationLimits, NoDriveIsOverloadedInAnyDirection) {
  const unsigned seed = 11;
  std::mt19937 random(seed);
  for (int round = 0; round < 10; ++round) {
    SCOPED_TRACE("seed " + std::to_string(seed) + " round " + std::to_string(round));
    std::vector<JointType> types = test::six_hinges();
    types[static_cast<std::size_t>(round % 6)] = JointType::prismatic;
    RobotDescription robot = test::make_random_chain(types, random);
    for (Joint& joint : robot.joints) test::limit(joint, -0.2, 0.3, 25, 1);
    const Model model = compiled(robot);
    const AccelerationLimits found = acceleration_limits(model, kGravity);
    EXPECT_GE(found.share, 1.0 / 6);
    EXPECT_LT(found.share, 1);
    Data data(model);
    const Eigen::VectorXd still = Eigen::VectorXd::Zero(model.nv);
    double fullest = 0;
    for (const Eigen::VectorXd& q : sample_configurations(model, kAccelerationSamples)) {
      for (int signs = 0; signs < 64; ++signs) {
        Eigen::VectorXd a(model.nv);
        for (int i = 0; i < 6; ++i)
          a[i] = (signs >> i & 1 ? 1 : -1) * found.joints[static_cast<std::size_t>(i)].limit;
        ASSERT_TRUE(a.allFinite());
        inverse_dynamics(model, data, q, still, a, kGravity);
        fullest = std::max(fullest, data.tau.cwiseAbs().maxCoeff() / 25);
      }
    }
    EXPECT_LE(fullest, 1 + 1e-9);
    EXPECT_GE(fullest, 1 - 1e-9);
  }
}

}  // namespace
}  // namespace doppel
