#include "doppel/description/urdf/urdf_version.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "doppel/description/urdf/load.h"
#include "doppel/description/urdf/urdf_writer.h"

namespace doppel {
namespace {

using testing::HasSubstr;
using testing::Not;

class UrdfVersionTest : public testing::Test {
 protected:
  // A robot of two links and a joint between them.
  RobotDescription read(const std::string& version, const std::string& inside_joint,
                        const std::string& inside_link = "") {
    diagnostics_ = {};
    const std::string attribute = version.empty() ? "" : " version=\"" + version + "\"";
    return parse_urdf("<robot name=\"r\"" + attribute + "><link name=\"a\">" + inside_link +
                          "</link><link name=\"b\"/><joint name=\"j\" type=\"revolute\"><parent link=\"a\"/>"
                          "<child link=\"b\"/>" +
                          inside_joint + "</joint></robot>",
                      "r.urdf", resolver_, diagnostics_);
  }
  [[nodiscard]] std::string warning() const {
    for (const Diagnostic& found : diagnostics_.all()) {
      if (found.rule == "urdf.version" && found.severity == Severity::warning) return found.message;
    }
    return "";
  }

  PackageResolver resolver_;
  Diagnostics diagnostics_;
};

constexpr const char* kTurned = "<origin xyz=\"1 2 3\" quat_xyzw=\"0.5 0.5 0.5 0.5\"/>";

// The values are those of urdfdom's urdf_schema_quaternion_test.
TEST_F(UrdfVersionTest, QuaternionIsRotationOfOrigin) {
  const RobotDescription robot = read("1.1", kTurned);
  const Eigen::Quaterniond expected(0.5, 0.5, 0.5, 0.5);
  EXPECT_LT((robot.joints.at(0).origin.pose().linear() - expected.toRotationMatrix()).norm(), 1e-15);
  EXPECT_EQ(robot.joints.at(0).origin.xyz, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(warning(), "");
}

TEST_F(UrdfVersionTest, QuaternionsAreReadAsTheirRotations) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 1000; ++i) {
    Eigen::Vector4d xyzw(normal(random), normal(random), normal(random), normal(random));
    // Every tenth one turns by 90 degrees about y, where roll and yaw are not unique.
    if (i % 10 == 0) xyzw = {0, std::numbers::sqrt2, 0, std::numbers::sqrt2};
    const auto rpy = rpy_of_quaternion(fmt::format(" {} {} {} {} ", xyzw.x(), xyzw.y(), xyzw.z(), xyzw.w()));
    ASSERT_TRUE(rpy.has_value());
    const Eigen::Quaterniond expected(Eigen::Vector4d(xyzw.normalized()));
    EXPECT_LT((rotation_from_rpy(*rpy) - expected.toRotationMatrix()).norm(), 1e-14);
  }
}

TEST_F(UrdfVersionTest, BadQuaternionIsRefused) {
  for (const char* text :
       {"", "0 0 0", "0 0 0 0", "0 0 0 1 0", "0 0 0 nan", "0 0 0 inf", "0,0,0,1", "a b c d"})
    EXPECT_FALSE(rpy_of_quaternion(text).has_value()) << text;
  EXPECT_THROW(read("1.1", "<origin quat_xyzw=\"0 0 0 0\"/>"), InputError);
  EXPECT_TRUE(read("", "<origin quat_xyzw=\"0 0 0 0\"/>").joints.at(0).origin.rpy.isZero());
}

TEST_F(UrdfVersionTest, BothRotationsAreErrorSinceVersion11) {
  const std::string both = "<origin rpy=\"0 0 1\" quat_xyzw=\"0.5 0.5 0.5 0.5\"/>";
  EXPECT_THROW(read("1.1", both), InputError);
  EXPECT_EQ(read("1.0", both).joints.at(0).origin.rpy, Eigen::Vector3d(0, 0, 1));
  EXPECT_THAT(warning(), HasSubstr("quat_xyzw beside rpy is ignored"));
}

TEST_F(UrdfVersionTest, NewerElementIsReadWithOneWarning) {
  const std::string shape =
      std::string("<visual>") + kTurned + "<geometry><box size=\"1 1 1\"/></geometry></visual>";
  const RobotDescription robot = read("", kTurned, shape + shape);
  EXPECT_FALSE(robot.joints.at(0).origin.rpy.isZero());
  EXPECT_EQ(diagnostics_.all().size(), 1U);
  EXPECT_THAT(warning(), HasSubstr("quat_xyzw of <origin> is of URDF 1.1, and the file is of version 1.0"));
  EXPECT_THAT(warning(), HasSubstr("2 times more"));
  read("1.0", "", "<collision><geometry><capsule radius=\"1\" length=\"1\"/></geometry></collision>");
  EXPECT_THAT(warning(), HasSubstr("<capsule> is of URDF 1.1"));
}

TEST_F(UrdfVersionTest, UnknownVersionIsReadAsNewestWithWarning) {
  for (const char* version :
       {"foo", "2", "1", "1.", ".1", "-1.0", "1.3", "2.0", "1.0.0", "1.0~pre6", "0.9"}) {
    const RobotDescription robot = read(version, kTurned);
    EXPECT_FALSE(robot.joints.at(0).origin.rpy.isZero()) << version;
    EXPECT_THAT(warning(), HasSubstr("is not a version of URDF")) << version;
  }
  for (const char* version : {"1.0", "1.1", "1.2"}) {
    read(version, "");
    EXPECT_EQ(warning(), "") << version;
  }
}

TEST_F(UrdfVersionTest, RateLimitsAreReadAndWritten) {
  const std::string limit =
      "<limit lower=\"-1\" upper=\"1\" effort=\"2\" velocity=\"3\" acceleration=\"4\" deceleration=\"5\" "
      "jerk=\"60\"/>";
  RobotDescription robot = read("1.2", limit);
  EXPECT_EQ(warning(), "");
  for (int round = 0; round < 2; ++round) {
    const JointLimits& limits = *robot.joints.at(0).limits;
    EXPECT_EQ(limits.acceleration, 4.0);
    EXPECT_EQ(limits.deceleration, 5.0);
    EXPECT_EQ(limits.jerk, 60.0);
    const std::string text = write_urdf(robot, kUrdf12);
    EXPECT_THAT(text, HasSubstr("version=\"1.2\""));
    EXPECT_THAT(write_urdf(robot), Not(HasSubstr("version=\"1.2\"")))
        << "expected a file that every parser takes";
    robot = parse_urdf(text, "written.urdf", resolver_, diagnostics_);
  }
  read("1.1", limit);
  EXPECT_THAT(warning(), HasSubstr("acceleration of <limit> is of URDF 1.2"));
}

TEST_F(UrdfVersionTest, NegativeRateLimitIsIgnored) {
  const RobotDescription robot =
      read("1.2", "<limit effort=\"2\" velocity=\"3\" acceleration=\"-4\" jerk=\"none\"/>");
  EXPECT_FALSE(robot.joints.at(0).limits->acceleration.has_value());
  EXPECT_FALSE(robot.joints.at(0).limits->jerk.has_value());
  EXPECT_EQ(robot.joints.at(0).limits->velocity, 3.0);
}

}  // namespace
}  // namespace doppel
