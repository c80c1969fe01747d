// X1, X6, X7, X11 beside the formulas of an arm of two links.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "doppel/validation/extras/detail/held_mass.h"
#include "doppel/validation/extras/detail/singular_values.h"
#include "doppel/validation/extras/detail/tool_sag.h"
#include "doppel/validation/extras/kinematics_extra.h"
#include "doppel/validation/extras/payload_extra.h"
#include "doppel/validation/extras/sag_extra.h"
#include "doppel/validation/extras/singularity_extra.h"
#include "extra_robots.h"

namespace doppel {
namespace {

constexpr double kGravity = 9.81;
constexpr double kUpper = 0.3, kFore = 0.2;        // m
constexpr double kUpperMass = 1, kForeMass = 0.5;  // kg
constexpr double kShoulder = 10, kElbow = 4;       // N m

double metric(const CheckResult& result, const std::string& name) {
  for (const Metric& one : result.metrics)
    if (one.name == name) return one.value;
  ADD_FAILURE() << name << " is no metric of " << result.id;
  return 0;
}

class StaticExtras : public testing::Test {
 protected:
  ExtraArm arm() {
    std::vector<ExtraArm> arms = extra_arms(context_);
    if (arms.size() != 1) throw std::runtime_error("the robot has not one arm");
    return std::move(arms.front());
  }

  WrittenRobot robot_{two_link_arm()};
  CheckContext context_ = robot_.context();
};

// The holding torques of a rotation by q about y, which points the links down for q > 0.
double shoulder_load(double q1, double q2) {
  return kGravity * (kUpperMass * 0.5 * kUpper * std::cos(q1) +
                     kForeMass * (kUpper * std::cos(q1) + 0.5 * kFore * std::cos(q1 + q2)));
}

TEST_F(StaticExtras, PayloadOfTwoLinksMatchesHandFormula) {
  const ExtraArm one = arm();
  Data data(one.model());
  for (const double q1 : {-1.0, 0.0, 0.4}) {
    for (const double q2 : {-2.0, -0.5, 0.0, 1.2}) {
      const Eigen::VectorXd q = (Eigen::VectorXd(2) << q1, q2).finished();
      const double upper_arm = kGravity * std::abs(kUpper * std::cos(q1) + kFore * std::cos(q1 + q2)),
                   fore_arm = kGravity * std::abs(kFore * std::cos(q1 + q2));
      const double side = kUpper * std::cos(q1) + kFore * std::cos(q1 + q2) > 0 ? 1 : -1;
      const double shoulder = (0.8 * kShoulder - side * shoulder_load(q1, q2)) / upper_arm;
      const double elbow =
          (0.8 * kElbow - kGravity * kForeMass * 0.5 * kFore * std::abs(std::cos(q1 + q2))) / fore_arm;
      const HeldMass held = held_mass(one, data, q, 0.8);
      EXPECT_NEAR(held.mass, std::min(shoulder, elbow), 1e-9) << q1 << " " << q2;
      EXPECT_EQ(held.variable, shoulder < elbow ? 0 : 1);
    }
  }
}

TEST_F(StaticExtras, PayloadAtWholeReachIsThatOfStretchedArm) {
  const CheckResult result = check_payload(context_);
  EXPECT_EQ(result.verdict, Verdict::passed);
  const double stretched = (0.8 * kShoulder - shoulder_load(0, 0)) / (kGravity * (kUpper + kFore));
  // The worst place of the last twentieth of the reach.
  EXPECT_NEAR(metric(result, "payload at 100 % of the reach"), stretched, 1e-3 * stretched);
  EXPECT_GT(metric(result, "payload at 75 % of the reach"), stretched);
}

TEST_F(StaticExtras, DriveThatCannotHoldItsArmCarriesNothing) {
  const ExtraArm one = arm();
  Data data(one.model());
  const double share = 0.9 * shoulder_load(0, 0) / kShoulder;
  EXPECT_EQ(held_mass(one, data, Eigen::VectorXd::Zero(2), share).mass, 0);
}

TEST_F(StaticExtras, SagOfTwoLinksMatchesHandFormula) {
  const ExtraArm one = arm();
  Data data(one.model());
  const double payload = 0.3;
  const double shoulder = shoulder_load(0, 0) + payload * kGravity * (kUpper + kFore);
  const double elbow = kGravity * (kForeMass * 0.5 * kFore + payload * kFore);
  const double expected =
      shoulder / one.servo(0).stiffness * (kUpper + kFore) + elbow / one.servo(1).stiffness * kFore;
  const ToolSag sag = tool_sag(one, data, Eigen::VectorXd::Zero(2), payload);
  EXPECT_NEAR(sag.displacement.z(), -expected, 1e-12);
  EXPECT_NEAR(sag.displacement.x(), 0, 1e-12);
  EXPECT_EQ(sag.variable, 0);
  EXPECT_EQ(check_sag(context_).verdict, Verdict::passed);
}

TEST_F(StaticExtras, StretchedArmIsSingularByItsElbow) {
  const ExtraArm one = arm();
  const auto ratio = [&](double elbow) {
    return singular_values(one.chain(), (Eigen::VectorXd(2) << 0.3, elbow).finished(), 2);
  };
  // Rotation about y is a third number, so that two joints are never singular in all of them; of a position
  // alone, the stretched arm would be.
  EXPECT_GT(ratio(std::numbers::pi / 2).ratio, ratio(0).ratio);
  const CheckResult result = check_singularities(context_);
  EXPECT_EQ(result.verdict, Verdict::passed);
  EXPECT_FALSE(result.metrics.empty());
}

TEST_F(StaticExtras, KinematicsAgree) {
  const CheckResult result = check_kinematics(context_);
  EXPECT_EQ(result.verdict, Verdict::passed) << result.summary;
  EXPECT_LT(metric(result, "forward kinematics against the engine"), 1e-9);
  EXPECT_LT(metric(result, "Jacobian against central differences"), 1e-8);
}

TEST_F(StaticExtras, LineBetweenNamedPosesIsFollowed) {
  robot_.suite.poses["bent"] = {{"shoulder", -0.5}, {"elbow", 1.0}};
  robot_.suite.poses["other"] = {{"shoulder", -0.8}, {"elbow", 1.4}};
  const CheckResult result = check_singularities(context_);
  EXPECT_FALSE(result.items.empty());
  EXPECT_GT(metric(result, "least singular value ratio"), 0);
}

}  // namespace
}  // namespace doppel
