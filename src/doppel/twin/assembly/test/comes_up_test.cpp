// Robots that ROS, Gazebo and RViz load with a warning about what is odd load here, too.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "doppel/twin/assembly/twin.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

struct Odd {
  const char* name;
  const char* rule;     // of the warning; "": none is expected
  std::string of_link;  // what the moving link has in place of a valid <inertial>
  std::string of_joint;
  std::string more;
};

const std::string kGood =
    "<inertial><mass value=\"1\"/><inertia ixx=\"0.01\" iyy=\"0.01\" izz=\"0.01\" ixy=\"0\" ixz=\"0\" "
    "iyz=\"0\"/></inertial>";
const std::string kLimits =
    "<axis xyz=\"0 0 1\"/><limit lower=\"-1\" upper=\"1\" effort=\"10\" velocity=\"1\"/>";

std::string second(const std::string& type, const std::string& inside) {
  return "<link name=\"m\">" + kGood + "</link><joint name=\"k\" type=\"" + type +
         "\"><parent link=\"l\"/><child link=\"m\"/>" + inside + "</joint>";
}

std::string hardware(const std::string& inside) {
  return "<ros2_control name=\"s\" type=\"system\"><hardware><plugin>mock_components/GenericSystem</plugin>"
         "</hardware>" +
         inside + "</ros2_control>";
}

const std::string kDriven =
    "<joint name=\"j\"><command_interface name=\"position\"/><state_interface name=\"position\"/></joint>";

std::vector<Odd> odd_robots() {
  return {
      {"FrictionAsAnAttribute", "", kGood, kLimits,
       "<gazebo reference=\"l\"><mu1 value=\"0.8\"/><kp value=\"1e6\"/></gazebo>"},
      {"FrictionThatIsNone", "urdf.optional_value", kGood, kLimits,
       "<gazebo reference=\"nobody\"><mu1>much</mu1></gazebo>"},
      {"AnInertialWithoutInertia", "urdf.inertial", "<inertial><mass value=\"1\"/></inertial>", kLimits, ""},
      {"ABoolGpio", "", kGood, kLimits,
       hardware(kDriven + "<gpio name=\"io\"><command_interface name=\"01\" data_type=\"bool\">"
                          "<param name=\"initial_value\">false</param></command_interface></gpio>")},
      {"AnExpressionInABound", "urdf.optional_value", kGood, kLimits,
       hardware("<joint name=\"j\"><command_interface name=\"position\"><param name=\"min\">{-2*pi}</param>"
                "</command_interface><state_interface name=\"position\"/></joint>")},
      {"AJointOfHardwareThatIsNotThere", "ros2_control.unknown_joint", kGood, kLimits,
       hardware(kDriven + "<joint name=\"ghost\"><command_interface name=\"position\"/></joint>")},
      {"HardwareOfGhostsOnly", "", kGood, kLimits,
       hardware("<joint name=\"ghost\"><command_interface name=\"position\"/></joint>")},
      {"TheSameHardwareTwice", "ros2_control.duplicate_interface", kGood, kLimits,
       hardware(kDriven) + hardware(kDriven)},
      {"AMimicOfAFixedJoint", "urdf.mimic_not_scalar", kGood, kLimits,
       second("fixed", "<mimic joint=\"j\"/>")},
      {"AMimicOfNobody", "urdf.mimic_unknown", kGood, kLimits,
       second("revolute", kLimits + "<mimic joint=\"nobody\"/>")},
      {"AMimicOfItself", "urdf.mimic_loop", kGood, kLimits,
       second("revolute", kLimits + "<mimic joint=\"k\"/>")},
      {"CrossedLimits", "urdf.limits_crossed", kGood,
       "<axis xyz=\"0 0 1\"/><limit lower=\"1\" upper=\"-1\" effort=\"10\" velocity=\"1\"/>", ""},
      {"AZeroAxis", "urdf.axis_zero", kGood,
       "<axis xyz=\"0 0 0\"/><limit lower=\"-1\" upper=\"1\" effort=\"10\" velocity=\"1\"/>", ""},
      {"AVisualWithoutGeometry", "urdf.geometry", kGood + "<visual/>", kLimits, ""},
      {"MisplacedGeometry", "", kGood + "<geometry><box size=\"1 1 1\"/></geometry>", kLimits, ""},
      {"APluginWithoutItsFile", "up.controllers_missing", kGood, kLimits,
       "<gazebo><plugin filename=\"gz_ros2_control-system\" name=\"p\"><parameters>/no/such.yaml</parameters>"
       "</plugin></gazebo>"},
      {"ATransmissionOfNobody", "urdf.optional_value", kGood, kLimits,
       "<transmission name=\"t\"><joint name=\"nobody\"/><actuator name=\"m\"><mechanicalReduction>x"
       "</mechanicalReduction></actuator></transmission>"},
  };
}

class TwinStartTest : public ::testing::TestWithParam<Odd> {};

TEST_P(TwinStartTest, UnusualDescriptionStartsWithWarning) {
  const Odd& odd = GetParam();
  const fs::path file =
      fs::temp_directory_path() / ("doppel_odd_" + std::to_string(::getpid()) + "_" + odd.name + ".urdf");
  std::ofstream(file) << "<robot name=\"a\"><link name=\"base\"/><link name=\"l\">" + odd.of_link +
                             "</link><joint name=\"j\" type=\"revolute\"><parent link=\"base\"/>"
                             "<child link=\"l\"/>" +
                             odd.of_joint + "</joint>" + odd.more + "</robot>";
  Scenario scenario;
  scenario.robots = {{.target = file.string()}};
  Log log;
  Diagnostics said;
  Twin twin(scenario, log, said);
  fs::remove(file);
  for (int i = 0; i < 100; ++i) {
    twin.between_steps();
    twin.step();
  }
  for (const double q : twin.robot().instance().q()) EXPECT_LT(std::abs(q), 0.1);
  EXPECT_FALSE(said.has_errors());
  bool warned = *odd.rule == '\0';
  for (const Diagnostic& d : said.all())
    warned = warned || (d.rule == odd.rule && d.severity == Severity::warning && d.where.known());
  EXPECT_TRUE(warned) << odd.rule;
}

INSTANTIATE_TEST_SUITE_P(Odd, TwinStartTest, ::testing::ValuesIn(odd_robots()),
                         [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace doppel
