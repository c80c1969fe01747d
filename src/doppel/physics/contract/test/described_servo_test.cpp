#include "doppel/physics/contract/described_servo.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "doppel/base/xml/xml.h"
#include "doppel/physics/contract/test/engine_fixture.h"

namespace doppel {
namespace {

using ::testing::HasSubstr;

RobotDescription described(const std::string& element, double effort = 100) {
  RobotDescription out = test::make_pendulum(2.0, 1.0);
  out.joints[0].type = JointType::revolute;
  test::limit(out.joints[0], -3, 3, effort, 5);
  GazeboExtension extension;
  extension.reference = out.joints[0].name;
  extension.node = std::make_shared<const XmlNode>(parse_xml("<gazebo>" + element + "</gazebo>", "arm.urdf"));
  out.gazebo.push_back(extension);
  return out;
}

std::vector<ServoParameters> servos(const RobotDescription& robot) {
  Diagnostics diagnostics;
  const Model model = compile_model(robot, BaseKind::fixed, diagnostics);
  return choose_servos(robot, model, {}, Eigen::Vector3d::Zero());
}

TEST(DescribedServo, ValuesReplaceChosenOnes) {
  const ServoParameters servo =
      servos(described("<doppel:servo stiffness='35' damping='1.2' armature='0.01'/>"))[0];
  EXPECT_EQ(servo.stiffness, 35);
  EXPECT_EQ(servo.damping, 1.2);
  EXPECT_EQ(servo.armature, 0.01);
  EXPECT_EQ(servo.effort, 100) << "of <limit>";
}

TEST(DescribedServo, StiffnessAloneKeepsDampingRatio) {
  const ServoParameters chosen = servos(described(""))[0];
  const ServoParameters servo = servos(described("<doppel:servo stiffness='800'/>"))[0];
  EXPECT_NEAR(servo.damping * servo.damping / servo.stiffness,
              chosen.damping * chosen.damping / chosen.stiffness, 1e-9);
  EXPECT_EQ(servo.armature, 0);
}

TEST(DescribedServo, UnknownOrInvalidValueIsWarning) {
  Diagnostics diagnostics;
  const auto found = described_servos(
      described("<doppel:servo stifness='35' damping='soft' stiffness='0' delay='0.02'/>"), diagnostics);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].delay, 0.02);
  EXPECT_FALSE(found[0].stiffness.has_value());
  EXPECT_FALSE(found[0].damping.has_value());
  ASSERT_EQ(diagnostics.all().size(), 3U);
  EXPECT_THAT(diagnostics.all()[0].message, HasSubstr("did you mean 'stiffness'?"));
  EXPECT_THAT(diagnostics.all()[1].message, HasSubstr("'soft', which is not a non-negative number"));
  EXPECT_EQ(diagnostics.all()[2].where.place(), "arm.urdf:1:52");
}

}  // namespace
}  // namespace doppel
