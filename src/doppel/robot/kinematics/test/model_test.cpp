#include "doppel/robot/kinematics/model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "doppel/robot/kinematics/link_inertia.h"
#include "doppel/robot/kinematics/test/robots.h"

namespace doppel {
namespace {

using test::make_frame;
using test::make_joint;
using test::make_link;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

const Eigen::Vector3d kZ = Eigen::Vector3d::UnitZ();

// Two fingers on a wrist; written child first, so that the order must come from the tree.
RobotDescription make_gripper() {
  RobotDescription robot;
  robot.name = "gripper";
  const Eigen::Vector3d I(1e-5, 1e-5, 1e-5);
  robot.links = {make_link("right", 0.1, kZ, I), make_link("left", 0.1, kZ, I),
                 make_link("wrist", 0.1, kZ, I), make_link("base", 1, kZ, I), make_frame("tip")};
  robot.joints = {make_joint("Right 1", JointType::revolute, "wrist", "right", kZ, kZ),
                  make_joint("Tip", JointType::fixed, "left", "tip", kZ, kZ),
                  make_joint("Left 1", JointType::revolute, "wrist", "left", kZ, kZ),
                  make_joint("Turn", JointType::continuous, "base", "wrist", kZ, {0, 0, 2})};
  test::limit(robot.joints[0], -1, 1, 2, 3);
  test::limit(robot.joints[2], 0.25, 1, 2, 3);
  robot.joints[0].mimic = Mimic{"Left 1", -2.0, 0.1, {}};
  return robot;
}

Model compile(const RobotDescription& robot) {
  Diagnostics diagnostics;
  return compile_model(robot, BaseKind::fixed, diagnostics);
}

TEST(Model, OrderIsDepthFirst) {
  Diagnostics diagnostics;
  const Model model = compile_model(make_gripper(), BaseKind::fixed, diagnostics);
  std::vector<std::string> names;
  for (const ModelLink& link : model.links) names.push_back(link.name);
  EXPECT_THAT(names, ElementsAre("base", "wrist", "right", "left", "tip"));
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    EXPECT_EQ(model.joints[i].child_link, static_cast<int>(i) + 1);
    EXPECT_LT(model.joints[i].parent_link, model.joints[i].child_link);
  }
  EXPECT_THAT(model.scalar_joint_names(), ElementsAre("Turn", "Right 1", "Left 1"));
  EXPECT_THAT(model.driven_joint_names(), ElementsAre("Turn", "Left 1"));
  EXPECT_NEAR(model.total_mass, 1.3, 1e-12);
  EXPECT_EQ(model.joints[0].axis, kZ) << "expected a normalised axis";
  EXPECT_TRUE(diagnostics.all().empty()) << "expected no diagnostic for a massless frame on a body with mass";
}

TEST(Model, NeutralConfigurationKeepsLimitsAndMimics) {
  Diagnostics diagnostics;
  const Model model = compile_model(make_gripper(), BaseKind::fixed, diagnostics);
  const Eigen::VectorXd q = model.neutral();
  EXPECT_EQ(q[model.joints[model.find_joint("Left 1")].q], 0.25);
  EXPECT_NEAR(q[model.joints[model.find_joint("Right 1")].q], -2 * 0.25 + 0.1, 1e-15);
}

TEST(Model, MimicChainResolvesToLastLeader) {
  RobotDescription robot = make_gripper();
  robot.joints[2].mimic = Mimic{"Turn", 3.0, 0.5, {}};
  Diagnostics diagnostics;
  const Model model = compile_model(robot, BaseKind::fixed, diagnostics);
  const ModelJoint& right = model.joints[model.find_joint("Right 1")];
  EXPECT_EQ(right.mimic_leader, model.find_joint("Turn"));
  EXPECT_NEAR(right.mimic_multiplier, -6.0, 1e-15);
  EXPECT_NEAR(right.mimic_offset, -2 * 0.5 + 0.1, 1e-15);
}

TEST(Model, MimicWithoutEffectIsIgnored) {
  const auto mimics = [](const RobotDescription& robot, const char* joint) {
    const Model model = compile(robot);
    return model.joints[static_cast<std::size_t>(model.find_joint(joint))].mimics();
  };
  RobotDescription unknown = make_gripper();
  EXPECT_TRUE(mimics(unknown, "Right 1"));
  const std::string& follower = unknown.joints[0].name;
  EXPECT_TRUE(mimics(unknown, follower.c_str()));
  unknown.joints[0].mimic->joint = "Left1";
  EXPECT_FALSE(mimics(unknown, follower.c_str()));

  RobotDescription loop = make_gripper();
  loop.joints[2].mimic = Mimic{"Right 1", 1, 0, {}};
  EXPECT_FALSE(mimics(loop, "Right 1"));

  RobotDescription fixed = make_gripper();
  fixed.joints[0].mimic->joint = "Tip";
  EXPECT_FALSE(mimics(fixed, follower.c_str()));
}

TEST(Model, JointWithZeroAxisIsFixed) {
  RobotDescription robot = make_gripper();
  robot.joints[3].axis.setZero();
  const Model model = compile(robot);
  const ModelJoint& still = model.joints[static_cast<std::size_t>(model.find_joint(robot.joints[3].name))];
  EXPECT_EQ(still.type, JointType::fixed);
  EXPECT_EQ(still.nq, 0);
}

TEST(Model, CrossedLimitsAreSwapped) {
  RobotDescription robot = make_gripper();
  test::limit(robot.joints[0], 1, -1, 1, 1);
  const Model model = compile(robot);
  const ModelJoint& joint = model.joints[static_cast<std::size_t>(model.find_joint(robot.joints[0].name))];
  EXPECT_EQ(joint.lower, -1.0);
  EXPECT_EQ(joint.upper, 1.0);
}

TEST(Model, FloatingBaseAddsWorldLink) {
  Diagnostics diagnostics;
  const Model model = compile_model(make_gripper(), BaseKind::floating, diagnostics);
  EXPECT_EQ(model.links[0].name, "world");
  EXPECT_EQ(model.joints[0].name, "base_floating");
  EXPECT_EQ(model.nq, 7 + 3);
  EXPECT_EQ(model.nv, 6 + 3);
  EXPECT_EQ(model.neutral()[6], 1.0) << "expected the quaternion's w at the last place";
}

TEST(Model, RepairedInertiaIsReported) {
  RobotDescription robot = make_gripper();
  robot.links[1].inertial->izz = 5e-5;  // violates the triangle inequality
  robot.links[1].inertial->source = make_location("gripper.urdf", 7, 3);
  Diagnostics diagnostics;
  const Model model = compile_model(robot, BaseKind::fixed, diagnostics);
  ASSERT_EQ(diagnostics.all().size(), 1u);
  EXPECT_EQ(diagnostics.all()[0].rule, "model.not_physical");
  EXPECT_THAT(diagnostics.all()[0].str(), HasSubstr("gripper.urdf:7:3"));
  EXPECT_THAT(diagnostics.all()[0].message, HasSubstr("'left'"));
  EXPECT_EQ(physical_defect(*model.links[model.find_link("left")].inertia), "");
}

TEST(Model, RandomTensorIsRepaired) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int i = 0; i < 200; ++i) {
    MassProperties body{1.0, Eigen::Vector3d::Zero(), Eigen::Matrix3d::Zero()};
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c <= r; ++c) body.I(r, c) = body.I(c, r) = unit(random);
    }
    EXPECT_EQ(physical_defect(physical_repair(body)), "") << body.I;
  }
  MassProperties zeros{2.0, Eigen::Vector3d::Zero(), Eigen::Matrix3d::Zero()};
  EXPECT_EQ(physical_defect(physical_repair(zeros)), "");
}

