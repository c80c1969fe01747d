// An optional element never makes a robot invalid: what urdfdom, sdformat or ros2_control leave out is a
// warning here.
#include <gtest/gtest.h>

#include <algorithm>

#include "doppel/description/urdf/load.h"

namespace doppel {
namespace {

class UrdfOptionalPartsTest : public ::testing::Test {
 protected:
  // Reads two links and their joint; `extra` is at the end of the robot, `of_link` in the second link.
  const RobotDescription& read(const std::string& extra, const std::string& of_link = "",
                               const std::string& of_joint = kAxisAndLimit,
                               const std::string& type = "revolute") {
    const std::string text = "<robot name=\"r\"><link name=\"base\"/><link name=\"arm\">" + of_link +
                             "</link><joint name=\"j\" type=\"" + type +
                             "\"><parent link=\"base\"/><child link=\"arm\"/>" + of_joint + "</joint>" +
                             extra + "</robot>";
    diagnostics_ = {};
    robot_ = parse_urdf(text, "r.urdf", resolver_, diagnostics_);
    return robot_;
  }
  // The number of warnings of `rule` that have a location.
  [[nodiscard]] auto warnings(const std::string& rule) const {
    return std::count_if(diagnostics_.all().begin(), diagnostics_.all().end(), [&](const Diagnostic& d) {
      return d.rule == rule && d.severity == Severity::warning && d.where.known();
    });
  }
  [[nodiscard]] bool silent() const { return diagnostics_.all().empty(); }
  // A second joint, after the first.
  static std::string finger(const std::string& inner, const std::string& type = "revolute") {
    return "<link name=\"finger\"/><joint name=\"k\" type=\"" + type +
           "\"><parent link=\"arm\"/><child link=\"finger\"/>" + kAxisAndLimit + inner + "</joint>";
  }

