// The bundled robots have the values of the walkthroughs they come from.
#include <gtest/gtest.h>

#include "doppel/description/urdf/load.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel::test {
namespace {

RobotDescription load(const std::string& file, const XacroArguments& arguments = {}) {
  PackageResolver resolver;
  const std::string path = std::string(DOPPEL_SOURCE_DIR "/robots/") + file;
  resolver.add_context(path);
  Diagnostics diagnostics;
  RobotDescription robot = load_description(path, arguments, resolver, diagnostics).robot;
  for (const Diagnostic& d : diagnostics.all()) EXPECT_NE(d.severity, Severity::warning) << d.str();
  return robot;
}

double total_mass(const RobotDescription& robot) {
  double mass = 0;
  for (const Link& link : robot.links) mass += link.inertial ? link.inertial->mass : 0.0;
  return mass;
}

TEST(Robots, OmArmOneEqualsCorrectedModel) {
  const RobotDescription robot = load("omarm_one/urdf/omarm.xacro", {{"use_sim", "true"}});
  EXPECT_EQ(robot.links.size(), 13u);
  EXPECT_EQ(robot.joints.size(), 12u);
  EXPECT_NEAR(total_mass(robot), 1.2844, 5e-5);
  for (int i = 1; i <= 6; ++i) {
    const Joint* joint = robot.find_joint("Revolute " + std::to_string(i));
    ASSERT_NE(joint, nullptr);
    ASSERT_TRUE(joint->limits);
    EXPECT_EQ(joint->limits->velocity, 5.2);
    EXPECT_EQ(joint->limits->effort, 3.5);
    EXPECT_EQ(joint->limits->upper, 3.141593);
  }
  EXPECT_EQ(robot.find_joint("Revolute 8")->limits->velocity, 8.0);
  EXPECT_EQ(robot.find_joint("Revolute 8")->limits->effort, 0.18);
  EXPECT_EQ(robot.find_joint("Revolute 8")->limits->upper, 1.6);
  ASSERT_TRUE(robot.find_joint("Revolute 9")->mimic);
  EXPECT_EQ(robot.find_joint("Revolute 9")->mimic->joint, "Revolute 8");
  EXPECT_EQ(robot.find_joint("Revolute 2")->origin.rpy.x(), -1.356194163);
  EXPECT_EQ(robot.find_joint("Revolute 3")->origin.rpy.x(), 1.359931089);
  EXPECT_EQ(robot.find_joint("Revolute 4")->axis, Eigen::Vector3d(0, -0.984808, -0.173648));
  EXPECT_EQ(robot.find_link("link_1_1")->inertial->mass, 0.3149105967000781);
  ASSERT_EQ(robot.hardware.size(), 1u);
  EXPECT_EQ(robot.hardware[0].joints.size(), 7u);
  EXPECT_EQ(robot.hardware[0].plugin, "gz_ros2_control/GazeboSimSystem");
}

TEST(Robots, OmArmOneBenchDrivesHardware) {
  const RobotDescription robot = load("omarm_one/urdf/omarm.xacro");
  ASSERT_EQ(robot.hardware.size(), 1u);
  EXPECT_EQ(robot.hardware[0].plugin, "omarm_hardware/OmArmSystem");
}

TEST(Robots, RawExportHasSeventeenProblems) {
  const RobotDescription robot = load("omarm_one/export/urdf/omarm.xacro");
  EXPECT_EQ(robot.links.size(), 12u);
  EXPECT_EQ(robot.joints.size(), 11u);
  EXPECT_NEAR(total_mass(robot), 1.2844, 5e-5);
  int velocity = 0, effort = 0, zero_inertia = 0;
  for (const Joint& joint : robot.joints) {
    velocity += joint.limits && joint.limits->velocity == 100.0 ? 1 : 0;
    effort += joint.limits && joint.limits->effort == 100.0 ? 1 : 0;
    EXPECT_FALSE(joint.mimic);
  }
  for (const Link& link : robot.links) zero_inertia += link.inertial && link.inertial->iyy == 0.0 ? 1 : 0;
  EXPECT_EQ(velocity, 8);
  EXPECT_EQ(effort, 8);
  EXPECT_EQ(zero_inertia, 4);
}

TEST(Robots, OmArmZeroHasSevenTiltedJointsAndHalfKilogram) {
  const RobotDescription robot = load("omarm_zero/urdf/omarm_zero.xacro");
  int revolute = 0;
  for (const Joint& joint : robot.joints) revolute += joint.type == JointType::revolute ? 1 : 0;
  EXPECT_EQ(revolute, 7);
  EXPECT_NEAR(total_mass(robot), 0.5, 0.03);
  EXPECT_EQ(robot.find_joint("Revolute 2")->axis, Eigen::Vector3d(0.016327, 0.999867, 0.0));
  EXPECT_EQ(robot.find_joint("Revolute 1")->limits->velocity, 0.2);
  EXPECT_EQ(robot.find_link("base_link")->inertial->mass, 0.2095);
}

TEST(Robots, DeskArmHasSixServosAndTwoCameras) {
  const RobotDescription simulated = load("desk_arm/urdf/desk_arm.urdf.xacro");
  ASSERT_EQ(simulated.hardware.size(), 1u);
  EXPECT_EQ(simulated.hardware[0].plugin, "gz_ros2_control/GazeboSimSystem");
  const RobotDescription robot = load("desk_arm/urdf/desk_arm.urdf.xacro", {{"use_sim", "false"}});
  EXPECT_EQ(robot.hardware[0].plugin, "doppel/FeetechSts");
  const std::vector<std::string> joints{"shoulder_pan", "shoulder_lift", "elbow_flex",
                                        "wrist_flex",   "wrist_roll",    "gripper"};
  ASSERT_EQ(robot.hardware[0].joints.size(), joints.size());
  for (std::size_t i = 0; i < joints.size(); ++i) {
    EXPECT_EQ(robot.hardware[0].joints[i].name, joints[i]);
    EXPECT_EQ(robot.hardware[0].joints[i].params.front(),
              (std::pair<std::string, std::string>{"id", std::to_string(i + 1)}));
    const Joint* const joint = robot.find_joint(joints[i]);
    ASSERT_TRUE(joint->limits);
    if (joints[i] == "gripper") continue;
    EXPECT_EQ(joint->limits->lower, -joint->limits->upper) << joints[i];
  }
  EXPECT_NEAR(total_mass(robot), 0.77, 0.02);
  EXPECT_NE(robot.find_link("wrist_camera_link"), nullptr);
  EXPECT_NE(robot.find_link("front_camera_link"), nullptr);
}

TEST(Robots, LabArmHasFourDrivenJointsAndCamera) {
  const RobotDescription robot = load("lab_arm/urdf/arm.urdf.xacro");
  Diagnostics diagnostics;
  const Model model = compile_model(robot, BaseKind::fixed, diagnostics);
  EXPECT_EQ(model.driven_joint_names(), (std::vector<std::string>{"j0", "j1", "j2", "j3"}));
  EXPECT_NE(robot.find_link("camera_link"), nullptr);
}

}  // namespace
}  // namespace doppel::test