TEST(Model, MassIsEstimatedForMovingMasslessBodiesOnly) {
  RobotDescription robot = make_gripper();
  Link& left = robot.links[1];
  left.inertial.reset();
  left.collisions.push_back({});
  left.collisions[0].geometry = Box{{0.1, 0.02, 0.02}};
  left.collisions[0].origin.xyz = {0.05, 0, 0};
  Diagnostics diagnostics;
  const Model model = compile_model(robot, BaseKind::fixed, diagnostics);
  ASSERT_EQ(diagnostics.all().size(), 1u);
  EXPECT_EQ(diagnostics.all()[0].rule, "model.no_inertial");
  const MassProperties& assumed = *model.links[model.find_link("left")].inertia;
  EXPECT_NEAR(assumed.mass, 0.04, 1e-12);
  EXPECT_NEAR(assumed.com.x(), 0.05, 1e-12);
  EXPECT_NEAR(assumed.I(1, 1), 0.04 * (0.01 + 0.0004) / 12, 1e-12);

  left.inertial = Inertial{};  // mass 0
  Diagnostics both;
  compile_model(robot, BaseKind::fixed, both);
  ASSERT_EQ(both.all().size(), 2u);
  EXPECT_EQ(both.all()[0].rule, "model.not_physical");
}

TEST(Model, ZeroAndAbsentLimitsAreUnlimitedAndReported) {
  RobotDescription robot = make_gripper();
  test::limit(robot.joints[0], -1, 1, 0, 3);
  robot.joints[2].limits.reset();
  Diagnostics diagnostics;
  const Model model = compile_model(robot, BaseKind::fixed, diagnostics);
  ASSERT_EQ(diagnostics.all().size(), 2u);
  EXPECT_EQ(diagnostics.all()[0].rule, "model.zero_limit");
  EXPECT_EQ(diagnostics.all()[1].rule, "model.no_limits");
  EXPECT_EQ(model.joints[model.find_joint("Right 1")].effort, kInfinity);
  EXPECT_EQ(model.joints[model.find_joint("Left 1")].upper, kInfinity);
}

}  // namespace
}  // namespace doppel
