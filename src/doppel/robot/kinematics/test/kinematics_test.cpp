#include "doppel/robot/kinematics/kinematics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "doppel/robot/kinematics/test/integrate.h"
#include "doppel/robot/kinematics/test/robots.h"

namespace doppel {
namespace {

TEST(Kinematics, ForwardKinematicsMatchesHandComputation) {
  // A hinge about z at height 1 with a 0.5 m arm along x, then a slide along the arm's y, then a fixed tool.
  RobotDescription robot;
  robot.links = {test::make_frame("base"), test::make_link("arm", 1, {0, 0, 0}, {1, 1, 1}),
                 test::make_link("slide", 1, {0, 0, 0}, {1, 1, 1}), test::make_frame("tool")};
  robot.joints = {test::make_joint("turn", JointType::continuous, "base", "arm", {0, 0, 1}, {0, 0, 1}),
                  test::make_joint("push", JointType::prismatic, "arm", "slide", {0.5, 0, 0}, {0, 3, 0}),
                  test::make_joint("weld", JointType::fixed, "slide", "tool", {0, 0, 0.2}, {1, 0, 0})};
  robot.joints[2].origin.rpy = {std::numbers::pi / 2, 0, 0};
  test::limit(robot.joints[1], -1, 1, 1, 1);
  Diagnostics diagnostics;
  const Model model = compile_model(robot, BaseKind::fixed, diagnostics);
  Data data(model);
  Eigen::Vector2d q(0.3, 0.1);
  forward_kinematics(model, data, q);
  const double c = std::cos(0.3), s = std::sin(0.3);
  const Pose& X_WT = data.X_WL[3];
  EXPECT_NEAR((X_WT.translation() - Eigen::Vector3d(0.5 * c - 0.1 * s, 0.5 * s + 0.1 * c, 1.2)).norm(), 0,
              1e-15);
  EXPECT_NEAR((X_WT.linear().col(2) - Eigen::Vector3d(s, -c, 0)).norm(), 0, 1e-15)
      << "expected z of the tool to be -y of the arm";
  EXPECT_NEAR((relative_pose(data, 3, 2).translation() - Eigen::Vector3d(0, -0.2, 0)).norm(), 0, 1e-15);
}

TEST(Kinematics, JacobianIsDerivativeOfPose) {
  const unsigned seed = 11;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int round = 0; round < 20; ++round) {
    SCOPED_TRACE("seed " + std::to_string(seed) + " round " + std::to_string(round));
    const RobotDescription robot =
        test::make_random_chain({JointType::floating, JointType::revolute, JointType::planar,
                                 JointType::prismatic, JointType::continuous},
                                random);
    Diagnostics diagnostics;
    const Model model = compile_model(robot, BaseKind::fixed, diagnostics);
    const Eigen::VectorXd q = test::random_configuration(model, random);
    const Eigen::VectorXd v = Eigen::VectorXd::NullaryExpr(model.nv, [&] { return unit(random); });
    const Eigen::Vector3d p_LoP_L(0.1, -0.2, 0.3);
    const int link = static_cast<int>(model.links.size()) - 1;
    Data data(model), before(model), after(model);
    const double h = 1e-5;
    forward_kinematics(model, data, q);
    forward_kinematics(model, before, test::moved(model, q, -h * v));
    forward_kinematics(model, after, test::moved(model, q, h * v));
    Eigen::Matrix<double, 6, Eigen::Dynamic> J(6, model.nv);
    jacobian(model, data, link, p_LoP_L, J);
    const Eigen::Matrix<double, 6, 1> V = J * v;
    const Eigen::Vector3d linear = (after.X_WL[link] * p_LoP_L - before.X_WL[link] * p_LoP_L) / (2 * h);
    const Eigen::AngleAxisd turn(
        Eigen::Matrix3d(after.X_WL[link].linear() * before.X_WL[link].linear().transpose()));
    EXPECT_NEAR((V.tail<3>() - linear).norm(), 0, 1e-8);
    EXPECT_NEAR((V.head<3>() - turn.angle() / (2 * h) * turn.axis()).norm(), 0, 1e-8);
  }
}

}  // namespace
}  // namespace doppel
