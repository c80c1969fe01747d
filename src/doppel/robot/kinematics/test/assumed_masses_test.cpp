#include "doppel/robot/kinematics/detail/assumed_masses.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "doppel/robot/kinematics/dynamics.h"
#include "doppel/robot/kinematics/test/robots.h"

namespace doppel {
namespace {

using test::make_frame;
using test::make_joint;
using ::testing::HasSubstr;

// A seven-axis arm with the joint distances of a common research arm, m: 0.333, 0, 0.316, 0.0825, 0.384, 0,
// 0.088.
RobotDescription seven_axes() {
  RobotDescription robot;
  robot.name = "seven";
  robot.links.push_back(make_frame("link0"));
  const Eigen::Vector3d offsets[] = {{0, 0, 0.333},       {0, 0, 0}, {0, -0.316, 0}, {0.0825, 0, 0},
                                     {-0.0825, 0.384, 0}, {0, 0, 0}, {0.088, 0, 0}};
  for (int i = 0; i < 7; ++i) {
    robot.links.push_back(make_frame("link" + std::to_string(i + 1)));
    robot.joints.push_back(make_joint("joint" + std::to_string(i + 1), JointType::revolute,
                                      "link" + std::to_string(i), "link" + std::to_string(i + 1), offsets[i],
                                      {0, i % 2 == 0 ? 0.0 : 1.0, i % 2 == 0 ? 1.0 : 0.0}));
    test::limit(robot.joints.back(), -2.5, 2.5, i < 4 ? 87 : 12, 2.5);
  }
  return robot;
}

double mass_of(const Model& model, const std::string& link) {
  return model.links[static_cast<std::size_t>(model.find_link(link))].inertia->mass;
}

TEST(AssumedMasses, ArmWithoutMeshesIsEstimatedFromLinkLengths) {
  Diagnostics diagnostics;
  const Model model = compile_model(seven_axes(), BaseKind::fixed, diagnostics);
  EXPECT_GT(model.total_mass, 3.0) << "expected more than 3 kg; the real arm weighs 18 kg";
  EXPECT_LT(model.total_mass, 40.0);
  EXPECT_GT(mass_of(model, "link4"), mass_of(model, "link1"));
  EXPECT_GT(mass_of(model, "link2"), 5.0 * mass_of(model, "link6"));
  for (int i = 1; i <= 7; ++i) EXPECT_GT(mass_of(model, "link" + std::to_string(i)), 1e-3) << i;
}

TEST(AssumedMasses, SingleWarningNamesAllLinksAndFix) {
  Diagnostics diagnostics;
  compile_model(seven_axes(), BaseKind::fixed, diagnostics);
  ASSERT_EQ(diagnostics.all().size(), 1u);
  EXPECT_EQ(diagnostics.all()[0].rule, "model.no_inertial");
  EXPECT_THAT(diagnostics.all()[0].message,
              HasSubstr("7 movable links have no mass; estimated from the distances"));
  EXPECT_THAT(diagnostics.all()[0].message, HasSubstr("'link3'"));
  EXPECT_THAT(diagnostics.all()[0].fix, HasSubstr("<inertial>"));
}

TEST(AssumedMasses, EstimateIsHeldByHalfOfEffort) {
  RobotDescription robot = seven_axes();
  for (Joint& joint : robot.joints) joint.limits->effort = 2.0;
  Diagnostics diagnostics;
  const Model model = compile_model(robot, BaseKind::fixed, diagnostics);
  EXPECT_THAT(diagnostics.all()[0].message, HasSubstr("scaled by"));
  Data data(model);
  Eigen::VectorXd torques;
  double largest = 0.0;
  for (const Eigen::VectorXd& q : sample_configurations(model, kConfigurationSamples)) {
    gravity_torques(model, data, q, {0, 0, -9.81});
    drive_torques(model, data, torques);
    largest = std::max(largest, torques.cwiseAbs().maxCoeff());
  }
  EXPECT_NEAR(largest, 1.0, 1e-9);
}

TEST(AssumedMasses, WrittenMassesKeepEstimateUnscaled) {
  RobotDescription robot = seven_axes();
  for (Joint& joint : robot.joints) joint.limits->effort = 2.0;
  robot.links[2] = test::make_link("link2", 1.0, {0, 0, 0}, {1e-3, 1e-3, 1e-3});
  Diagnostics diagnostics;
  const Model model = compile_model(robot, BaseKind::fixed, diagnostics);
  EXPECT_EQ(mass_of(model, "link2"), 1.0);
  EXPECT_THAT(diagnostics.all()[0].message, ::testing::Not(HasSubstr("scaled")));
}

RobotDescription one_link(double mass) {
  RobotDescription robot;
  robot.links = {make_frame("base"),
                 mass > 0 ? test::make_link("l", mass, {0, 0, 0.1}, {0, 0, 0}) : make_frame("l")};
  if (mass > 0) robot.links[1].inertial->tensor_written = false;
  robot.joints = {make_joint("j", JointType::revolute, "base", "l", {0, 0, 0}, {0, 0, 1})};
  test::limit(robot.joints.back(), -1, 1, 10, 1);
  return robot;
}

TEST(AssumedMasses, MassWithoutTensorAndShapeIsBall) {
  Diagnostics diagnostics;
  const Model model = compile_model(one_link(1.0), BaseKind::fixed, diagnostics);
  EXPECT_TRUE(diagnostics.all().empty()) << "expected no diagnostic: the parser has reported it";
  const MassProperties& body = *model.links[1].inertia;
  EXPECT_EQ(body.mass, 1.0);
  EXPECT_EQ(model.total_mass, 1.0);
  EXPECT_EQ(body.com, Eigen::Vector3d(0, 0, 0.1));
  // 1 kg at 1000 kg/m^3: a ball of 62.035 mm radius.
  EXPECT_TRUE(body.I.isApprox(0.4 * 0.062035 * 0.062035 * Eigen::Matrix3d::Identity(), 1e-4)) << body.I;
}

TEST(AssumedMasses, MassWithoutTensorIsSpreadOverShape) {
  RobotDescription robot = one_link(3.0);
  robot.links[1].visuals.push_back({});
  robot.links[1].visuals[0].geometry = Box{{0.1, 0.2, 0.3}};
  Diagnostics diagnostics;
  const Model model = compile_model(robot, BaseKind::fixed, diagnostics);
  const MassProperties& body = *model.links[1].inertia;
  EXPECT_EQ(body.mass, 3.0);
  EXPECT_EQ(body.com, Eigen::Vector3d(0, 0, 0.1));
  const Eigen::Vector3d wanted(0.25 * 0.13, 0.25 * 0.10, 0.25 * 0.05);
  EXPECT_TRUE(body.I.isApprox(Eigen::Matrix3d(wanted.asDiagonal()), 1e-9)) << body.I;
}

TEST(AssumedMasses, SingleLinkUsesSingular) {
  const auto warnings = [](const RobotDescription& robot) {
    Diagnostics diagnostics;
    compile_model(robot, BaseKind::fixed, diagnostics);
    return diagnostics.all().at(0).message + " | " + diagnostics.all().at(0).fix;
  };
  RobotDescription robot = one_link(0.0);
  EXPECT_THAT(warnings(robot), HasSubstr("a movable link has no mass; estimated from its length: 'l' "));
  robot.links[1].visuals.push_back({});
  robot.links[1].visuals[0].geometry = Box{{0.1, 0.2, 0.3}};
  EXPECT_THAT(warnings(robot), HasSubstr("estimated from its shapes: 'l' 6 kg | "));
  robot.joints[0].type = JointType::prismatic;
  robot.joints[0].axis = {0, 0, 1};
  EXPECT_THAT(warnings(robot),
              HasSubstr("estimated from its shapes, scaled by 0.085 so that 'j' holds it: "));
  EXPECT_THAT(warnings(robot), ::testing::Not(HasSubstr("these")));
}

TEST(AssumedMasses, ShapesOnWeldedLinksCount) {
  RobotDescription robot = seven_axes();
  robot.links.push_back(make_frame("cover"));
  robot.links.back().visuals.push_back({});
  robot.links.back().visuals[0].geometry = Box{{0.1, 0.1, 0.1}};
  robot.joints.push_back(
      make_joint("cover_joint", JointType::fixed, "link7", "cover", {0, 0, 0.2}, {0, 0, 1}));
  Diagnostics diagnostics;
  const Model model = compile_model(robot, BaseKind::fixed, diagnostics);
  const MassProperties& body = *model.links[static_cast<std::size_t>(model.find_link("link7"))].inertia;
  EXPECT_NEAR(body.mass, 1.0, 1e-9);
  EXPECT_NEAR(body.com.z(), 0.2, 1e-9);
  EXPECT_FALSE(model.links[static_cast<std::size_t>(model.find_link("cover"))].inertia);
}

// A scenario file has the upper triangle of a tensor only, and starts with the same bits.
TEST(AssumedMasses, TensorOfTurnedShapesIsSymmetricToLastBit) {
  RobotDescription robot = one_link(0.0);
  for (int i = 0; i < 20; ++i) {
    Visual& visual = robot.links[1].visuals.emplace_back();
    visual.geometry = Box{{0.1, 0.2 + 0.013 * i, 0.3}};
    visual.origin = {{0.07 * i, 0.025, -0.011 * i}, {0.3 * i, 0.7, 1.1 + 0.1 * i}, {}};
    Diagnostics diagnostics;
    const Eigen::Matrix3d I = compile_model(robot, BaseKind::fixed, diagnostics).links[1].inertia->I;
    EXPECT_TRUE((I.array() == I.transpose().array()).all()) << i;
  }
}

}  // namespace
}  // namespace doppel
