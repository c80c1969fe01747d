// Findings that compare a description with its overlay, with its drives, and with what is estimated.
#include <gmock/gmock.h>

#include "doppel/review/audit/test/audit_fixture.h"

namespace doppel::audit_test {
namespace {

using testing::HasSubstr;

class CalibrationRules : public AuditTest {};
class GripperRules : public AuditTest {};

std::string driven(const std::string& parameter) {
  return "<ros2_control name=\"arm\" type=\"system\"><hardware><plugin>a/B</plugin></hardware><joint "
         "name=\"j\">" +
         parameter +
         "<command_interface name=\"position\"/><state_interface name=\"position\"/></joint></ros2_control>";
}

Parts with_hardware(const std::string& parameter) {
  Parts parts;
  parts.more = driven(parameter);
  return parts;
}

constexpr const char* kZero =
    "- bake_zero: j\n  offset: 45 deg\n  was: {type: revolute, axis: 0 1 0, rpy: 0 0 0}\n";

TEST_F(CalibrationRules, DriverOffsetEqualToBakedZeroIsError) {
  write("r.overlay.yaml", kZero);
  const AuditReport report = check(robot(with_hardware("<param name=\"servo_offset_deg\">45</param>")));
  const Finding* found = find(report, "ros2_control.offset_twice");
  ASSERT_NE(found, nullptr) << report_text(report);
  EXPECT_EQ(found->severity, Severity::error);
  EXPECT_THAT(found->message, HasSubstr("adds 45 deg"));
}

TEST_F(CalibrationRules, OtherDriverOffsetBesideBakedZeroIsWarning) {
  write("r.overlay.yaml", kZero);
  const AuditReport report = check(robot(with_hardware("<param name=\"servo_offset_deg\">3</param>")));
  const Finding* found = find(report, "ros2_control.offset_twice");
  ASSERT_NE(found, nullptr) << report_text(report);
  EXPECT_EQ(found->severity, Severity::warning);
}

TEST_F(CalibrationRules, OffsetInOnePlaceOnlyIsNoFinding) {
  EXPECT_EQ(find(check(robot(with_hardware("<param name=\"servo_offset_deg\">45</param>"))),
                 "ros2_control.offset_twice"),
            nullptr);
  write("r.overlay.yaml", kZero);
  EXPECT_EQ(find(check(robot(with_hardware("<param name=\"servo_offset_deg\">0</param>"))),
                 "ros2_control.offset_twice"),
            nullptr);
}

TEST_F(CalibrationRules, ContinuousJointWithLimitsIsReported) {
  Parts parts;
  parts.joint_type = "continuous";
  const AuditReport report = check(robot(parts));
  ASSERT_NE(find(report, "joint.continuous_limits"), nullptr) << report_text(report);
  for (const char* harmless :
       {R"(<limit effort="5" velocity="3"/>)", R"(<limit lower="0" upper="0" effort="5" velocity="3"/>)",
        R"(<limit lower="-3.1416" upper="3.1416" effort="5" velocity="3"/>)"}) {
    parts.limit = harmless;
    EXPECT_EQ(find(check(robot(parts)), "joint.continuous_limits"), nullptr) << harmless;
  }
}

TEST_F(CalibrationRules, EstimatedMassOfTonsIsError) {
  Parts parts;
  parts.inertial = "";
  const std::string large = R"(<geometry><box size="60 60 200"/></geometry>)";
  parts.visual = "<visual>" + large + "</visual>";
  parts.collision = "<collision>" + large + "</collision>";
  const AuditReport report = check(robot(parts));
  const Finding* found = find(report, "inertia.estimated_tons");
  ASSERT_NE(found, nullptr) << report_text(report);
  EXPECT_EQ(found->severity, Severity::error);
  parts.visual = kVisual;
  parts.collision = kCollision;
  EXPECT_EQ(find(check(robot(parts)), "inertia.estimated_tons"), nullptr);
}

std::string finger(const std::string& name, const std::string& link, const std::string& axis,
                   const std::string& more = "", const std::string& range = "lower=\"0\" upper=\"1\"") {
  return "<link name=\"" + link + "\">" + kInertial + "</link><joint name=\"" + name +
         "\" type=\"revolute\"><parent link=\"arm\"/><child link=\"" + link + "\"/><axis xyz=\"" + axis +
         "\"/><limit " + range + " effort=\"1\" velocity=\"1\"/>" + more + "</joint>";
}

Parts gripper(const std::string& right_axis, const std::string& more = "") {
  Parts parts;
  parts.more = finger("a", "finger_left", "0 0 1") + finger("b", "finger_right", right_axis, more);
  return parts;
}

TEST_F(GripperRules, MirroredFingersWithoutMimicGiveNoteWithSign) {
  const AuditReport opposite = check(robot(gripper("0 0 -1")));
  const Finding* found = find(opposite, "mimic.missing");
  ASSERT_NE(found, nullptr) << report_text(opposite);
  EXPECT_EQ(found->severity, Severity::note);
  EXPECT_THAT(found->fix, HasSubstr("add_mimic \"b\" leader=\"a\" multiplier=1"));
  Parts mirrored;
  mirrored.more = finger("a", "finger_left", "0 0 1") +
                  finger("b", "finger_right", "0 0 1", "", "lower=\"-1\" upper=\"0\"");
  const AuditReport parallel = check(robot(mirrored));
  ASSERT_NE(find(parallel, "mimic.missing"), nullptr);
  EXPECT_THAT(find(parallel, "mimic.missing")->fix, HasSubstr("multiplier=-1"));
}

TEST_F(GripperRules, FingersThatMimicOrAreNoPairAreNoFinding) {
  EXPECT_EQ(find(check(robot(gripper("0 0 -1", "<mimic joint=\"a\"/>"))), "mimic.missing"), nullptr);
  EXPECT_EQ(find(check(robot(gripper("0 1 0"))), "mimic.missing"), nullptr) << "the axes are not parallel";
  EXPECT_EQ(find(check(robot(gripper("0 0 1"))), "mimic.missing"), nullptr)
      << "the one's range is not the other's with the sign -1";
  Parts legs;
  legs.more = finger("a", "leg_left", "0 0 1") + finger("b", "leg_right", "0 0 1");
  EXPECT_EQ(find(check(robot(legs)), "mimic.missing"), nullptr) << "legs move independently";
}

TEST_F(GripperRules, FingersWithOwnDrivesGiveNoFinding) {
  const auto drive = [](const std::string& joint) {
    return "<joint name=\"" + joint +
           "\"><command_interface name=\"position\"/><state_interface name=\"position\"/></joint>";
  };
  Parts parts = gripper("0 0 -1");
  parts.more += "<ros2_control name=\"g\" type=\"system\"><hardware><plugin>a/B</plugin></hardware>" +
                drive("a") + drive("b") + "</ros2_control>";
  EXPECT_EQ(find(check(robot(parts)), "mimic.missing"), nullptr);
}

}  // namespace
}  // namespace doppel::audit_test
