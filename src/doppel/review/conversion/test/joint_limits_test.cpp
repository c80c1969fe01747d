#include "doppel/review/conversion/joint_limits.h"

#include <gmock/gmock.h>

#include "conversion_fixture.h"

namespace doppel {
namespace {

using testing::HasSubstr;

struct Written {
  std::string text;
  Diagnostics diagnostics;
};

Written joint_limits(const Converted& converted) {
  Written out;
  out.text = to_joint_limits(converted.robot, converted.model,
                             acceleration_limits(converted.model, {0, 0, -9.81}), out.diagnostics);
  return out;
}

// A mass of 3 kg on a slide along x, and a bob of 1 kg at 0.5 m on a hinge about y.
Converted slide_and_bob(const std::string& slide_limit, const std::string& hinge_limit) {
  const auto link = [](const std::string& name, const std::string& mass, const std::string& z) {
    return "<link name=\"" + name + "\"><inertial><origin xyz=\"0 0 " + z + "\"/><mass value=\"" + mass +
           "\"/><inertia ixx=\"1e-5\" ixy=\"0\" ixz=\"0\" iyy=\"1e-5\" iyz=\"0\" "
           "izz=\"1e-5\"/></inertial></link>";
  };
  return from_text("<robot name=\"r\" version=\"1.2\"><link name=\"base\"/>" + link("car", "3", "0") +
                   link("bob", "1", "-0.5") +
                   "<joint name=\"slide 1\" type=\"prismatic\"><parent link=\"base\"/><child "
                   "link=\"car\"/><axis xyz=\"1 0 0\"/>"
                   "<limit lower=\"-1\" upper=\"1\" " +
                   slide_limit +
                   "/></joint>"
                   "<joint name=\"hinge\" type=\"revolute\"><parent link=\"base\"/><child "
                   "link=\"bob\"/><axis xyz=\"0 1 0\"/>"
                   "<limit lower=\"-2\" upper=\"2\" " +
                   hinge_limit + "/></joint></robot>");
}

TEST(JointLimits, NumbersAreDecimalsAndAccelerationsAreRoundedDown) {
  const Written out =
      joint_limits(slide_and_bob("effort=\"20\" velocity=\"2\"", "effort=\"10\" velocity=\"0.5\""));
  EXPECT_THAT(out.text, HasSubstr("joint_limits:\n  \"slide 1\":\n    has_velocity_limits: true\n"
                                  "    max_velocity: 2.0\n    has_acceleration_limits: true\n"
                                  "    max_acceleration: 6.666\n  \"hinge\":\n"));
  // (10 - 4.905) / (0.25 + 1e-5)
  EXPECT_THAT(out.text, HasSubstr("    max_velocity: 0.5\n    has_acceleration_limits: true\n"
                                  "    max_acceleration: 20.37\n"));
  EXPECT_EQ(out.diagnostics.all().size(), 0U);
}

TEST(JointLimits, LowerLimitOfDescriptionCounts) {
  const Written out =
      joint_limits(slide_and_bob("effort=\"20\" velocity=\"2\" acceleration=\"5\" jerk=\"30\"",
                                 "effort=\"10\" velocity=\"1\" deceleration=\"99\""));
  EXPECT_THAT(out.text,
              HasSubstr("    max_acceleration: 5.0\n    has_jerk_limits: true\n    max_jerk: 30.0\n"));
  EXPECT_THAT(out.text, HasSubstr("    max_acceleration: 20.37\n"));
}

TEST(JointLimits, JointThatCannotHoldItsWeightIsWarningWithNumbers) {
  const Written out =
      joint_limits(slide_and_bob("effort=\"20\" velocity=\"2\"", "effort=\"3\" velocity=\"1\""));
  EXPECT_THAT(out.text,
              HasSubstr("    has_acceleration_limits: false  # its effort limit of 3 N m does not hold its "
                        "weight, up to 4.905 N m\n    max_acceleration: 0.0\n"));
  ASSERT_EQ(out.diagnostics.all().size(), 1U);
  EXPECT_EQ(out.diagnostics.all()[0].rule, "convert.cannot_hold");
  EXPECT_EQ(out.diagnostics.all()[0].severity, Severity::warning);
  EXPECT_THAT(out.diagnostics.all()[0].message, HasSubstr("joint 'hinge' gets no acceleration limit"));
  EXPECT_TRUE(out.diagnostics.all()[0].where.known());
}

TEST(JointLimits, JointWithoutEffortLimitHasNone) {
  const Written out = joint_limits(slide_and_bob("", "effort=\"10\" velocity=\"1\""));
  EXPECT_THAT(out.text, HasSubstr("    has_velocity_limits: false\n    max_velocity: 0.0\n"
                                  "    has_acceleration_limits: false  # no effort limit\n"));
}

TEST(JointLimits, BundledArmHasLimitsForEveryDriveThatHoldsIt) {
  const Converted arm = bundled("lab_arm");
  const Written out = joint_limits(arm);
  for (const std::string& joint : arm.model.driven_joint_names())
    EXPECT_THAT(out.text, HasSubstr("  \"" + joint + "\":\n"));
}

}  // namespace
}  // namespace doppel
