// For each rule on ros2_control, Gazebo and xacro's arguments: one small invalid input and its valid
// counterpart.
#include "doppel/review/audit/test/audit_rig.h"

namespace doppel {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

class Ros2ControlRulesTest : public AuditRig {};
class GazeboRulesTest : public AuditRig {};
class XacroArgumentRulesTest : public AuditRig {};

TEST_F(Ros2ControlRulesTest, GoodBlockGivesNoFinding) {
  write("urdf/r.urdf", robot(good_hardware()));
  for (const Finding& f : report().findings) {
    EXPECT_FALSE(f.rule.starts_with("ros2_control.") || f.rule.starts_with("gazebo.") ||
                 f.rule.starts_with("controllers.") || f.rule.starts_with("collision.") ||
                 f.rule.starts_with("world.") || f.rule.starts_with("package."))
        << f.rule << ": " << f.message;
  }
}

TEST_F(Ros2ControlRulesTest, UnknownJointIsReportedWithNearest) {
  const auto found = of("ros2_control.unknown_joint", hardware(driven("sholder") + driven("elbow")));
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_THAT(found[0].message, HasSubstr("did you mean 'shoulder'?"));
  EXPECT_EQ(found[0].severity, Severity::error);
  EXPECT_GT(found[0].where.line, 1);
}

TEST_F(Ros2ControlRulesTest, FixedJointIsReported) {
  const auto found = of("ros2_control.fixed_joint", hardware(driven("stand")));
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_EQ(found[0].severity, Severity::warning);
  const auto state_only = of("ros2_control.fixed_joint",
                             hardware("<joint name=\"stand\"><state_interface name=\"position\"/></joint>"));
  ASSERT_THAT(state_only, SizeIs(1));
  EXPECT_EQ(state_only[0].severity, Severity::note);
}

TEST_F(Ros2ControlRulesTest, CommandInterfaceOfMimicIsReported) {
  EXPECT_THAT(of("ros2_control.mimic_commanded", hardware(driven("follower"))), SizeIs(1));
  EXPECT_THAT(of("ros2_control.mimic_commanded",
                 hardware("<joint name=\"follower\"><state_interface name=\"position\"/></joint>")),
              IsEmpty());
  EXPECT_THAT(of("ros2_control.mimic_commanded",
                 hardware("<joint name=\"follower\" mimic=\"false\"><command_interface name=\"position\"/>"
                          "<state_interface name=\"position\"/></joint>")),
              IsEmpty());
}

TEST_F(Ros2ControlRulesTest, UnusualInterfaceIsReported) {
  const auto typo = of("ros2_control.interface_name", hardware(driven("elbow", "postion")));
  ASSERT_THAT(typo, SizeIs(1));
  EXPECT_THAT(typo[0].message, HasSubstr("did you mean 'position'?"));
  const auto word = of("ros2_control.interface_name", hardware(driven("elbow", "torque"), "my_driver/Arm"));
  ASSERT_THAT(word, SizeIs(1));
  EXPECT_EQ(word[0].severity, Severity::note);
  EXPECT_THAT(of("ros2_control.interface_name", hardware(driven("elbow", "temperature"))), IsEmpty());
}

TEST_F(Ros2ControlRulesTest, MissingInterfacesAndBoundsAreReported) {
  EXPECT_THAT(of("ros2_control.no_state",
                 hardware("<joint name=\"elbow\"><command_interface name=\"position\"/></joint>")),
              SizeIs(1));
  EXPECT_THAT(
      of("ros2_control.no_state",
         hardware("<joint name=\"elbow\"><command_interface name=\"position\"/></joint>", "m/Motor", "a") +
             hardware("<joint name=\"elbow\"><state_interface name=\"position\"/></joint>", "m/Encoder",
                      "b")),
      IsEmpty());
  EXPECT_THAT(of("ros2_control.no_interface", hardware("<joint name=\"elbow\"/>")), SizeIs(1));
  EXPECT_THAT(
      of("ros2_control.limits_crossed",
         hardware("<joint name=\"elbow\"><command_interface name=\"position\"><param name=\"min\">2</param>"
                  "<param name=\"max\">1</param></command_interface></joint>")),
      SizeIs(1));
  const std::string wheel =
      "<link name=\"w\"/><joint name=\"spin\" type=\"continuous\"><parent link=\"base\"/><child "
      "link=\"w\"/></joint>";
  EXPECT_THAT(of("ros2_control.no_limits", wheel + hardware(driven("spin", "velocity"))), SizeIs(1));
  EXPECT_THAT(of("ros2_control.no_limits", wheel + hardware(driven("spin", "position"))), IsEmpty());
}

TEST_F(Ros2ControlRulesTest, InitialValueOutsideLimitsIsReported) {
  const auto initial = [](const std::string& value) {
    return hardware(
        "<joint name=\"elbow\"><command_interface name=\"position\"/><state_interface name=\"position\">"
        "<param name=\"initial_value\">" +
        value + "</param></state_interface></joint>");
  };
  EXPECT_THAT(of("ros2_control.initial_value", initial("2.5")), SizeIs(1));
  EXPECT_THAT(of("ros2_control.initial_value", initial("2")), IsEmpty());
}

TEST_F(Ros2ControlRulesTest, RepeatedInterfaceIsReported) {
  const std::string mock = "mock_components/GenericSystem";
  const auto twice = of("ros2_control.duplicate_interface",
                        hardware(driven("elbow"), mock, "a") + hardware(driven("elbow"), mock, "b"));
  ASSERT_THAT(twice, SizeIs(1));
  EXPECT_THAT(twice[0].message, HasSubstr("of 'a'"));
  EXPECT_THAT(of("ros2_control.duplicate_component",
                 hardware(driven("elbow"), mock, "a") + hardware(driven("shoulder"), mock, "a")),
              SizeIs(1));
  EXPECT_THAT(of("ros2_control.duplicate_component",
                 hardware(driven("elbow"), mock, "a") + hardware(driven("shoulder"), mock, "b")),
              IsEmpty());
}

TEST_F(Ros2ControlRulesTest, OutdatedPluginsAreReported) {
  EXPECT_THAT(of("ros2_control.no_plugin", hardware(driven("elbow"), "")), SizeIs(1));
  const auto old =
      of("ros2_control.old_plugin", hardware(driven("elbow"), "ign_ros2_control/IgnitionSystem"));
  ASSERT_THAT(old, SizeIs(1));
  EXPECT_THAT(old[0].fix, HasSubstr("gz_ros2_control/GazeboSimSystem"));
  const auto typo =
      of("ros2_control.plugin_name", hardware(driven("elbow"), "gz_ros2_control/GazeboSymSystem"));
  ASSERT_THAT(typo, SizeIs(1));
  EXPECT_THAT(typo[0].message, HasSubstr("did you mean 'gz_ros2_control/GazeboSimSystem'?"));
  EXPECT_THAT(of("ros2_control.plugin_name", hardware(driven("elbow"), "my_driver/Arm")), IsEmpty());
}

TEST_F(Ros2ControlRulesTest, UnknownTypeIsReported) {
  const auto typed = [](const std::string& type) {
    return "<ros2_control name=\"a\" type=\"" + type + "\"><hardware><plugin>p/Q</plugin></hardware>" +
           driven("elbow") + "</ros2_control>";
  };
  const auto found = of("ros2_control.type", typed("sytem"));
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_THAT(found[0].message, HasSubstr("did you mean 'system'?"));
  EXPECT_THAT(of("ros2_control.type", typed("actuator")), IsEmpty());
}

TEST_F(Ros2ControlRulesTest, UnboundSensorIsReportedAtItsPlaceWithFix) {
  const auto sensor = [](const std::string& inner) {
    return hardware(driven("elbow") + "  <sensor name=\"fts\"><state_interface name=\"force.x\"/>" + inner +
                    "</sensor>");
  };
  const auto frame = [&](const std::string& name) {
    return sensor("<param name=\"frame_id\">" + name + "</param>");
  };
  const auto alone = of("ros2_control.sensor_unbound", sensor(""));
  ASSERT_THAT(alone, SizeIs(1));
  EXPECT_EQ(alone[0].severity, Severity::warning);
  EXPECT_GT(alone[0].where.line, 1);
  EXPECT_EQ(alone[0].where.column, 3);
  EXPECT_THAT(alone[0].fix, HasSubstr("<param name=\"joint\">JOINT</param>"));
  const auto misspelt = of("ros2_control.sensor_unbound", frame("lowr"));
  ASSERT_THAT(misspelt, SizeIs(1));
  EXPECT_THAT(misspelt[0].message, HasSubstr("did you mean 'lower'?"));
  EXPECT_THAT(of("ros2_control.sensor_unbound", frame("lower")), IsEmpty());
  EXPECT_THAT(of("ros2_control.sensor_unbound", sensor("<param name=\"joint\">elbow</param>")), IsEmpty());
  EXPECT_THAT(
      of("ros2_control.sensor_unbound",
         sensor("") + "<gazebo reference=\"elbow\"><sensor name=\"fts\" type=\"force_torque\"/></gazebo>"),
      IsEmpty());
  EXPECT_THAT(of("ros2_control.sensor_unbound",
                 sensor("<state_interface name=\"force.roll\"/><param name=\"joint\">elbow</param>")),
              SizeIs(1));
}

TEST_F(Ros2ControlRulesTest, FrameOfSensorThatIsNotInTfIsReported) {
  const auto camera = [](const std::string& frame) {
    return "<gazebo reference=\"lower\"><sensor name=\"eye\" type=\"camera\"><frame_id>" + frame +
           "</frame_id></sensor></gazebo>";
  };
  const auto missing = of("sensor.frame", camera("lowr"));
  ASSERT_THAT(missing, SizeIs(1));
  EXPECT_THAT(missing[0].message, testing::AllOf(HasSubstr("not in TF"), HasSubstr("did you mean 'lower'?")));
  EXPECT_GT(missing[0].where.line, 1);
  const auto turned = of("sensor.frame", camera("lower"));
  ASSERT_THAT(turned, SizeIs(1));
  EXPECT_THAT(turned[0].message, HasSubstr("axes are not optical"));
}

TEST_F(Ros2ControlRulesTest, UndrivenJointIsReported) {
  const auto found = of("ros2_control.undriven_joint", hardware(driven("elbow")));
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_EQ(found[0].subject, "joint 'shoulder'");
  EXPECT_EQ(found[0].severity, Severity::note);
}

TEST_F(GazeboRulesTest, UnknownReferenceIsReported) {
  const auto found = of("gazebo.reference", "<gazebo reference=\"uper\"><mu1>0.2</mu1></gazebo>");
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_THAT(found[0].message, HasSubstr("did you mean 'upper'?"));
  EXPECT_THAT(of("gazebo.reference", "<gazebo reference=\"elbow\"/>"), IsEmpty());
}

TEST_F(GazeboRulesTest, OutdatedPluginsAreReported) {
  const auto plugin = [](const std::string& file, const std::string& name) {
    return "<gazebo><plugin filename=\"" + file + "\" name=\"" + name + "\"/></gazebo>";
  };
  EXPECT_THAT(of("gazebo.old_plugin", plugin("libign_ros2_control-system.so", "x")), SizeIs(1));
  EXPECT_THAT(of("gazebo.old_plugin", plugin("ignition-gazebo-imu-system", "x")), SizeIs(1));
  EXPECT_THAT(of("gazebo.old_plugin", plugin("libgz_ros2_control-system.so", "x")), IsEmpty());
  EXPECT_THAT(of("gazebo.plugin_class", plugin("gz_ros2_control-system", "gz_ros2_control::GazeboSimSystem")),
              SizeIs(1));
  EXPECT_THAT(of("gazebo.plugin_class", plugin("gz_ros2_control-sytem", "x")), SizeIs(1));
  EXPECT_THAT(of("gazebo.plugin_class", plugin("gz-sim-imu-system", "gz::sim::systems::Imu")), IsEmpty());
}

TEST_F(GazeboRulesTest, HardwareWithoutPluginIsReported) {
  EXPECT_THAT(of("gazebo.no_control_plugin", hardware(driven("elbow"))), SizeIs(1));
  EXPECT_THAT(
      of("gazebo.no_simulated_hardware", hardware(driven("elbow"), "my_driver/Arm") + gazebo_plugin()),
      SizeIs(1));
  EXPECT_THAT(of("gazebo.no_control_plugin", good_hardware()), IsEmpty());
  EXPECT_THAT(of("gazebo.no_simulated_hardware", good_hardware()), IsEmpty());
  EXPECT_THAT(of("gazebo.no_control_plugin", hardware(driven("elbow"), "my_driver/Arm")), IsEmpty());
}

TEST_F(GazeboRulesTest, FaultyMaterialsAndTransmissionsAreReported) {
  const std::string orange = "<material>Gazebo/Orange</material></gazebo>";
  EXPECT_THAT(
      of("gazebo.material", "<gazebo reference=\"base\">" + orange + "<gazebo reference=\"upper\">" + orange),
      SizeIs(1));
  const auto transmission = [](const std::string& joint) {
    return "<transmission name=\"t\"><type>transmission_interface/SimpleTransmission</type><joint name=\"" +
           joint + "\"/></transmission>";
  };
  EXPECT_THAT(of("transmission.unknown_joint", transmission("elbw")), SizeIs(1));
  EXPECT_THAT(of("transmission.unknown_joint", transmission("elbow")), IsEmpty());
}

TEST_F(XacroArgumentRulesTest, UseBeforeDeclarationIsReported) {
  name_ = "urdf/r.urdf.xacro";
  const std::string head = "<robot name=\"r\" xmlns:xacro=\"http://www.ros.org/wiki/xacro\">\n";
  const std::string arg = "<xacro:arg name=\"use_sim\" default=\"false\"/>\n";
  const std::string include = "<xacro:include filename=\"hw.xacro\"/>\n";
  write("urdf/hw.xacro",
        "<robot xmlns:xacro=\"http://www.ros.org/wiki/xacro\"><xacro:if value=\"$(arg use_sim)\">" +
            hardware(driven("elbow") + driven("shoulder")) + gazebo_plugin() + "</xacro:if></robot>");
  write(name_, head + include + arg + tree() + "</robot>");
  const auto late = of("xacro.argument_late", {{"use_sim", "true"}});
  ASSERT_THAT(late, SizeIs(1));
  EXPECT_EQ(late[0].where.line, 3);
  write(name_, head + include + tree() + "</robot>");
  EXPECT_THAT(of("xacro.argument_undeclared", {{"use_sim", "true"}}), SizeIs(1));
  write(name_, head + arg + include + tree() + "</robot>");
  EXPECT_THAT(of("xacro.argument_late", {{"use_sim", "true"}}), IsEmpty());
  EXPECT_THAT(of("xacro.argument_undeclared"), IsEmpty());
  EXPECT_THAT(of("xacro.argument_unused"), IsEmpty());
  EXPECT_THAT(of("xacro.switch_idle"), IsEmpty());
}

TEST_F(XacroArgumentRulesTest, LateArgumentOfRootIsNote) {
  name_ = "urdf/r.urdf.xacro";
  write(name_,
        "<robot name=\"$(arg name)\" xmlns:xacro=\"http://www.ros.org/wiki/xacro\">\n"
        "<xacro:arg name=\"name\" default=\"x\"/>" +
            tree() + "</robot>");
  const auto late = of("xacro.argument_late", {{"name", "r"}});
  ASSERT_THAT(late, SizeIs(1));
  EXPECT_EQ(late[0].severity, Severity::note);
  EXPECT_EQ(late[0].where.line, 1);
}

TEST_F(XacroArgumentRulesTest, UnusedArgumentIsReported) {
  name_ = "urdf/r.urdf.xacro";
  const std::string head = "<robot name=\"r\" xmlns:xacro=\"http://www.ros.org/wiki/xacro\">\n";
  const std::string arg = "<xacro:arg name=\"use_sim\" default=\"false\"/>\n";
  write(name_, head + arg + tree() + "</robot>");
  const auto unused = of("xacro.argument_unused");
  ASSERT_THAT(unused, SizeIs(1));
  EXPECT_EQ(unused[0].severity, Severity::warning);
  write(name_, head + arg + "<xacro:property name=\"sim\" value=\"$(arg use_sim)\"/>" + tree() + "</robot>");
  EXPECT_THAT(of("xacro.argument_unused"), IsEmpty());
  EXPECT_THAT(of("xacro.switch_idle"), SizeIs(1));
}

}  // namespace
}  // namespace doppel