  static constexpr const char* kAxisAndLimit =
      "<axis xyz=\"0 0 1\"/><limit lower=\"-1\" upper=\"1\" effort=\"10\" velocity=\"1\"/>";
  PackageResolver resolver_;
  Diagnostics diagnostics_;
  RobotDescription robot_;
};

TEST_F(UrdfOptionalPartsTest, GazeboValuesAreReadFromAttributesOrText) {
  read(
      "<gazebo reference=\"arm\"><mu1 value=\"0.8\"/><mu2>0.5</mu2><kp value=\"1e6\">7</kp>"
      "<kd value=\"2\"/><selfCollide value=\"true\"/><turnGravityOff>True</turnGravityOff>"
      "<material value=\"Gazebo/Blue\"/></gazebo>");
  EXPECT_TRUE(silent());
  const GazeboExtension& gazebo = robot_.gazebo.at(0);
  EXPECT_EQ(gazebo.surface.mu, 0.8);
  EXPECT_EQ(gazebo.surface.mu2, 0.5);
  EXPECT_EQ(gazebo.surface.kp, 1e6) << "expected the attribute to take precedence";
  EXPECT_EQ(gazebo.surface.kd, 2.0);
  EXPECT_EQ(gazebo.self_collide, true);
  EXPECT_EQ(gazebo.gravity, false);
  EXPECT_EQ(gazebo.material, "Gazebo/Blue");
}

TEST_F(UrdfOptionalPartsTest, GazeboContactSurfaceIsRead) {
  read(
      "<gazebo reference=\"arm\"><fdir1>0 2 0</fdir1><slip1>0.1</slip1><slip2 "
      "value=\"0.2\"/><maxVel>1</maxVel>"
      "<minDepth>0.001</minDepth><doppel:contact>hull</doppel:contact></gazebo>");
  EXPECT_TRUE(silent());
  const ContactSurface& surface = robot_.gazebo.at(0).surface;
  EXPECT_EQ(surface.fdir1, Eigen::Vector3d(0, 2, 0));
  EXPECT_EQ(surface.slip1, 0.1);
  EXPECT_EQ(surface.slip2, 0.2);
  EXPECT_EQ(surface.max_velocity, 1.0);
  EXPECT_EQ(surface.min_depth, 0.001);
  EXPECT_EQ(surface.shape, "hull");
}

TEST_F(UrdfOptionalPartsTest, GazeboCollisionSurfaceIsRead) {
  read(
      "<gazebo "
      "reference=\"arm\"><mu1>0.3</mu1><collision><surface><friction><ode><mu2>0.4</mu2></ode><torsional>"
      "<coefficient>0.7</coefficient><patch_radius>0.02</patch_radius></torsional></friction></surface></"
      "collision>"
      "</gazebo>");
  EXPECT_TRUE(silent());
  const ContactSurface& surface = robot_.gazebo.at(0).surface;
  EXPECT_EQ(surface.mu, 0.3);
  EXPECT_EQ(surface.mu2, 0.4);
  EXPECT_EQ(surface.torsional_mu, 0.7);
  EXPECT_EQ(surface.patch_radius, 0.02);
}

TEST_F(UrdfOptionalPartsTest, ZeroFdir1IsNoDirection) {
  read("<gazebo reference=\"arm\"><fdir1 value=\"0 0 0\"/></gazebo>");
  EXPECT_TRUE(silent());
  EXPECT_FALSE(robot_.gazebo.at(0).surface.fdir1.has_value());
}

TEST_F(UrdfOptionalPartsTest, UnreadableContactSurfaceIsIgnored) {
  read("<gazebo reference=\"arm\"><fdir1>0 1</fdir1><doppel:contact>round</doppel:contact></gazebo>");
  EXPECT_EQ(warnings("urdf.optional_value"), 2);
  EXPECT_FALSE(robot_.gazebo.at(0).surface.fdir1.has_value());
  EXPECT_EQ(robot_.gazebo.at(0).surface.shape, "");
}

TEST_F(UrdfOptionalPartsTest, UnreadableGazeboValueIsIgnored) {
  read("<gazebo reference=\"nobody\"><mu1>much</mu1><kp/><selfCollide>maybe</selfCollide></gazebo>");
  EXPECT_EQ(warnings("urdf.optional_value"), 3);
  EXPECT_FALSE(robot_.gazebo.at(0).surface.mu.has_value());
  EXPECT_FALSE(robot_.gazebo.at(0).surface.kp.has_value());
  EXPECT_EQ(robot_.gazebo.at(0).self_collide, false);
}

TEST_F(UrdfOptionalPartsTest, BoolGpioHasInitialValue) {
  read(
      "<ros2_control name=\"s\" type=\"system\"><gpio name=\"io\">"
      "<command_interface name=\"a\" data_type=\"bool\"><param name=\"initial_value\">true</param>"
      "</command_interface><state_interface name=\"b\" data_type=\"bool\">"
      "<param name=\"initial_value\">false</param></state_interface></gpio></ros2_control>");
  EXPECT_TRUE(silent());
  EXPECT_EQ(robot_.hardware.at(0).gpios.at(0).command_interfaces.at(0).initial_value, 1.0);
  EXPECT_EQ(robot_.hardware.at(0).gpios.at(0).state_interfaces.at(0).initial_value, 0.0);
}

TEST_F(UrdfOptionalPartsTest, UnreadableInterfaceBoundsAreIgnored) {
  read(
      "<ros2_control name=\"s\" type=\"system\"><joint name=\"j\"><command_interface name=\"position\">"
      "<param name=\"min\">{-2*pi}</param><param name=\"max\">1</param></command_interface>"
      "<command_interface/></joint><joint/></ros2_control>");
  EXPECT_EQ(warnings("urdf.optional_value"), 3);
  ASSERT_EQ(robot_.hardware.at(0).joints.size(), 1U);
  ASSERT_EQ(robot_.hardware.at(0).joints.at(0).command_interfaces.size(), 1U);
  EXPECT_FALSE(robot_.hardware.at(0).joints.at(0).command_interfaces.at(0).min.has_value());
  EXPECT_EQ(robot_.hardware.at(0).joints.at(0).command_interfaces.at(0).max, 1.0);
}

TEST_F(UrdfOptionalPartsTest, IncompleteInertialIsIgnored) {
  const std::string tensor = "<inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" iyz=\"0\" izz=\"1\"/>";
  for (const std::string& inside :
       {tensor, "<mass value=\"1kg\"/>" + tensor, std::string("<mass value=\"1kg\"/>"),
        std::string("<mass value=\"0\"/>"), std::string("<mass value=\"1\"/><origin xyz=\"0 0\"/>"),
        "<mass value=\"1\"/><origin xyz=\"0 0\"/>" + tensor, "<mass/>" + tensor, std::string()}) {
    read("", "<inertial>" + inside + "</inertial>");
    EXPECT_GE(warnings("urdf.inertial"), 1) << inside;
    EXPECT_FALSE(robot_.links.at(1).inertial.has_value()) << inside;
  }
}

TEST_F(UrdfOptionalPartsTest, MassWithoutTensorIsKept) {
  read("", "<inertial><origin xyz=\"0 0 0.1\"/><mass value=\"1.5\"/></inertial>");
  EXPECT_EQ(warnings("urdf.inertial"), 1);
  ASSERT_TRUE(robot_.links.at(1).inertial.has_value());
  EXPECT_EQ(robot_.links.at(1).inertial->mass, 1.5);
  EXPECT_EQ(robot_.links.at(1).inertial->origin.xyz.z(), 0.1);
  EXPECT_FALSE(robot_.links.at(1).inertial->tensor_written);
  EXPECT_TRUE(robot_.links.at(1).inertial->source.known());
}

TEST_F(UrdfOptionalPartsTest, UnreadableShapeIsIgnored) {
  for (const char* inside :
       {"", "<geometry/>", "<geometry><cone/></geometry>", "<geometry><box size=\"1 1\"/></geometry>",
        "<geometry><sphere/></geometry>", "<geometry><mesh/></geometry>",
        "<origin xyz=\"a b c\"/><geometry><sphere radius=\"1\"/></geometry>"}) {
    for (const char* element : {"visual", "collision"}) {
      read("", "<" + std::string(element) + ">" + inside + "</" + element + ">");
      EXPECT_GE(warnings("urdf.geometry"), 1) << inside;
      EXPECT_TRUE(robot_.links.at(1).visuals.empty() && robot_.links.at(1).collisions.empty()) << inside;
    }
  }
}

TEST_F(UrdfOptionalPartsTest, FirstOfSeveralShapesIsUsed) {
  read("", "<visual><geometry><box size=\"1 1 1\"/><sphere radius=\"1\"/></geometry></visual>");
  EXPECT_TRUE(std::holds_alternative<Box>(robot_.links.at(1).visuals.at(0).geometry));
}

TEST_F(UrdfOptionalPartsTest, NegativeSizeIsTakenAbsolute) {
  read("", "<visual><geometry><box size=\"-1 2 3\"/></geometry></visual>");
  EXPECT_EQ(std::get<Box>(robot_.links.at(1).visuals.at(0).geometry).size, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(warnings("urdf.geometry"), 1);
}

TEST_F(UrdfOptionalPartsTest, MisplacedGeometryIsIgnored) {
  read("", "<geometry><box size=\"1 1 1\"/></geometry>");
  EXPECT_TRUE(robot_.links.at(1).visuals.empty());
}

TEST_F(UrdfOptionalPartsTest, MeshWithoutFileNameIsMissing) {
  read("", "<visual><geometry><mesh filename=\"\"/></geometry></visual>");
  EXPECT_EQ(warnings("mesh.missing"), 1);
  EXPECT_TRUE(std::get<MeshGeometry>(robot_.links.at(1).visuals.at(0).geometry).path.empty());
}

TEST_F(UrdfOptionalPartsTest, UnreadableColourIsIgnored) {
  read("<material name=\"m\"><color rgba=\"red\"/></material>");
  EXPECT_EQ(warnings("urdf.optional_value"), 1);
  EXPECT_FALSE(robot_.materials.at(0).rgba.has_value());
}

TEST_F(UrdfOptionalPartsTest, CrossedLimitsAreSwapped) {
  read("", "", "<axis xyz=\"0 0 1\"/><limit lower=\"2\" upper=\"-1\" effort=\"1\" velocity=\"1\"/>");
  EXPECT_EQ(warnings("urdf.limits_crossed"), 1);
  EXPECT_EQ(robot_.joints.at(0).limits->lower, 2.0) << "expected the description to stay as written";
}

TEST_F(UrdfOptionalPartsTest, ZeroAxisFixesJoint) {
  read("", "", "<axis xyz=\"0 0 0\"/><limit lower=\"-1\" upper=\"1\" effort=\"1\" velocity=\"1\"/>");
  EXPECT_EQ(warnings("urdf.axis_zero"), 1);
  EXPECT_FALSE(is_scalar(robot_.joints.at(0)));
}

TEST_F(UrdfOptionalPartsTest, FixedJointNeedsNoAxis) {
  read("", "", "<axis xyz=\"0 0\"/>", "fixed");
  EXPECT_EQ(warnings("urdf.optional_value"), 1);
}

TEST_F(UrdfOptionalPartsTest, MimicOfUnknownJointIsIgnored) {
  read(finger("<mimic joint=\"jj\"/>"));
  EXPECT_EQ(warnings("urdf.mimic_unknown"), 1);
  EXPECT_EQ(leader_of(robot_, robot_.joints.at(1)), nullptr);
  read(finger("<mimic joint=\"j\"/>"));
  EXPECT_EQ(leader_of(robot_, robot_.joints.at(1)), &robot_.joints.at(0));
  EXPECT_TRUE(silent());
}

TEST_F(UrdfOptionalPartsTest, MimicOfFixedJointIsIgnored) {
  read(finger("<mimic joint=\"j\"/>", "fixed"));
  EXPECT_EQ(warnings("urdf.mimic_not_scalar"), 1);
  read(finger("<mimic joint=\"j\"/>"), "", "", "fixed");
  EXPECT_EQ(warnings("urdf.mimic_not_scalar"), 1);
  read(finger("<mimic joint=\"j\"/>", "fixed"), "", "", "fixed");
  EXPECT_EQ(warnings("urdf.mimic_not_scalar"), 1);
  EXPECT_EQ(leader_of(robot_, robot_.joints.at(1)), nullptr);
}

TEST_F(UrdfOptionalPartsTest, MimicOfItselfIsIgnored) {
  read("", "", std::string(kAxisAndLimit) + "<mimic joint=\"j\"/>");
  EXPECT_EQ(warnings("urdf.mimic_loop"), 1);
  read(finger("<mimic joint=\"j\"/>"), "", std::string(kAxisAndLimit) + "<mimic joint=\"k\"/>");
  EXPECT_EQ(warnings("urdf.mimic_loop"), 2);
}

TEST_F(UrdfOptionalPartsTest, FaultySafetyAndCalibrationAreIgnored) {
  read("", "",
       std::string(kAxisAndLimit) +
           "<safety_controller k_velocity=\"x\" soft_lower_limit=\"y\"/><calibration rising=\"z\"/>");
  EXPECT_EQ(warnings("urdf.optional_value"), 3);
}

TEST_F(UrdfOptionalPartsTest, FaultyTransmissionIsIgnored) {
  read(
      "<transmission><joint/><actuator name=\"m\"><mechanicalReduction>x</mechanicalReduction></actuator>"
      "</transmission>");
  EXPECT_EQ(warnings("urdf.optional_value"), 1);
}

// What urdfdom rejects stays an error.
TEST_F(UrdfOptionalPartsTest, MissingRequiredJointElementIsError) {
  EXPECT_THROW(read("", "", "<axis xyz=\"0 0\"/>"), InputError);
  EXPECT_THROW(read("", "", "<origin xyz=\"0 0 x\"/>"), InputError);
  EXPECT_THROW(read("", "", "<limit lower=\"none\" upper=\"1\"/>"), InputError);
  EXPECT_THROW(read("", "", std::string(kAxisAndLimit) + "<dynamics damping=\"x\"/>"), InputError);
  EXPECT_THROW(read(finger("<mimic joint=\"j\" multiplier=\"x\"/>")), InputError);
  EXPECT_THROW(read("", "", kAxisAndLimit, "hinge"), InputError);
}

}  // namespace
}  // namespace doppel
