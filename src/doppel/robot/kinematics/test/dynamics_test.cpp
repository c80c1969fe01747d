#include "doppel/robot/kinematics/dynamics.h"

#include <gtest/gtest.h>

#include <cmath>

#include "doppel/robot/kinematics/test/integrate.h"
#include "doppel/robot/kinematics/test/robots.h"

namespace doppel {
namespace {

const Eigen::Vector3d kGravity(0, 0, -9.81);

Model compiled(const RobotDescription& robot) {
  Diagnostics diagnostics;
  return compile_model(robot, BaseKind::fixed, diagnostics);
}

Eigen::VectorXd random_vector(int size, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(-2, 2);
  return Eigen::VectorXd::NullaryExpr(size, [&] { return unit(random); });
}

const std::vector<JointType> kEveryKind = {JointType::floating, JointType::revolute,   JointType::fixed,
                                           JointType::planar,   JointType::continuous, JointType::prismatic};

TEST(InverseDynamics, MatchesClosedFormDoublePendulum) {
  const double m1 = 1.2, l1 = 0.7, m2 = 0.8, l2 = 0.5, g = 9.81;
  const Model model = compiled(test::make_double_pendulum(m1, l1, m2, l2));
  Data data(model);
  const unsigned seed = 3;
  std::mt19937 random(seed);
  for (int i = 0; i < 50; ++i) {
    const Eigen::VectorXd q = random_vector(2, random), v = random_vector(2, random),
                          a = random_vector(2, random);
    inverse_dynamics(model, data, q, v, a, kGravity);
    // Lagrange's equations with the relative angle q2 and a rotor inertia of 1e-6 kg m^2 on each bob.
    const double e = 1e-6, c2 = std::cos(q[1]), s2 = std::sin(q[1]);
    const double M11 = m1 * l1 * l1 + m2 * (l1 * l1 + l2 * l2 + 2 * l1 * l2 * c2) + 2 * e;
    const double M12 = m2 * (l2 * l2 + l1 * l2 * c2) + e, M22 = m2 * l2 * l2 + e, h = m2 * l1 * l2 * s2;
    const double g2 = m2 * g * l2 * std::sin(q[0] + q[1]);
    const double g1 = (m1 + m2) * g * l1 * std::sin(q[0]) + g2;
    EXPECT_NEAR(data.tau[0], M11 * a[0] + M12 * a[1] - h * (2 * v[0] + v[1]) * v[1] + g1, 1e-12)
        << "seed " << seed;
    EXPECT_NEAR(data.tau[1], M12 * a[0] + M22 * a[1] + h * v[0] * v[0] + g2, 1e-12) << "seed " << seed;
  }
}

TEST(InverseDynamics, MatchesMassMatrixAndBias) {
  const unsigned seed = 5;
  std::mt19937 random(seed);
  for (int i = 0; i < 30; ++i) {
    SCOPED_TRACE("seed " + std::to_string(seed) + " round " + std::to_string(i));
    const Model model = compiled(test::make_random_chain(kEveryKind, random));
    Data data(model);
    const Eigen::VectorXd q = test::random_configuration(model, random);
    const Eigen::VectorXd v = random_vector(model.nv, random), a = random_vector(model.nv, random);
    inverse_dynamics(model, data, q, v, Eigen::VectorXd::Zero(model.nv), kGravity);
    const Eigen::VectorXd bias = data.tau;
    inverse_dynamics(model, data, q, v, a, kGravity);
    mass_matrix(model, data, q);
    EXPECT_NEAR((data.tau - bias - data.M * a).norm(), 0, 1e-11 * (1 + data.tau.norm()));
    EXPECT_EQ((data.M - data.M.transpose()).norm(), 0);
    EXPECT_GT(data.M.ldlt().vectorD().minCoeff(), 0);
  }
}

// Independent of any recursion: each link's Newton-Euler equations with accelerations by finite differences
// of the forward kinematics along a path, projected by the Jacobians.
TEST(InverseDynamics, MatchesDAlembertOnFiniteDifferences) {
  const unsigned seed = 9;
  std::mt19937 random(seed);
  for (int round = 0; round < 10; ++round) {
    SCOPED_TRACE("seed " + std::to_string(seed) + " round " + std::to_string(round));
    const Model model = compiled(test::make_random_chain(kEveryKind, random));
    const Eigen::VectorXd q = test::random_configuration(model, random);
    const Eigen::VectorXd v = random_vector(model.nv, random), a = random_vector(model.nv, random);
    const double h = 1e-4;
    const auto at = [&](double t) {
      Data data(model);
      forward_kinematics(model, data, test::moved(model, q, v * t + 0.5 * a * t * t));
      return data;
    };
    const Data before = at(-h), now = at(0), after = at(h);
    Eigen::VectorXd tau = Eigen::VectorXd::Zero(model.nv);
    for (int i = 1; i < static_cast<int>(model.links.size()); ++i) {
      const MassProperties& body = *model.links[i].inertia;
      const auto com = [&](const Data& data) { return Eigen::Vector3d(data.X_WL[i] * body.com); };
      const Eigen::Vector3d acceleration = (com(after) - 2 * com(now) + com(before)) / (h * h);
      const auto rotation_rate = [&](const Data& from, const Data& to) {
        const Eigen::AngleAxisd turn(
            Eigen::Matrix3d(to.X_WL[i].linear() * from.X_WL[i].linear().transpose()));
        return Eigen::Vector3d(turn.angle() / h * turn.axis());
      };
      const Eigen::Vector3d w0 = rotation_rate(before, now), w1 = rotation_rate(now, after);
      const Eigen::Vector3d w = 0.5 * (w0 + w1), alpha = (w1 - w0) / h;
      const Eigen::Matrix3d I = now.X_WL[i].linear() * body.I * now.X_WL[i].linear().transpose();
      Eigen::Matrix<double, 6, Eigen::Dynamic> J(6, model.nv);
      jacobian(model, now, i, body.com, J);
      Eigen::Matrix<double, 6, 1> wrench;
      wrench << I * alpha + w.cross(I * w), body.mass * (acceleration - kGravity);
      tau += J.transpose() * wrench;
    }
    Data data(model);
    inverse_dynamics(model, data, q, v, a, kGravity);
    EXPECT_NEAR((data.tau - tau).norm(), 0, 2e-5 * (1 + tau.norm()));
  }
}

TEST(InverseDynamics, LeaderDriveCarriesMimicLoad) {
  RobotDescription robot = test::make_double_pendulum(1, 0.5, 0.4, 0.3);
  robot.joints[1].mimic = Mimic{"swing", -2.0, 0.0, {}};
  const Model model = compiled(robot);
  Data data(model);
  Eigen::Vector2d q(0.4, -0.8);
  gravity_torques(model, data, q, kGravity);
  Eigen::VectorXd drives;
  drive_torques(model, data, drives);
  // The change of potential energy with the leader's angle, by differences.
  const auto height = [&](double angle) {
    return -1.4 * 0.5 * std::cos(angle) - 0.4 * 0.3 * std::cos(angle - 2 * angle);
  };
  EXPECT_NEAR(drives[0], 9.81 * (height(0.4 + 1e-6) - height(0.4 - 1e-6)) / 2e-6, 1e-8);
  EXPECT_EQ(drives[1], 0);
}

TEST(CarriedInertia, MaximumIsThatOfStretchedArm) {
  const Model model = compiled(test::make_double_pendulum(1, 0.5, 0.4, 0.3));
  const Eigen::VectorXd carried = carried_inertia(model);
  EXPECT_NEAR(carried[0], 0.25 + 0.4 * 0.64, 1e-4);
  EXPECT_NEAR(carried[1], 0.4 * 0.09, 1e-5);
}

TEST(CarriedInertia, SamplesKeepLimitsAndMimics) {
  RobotDescription robot = test::make_double_pendulum(1, 0.5, 0.4, 0.3);
  robot.joints[0].type = JointType::revolute;
  test::limit(robot.joints[0], 0.5, 0.7, 1, 1);
  robot.joints[1].mimic = Mimic{"swing", 3.0, 0.1, {}};
  const Model model = compiled(robot);
  double lowest = 1, highest = 0;
  for (const Eigen::VectorXd& q : sample_configurations(model, 64)) {
    lowest = std::min(lowest, q[0]);
    highest = std::max(highest, q[0]);
    EXPECT_NEAR(q[1], 3 * q[0] + 0.1, 1e-12);
  }
  EXPECT_GE(lowest, 0.5);
  EXPECT_LE(highest, 0.7);
  EXPECT_LT(lowest, 0.51);
  EXPECT_GT(highest, 0.69);
}

}  // namespace
}  // namespace doppel
