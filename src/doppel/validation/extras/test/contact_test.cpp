// X10 beside the effective mass of a pendulum.
#include <gtest/gtest.h>

#include <cmath>

#include "doppel/validation/extras/contact_extra.h"
#include "doppel/validation/extras/detail/tool_mass.h"
#include "extra_robots.h"

namespace doppel {
namespace {

TEST(ContactExtra, EffectiveMassOfTwoLinksMatchesHandFormula) {
  const WrittenRobot robot(two_link_arm());
  const CheckContext context = robot.context();
  const std::vector<ExtraArm> arms = extra_arms(context);
  ASSERT_EQ(arms.size(), 1U);
  Data data(arms.front().model());
  const double q2 = 0.8, payload = 0.4;
  const ToolMobility mobility =
      tool_mobility(arms.front(), data, (Eigen::VectorXd(2) << 0, q2).finished(), payload);
  // The textbook's mass matrix of two links with the tool's payload at the end (Craig, 6.7).
  constexpr double kUpper = 0.3, kFore = 0.2, kMass = 1, kForeMass = 0.5, kInertia = 1e-4;
  const double fore = kForeMass * 0.01 + kInertia + payload * kFore * kFore;
  const double coupling = (kForeMass * 0.1 + payload * kFore) * kUpper * std::cos(q2);
  const double first = kMass * 0.15 * 0.15 + kInertia + (kForeMass + payload) * kUpper * kUpper;
  Eigen::Matrix2d M;
  M << first + fore + 2 * coupling, fore + coupling, fore + coupling, fore;
  Eigen::Matrix<double, 3, 2> J = Eigen::Matrix<double, 3, 2>::Zero();
  J(0, 0) = J(0, 1) = -kFore * std::sin(q2);
  J(2, 0) = -kUpper - kFore * std::cos(q2);
  J(2, 1) = -kFore * std::cos(q2);
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  EXPECT_NEAR(effective_mass(mobility, up), 1 / up.dot(J * M.inverse() * J.transpose() * up), 1e-9);
}

TEST(ContactExtra, SpeedAndRegionsAreNumbers) {
  WrittenRobot robot(two_link_arm());
  robot.suite.contact["hand"] = {140, 75e3, 0.6};
  const CheckResult result = check_contact(robot.context());
  EXPECT_EQ(result.verdict, Verdict::passed);
  ASSERT_EQ(result.metrics.size(), 3U);
  EXPECT_EQ(result.metrics[1].name, "largest tool speed");
  // At least almost that of the stretched arm, at most its own: 3 rad/s of both joints.
  EXPECT_NEAR(result.metrics[1].value, 1e3 * (3 * 0.5 + 3 * 0.2), 60);
  EXPECT_GT(result.metrics[2].value, 0);
  EXPECT_NE(result.notes.back().find("no risk assessment"), std::string::npos);
}

}  // namespace
}  // namespace doppel
