#include "doppel/review/comparison/comparison.h"

#include <gtest/gtest.h>

#include "doppel/description/urdf/load.h"

namespace doppel {
namespace {

RobotDescription robot(const std::string& body) {
  PackageResolver resolver;
  Diagnostics diagnostics;
  return parse_urdf("<robot name=\"r\">" + body + "</robot>", "r.urdf", resolver, diagnostics);
}

std::string arm(const std::string& joint, const std::string& link = "") {
  return "<link name=\"a\"/><link name=\"b\">" + link +
         "</link><joint name=\"j\" type=\"revolute\"><parent link=\"a\"/><child link=\"b\"/>" + joint +
         "</joint>";
}
const std::string kLimit = R"(<limit lower="0" upper="1" effort="2" velocity="3"/>)";
const std::string kJoint = R"(<origin xyz="0 0 0.1" rpy="0 0 0"/><axis xyz="0 0 1"/>)" + kLimit;

const Change& only(const std::vector<Change>& changes) {
  EXPECT_EQ(changes.size(), 1u);
  static const Change none;
  return changes.empty() ? none : changes.front();
}

TEST(Comparison, EquivalentNotationIsEqual) {
  const auto a = robot(arm(kJoint));
  EXPECT_TRUE(compare(a, a).empty());
  EXPECT_TRUE(compare(a, robot("<joint name=\"j\" type=\"revolute\">" + kLimit +
                               R"(<axis xyz="0 0 2"/><child link="b"/><parent link="a"/>
                                  <origin rpy="6.283185307179586 0 -0.0" xyz="0 0.0 1e-1"/></joint><link name="b"/><link name="a"/>)"))
                  .empty());
}

TEST(Comparison, FlippedAxisIsNamed) {
  const auto changes =
      compare(robot(arm(kJoint)), robot(arm(R"(<origin xyz="0 0 0.1"/><axis xyz="0 0 -1"/>)" + kLimit)));
  EXPECT_EQ(only(changes).aspect, "axis");
  EXPECT_NE(only(changes).meaning.find("the other way"), std::string::npos);
}

TEST(Comparison, MovedZeroIsReportedInDegrees) {
  // The walkthrough's joint 2: axis +X, d = 45 degrees, R_new = R_old R_axis(-d).
  const auto before = robot(arm(R"(<origin rpy="-0.570796 0 0"/><axis xyz="1 0 0"/>)" + kLimit));
  const auto after = robot(arm(R"(<origin rpy="-1.356194163397448 0 0"/><axis xyz="1 0 0"/>)" + kLimit));
  EXPECT_NE(only(compare(before, after)).meaning.find("+45 deg"), std::string::npos)
      << only(compare(before, after)).meaning;
  // The same about an axis that points the other way.
  const auto mirrored = robot(arm(R"(<origin rpy="0.4 0 0"/><axis xyz="-1 0 0"/>)" + kLimit));
  const auto baked = robot(arm(R"(<origin rpy="1.359931088596881 0 0"/><axis xyz="-1 0 0"/>)" + kLimit));
  EXPECT_NE(only(compare(mirrored, baked)).meaning.find("+55 deg"), std::string::npos);
  const auto tilted = robot(arm(R"(<origin rpy="0.1 0 0" xyz="0 0 0.1"/><axis xyz="0 0 1"/>)" + kLimit));
  EXPECT_EQ(only(compare(robot(arm(kJoint)), tilted)).aspect, "orientation");
}

TEST(Comparison, LimitsMassAndShapesAreReportedWithUnits) {
  const auto a = robot(arm(
      kJoint,
      R"(<inertial><mass value="0.1"/><inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial><collision><geometry><box size="1 1 1"/></geometry></collision>)"));
  const auto b = robot(arm(
      R"(<origin xyz="0 0 0.1"/><axis xyz="0 0 1"/><limit lower="0" upper="1" effort="2" velocity="5.2"/>)",
      R"(<inertial><mass value="0.2"/><inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial><collision><geometry><sphere radius="1"/></geometry></collision>)"));
  const auto changes = compare(a, b);
  ASSERT_EQ(changes.size(), 4u);
  EXPECT_EQ(changes[0].subject, "robot");
  EXPECT_EQ(changes[1].from + " " + changes[1].to, "3 rad/s 5.2 rad/s");
  EXPECT_EQ(changes[2].from + " " + changes[2].to, "100 g 200 g");
  EXPECT_EQ(changes[3].aspect, "collision");
}

TEST(Comparison, RotatedInertialFrameIsEqual) {
  const auto inertial = [](const char* rpy, const char* xx, const char* yy) {
    return std::string("<inertial><origin rpy=\"") + rpy + "\"/><mass value=\"1\"/><inertia ixx=\"" + xx +
           "\" iyy=\"" + yy + "\" izz=\"2\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial>";
  };
  EXPECT_TRUE(compare(robot(arm(kJoint, inertial("0 0 0", "1", "1.5"))),
                      robot(arm(kJoint, inertial("0 0 1.5707963267948966", "1.5", "1"))))
                  .empty());
}

TEST(Comparison, RenamingIsOneChange) {
  const std::string body =
      R"(<inertial><mass value="0.3"/><inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial>)";
  const auto a = robot(arm(kJoint, body));
  const auto b =
      robot("<link name=\"a\"/><link name=\"forearm\">" + body +
            "</link><joint name=\"elbow\" type=\"revolute\"><parent link=\"a\"/><child link=\"forearm\"/>" +
            kJoint + "</joint>");
  const auto changes = compare(a, b);
  ASSERT_EQ(changes.size(), 2u);
  EXPECT_EQ(changes[0].kind, Change::Kind::renamed);
  EXPECT_EQ(changes[0].from, "j");
  EXPECT_EQ(changes[1].to, "forearm");
}

TEST(Comparison, AddedAndRemovedPartsAreReported) {
  const auto changes = compare(
      robot(arm(kJoint)),
      robot(
          arm(kJoint) +
          R"(<link name="tool"/><joint name="t" type="fixed"><parent link="b"/><child link="tool"/></joint><ros2_control name="hw" type="system"><hardware><plugin>p/P</plugin></hardware><joint name="j"/></ros2_control>)"));
  std::string text;
  for (const Change& change : changes) text += change.subject + " " + change.name + ";";
  EXPECT_EQ(text, "robot r;robot r;joint t;link tool;ros2_control hw;");
  EXPECT_NE(to_json(changes).find("\"equal\": false"), std::string::npos);
}

}  // namespace
}  // namespace doppel
