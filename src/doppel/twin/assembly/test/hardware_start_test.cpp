// A start that asks for hardware: it has it, or ends with the cause.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "doppel/base/core/unavailable_error.h"
#include "doppel/twin/assembly/twin.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class HardwareStart : public testing::Test {
 protected:
  HardwareStart() {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    log_.add_sink([this](const LogLine& line) { logged_ += line.text + "\n"; });
  }
  ~HardwareStart() override { fs::remove_all(folder_); }

  // An arm of one joint; `use` as `up` derives it from the argument.
  Scenario arm_with(const std::string& plugin, const std::string& use_sim) {
    std::ofstream(folder_ / "arm.urdf")
        << "<robot name='arm'><link name='world'/><link name='l'><inertial><mass value='0.1'/><inertia "
           "ixx='1e-4' "
           "iyy='1e-4' izz='1e-4' ixy='0' ixz='0' iyz='0'/></inertial></link><joint name='j' "
           "type='revolute'><parent "
           "link='world'/><child link='l'/><axis xyz='0 0 1'/><limit lower='-1' upper='1' effort='1' "
           "velocity='2'/>"
           "</joint><ros2_control name='Arm' type='system'><hardware><plugin>" +
               plugin +
               "</plugin></hardware><joint name='j'><param name='id'>1</param><param "
               "name='offset_deg'>0</param>"
               "<command_interface name='position'/><state_interface "
               "name='position'/></joint></ros2_control></robot>";
    Scenario out;
    out.robots = {{.target = (folder_ / "arm.urdf").string()}};
    if (!use_sim.empty()) out.robots.front().arguments = {{"use_sim", use_sim}};
    out.hardware = use_sim == "false" ? HardwareUse::real : HardwareUse::simulated;
    return out;
  }
  void hardware_yaml(const std::string& text) { std::ofstream(folder_ / "hardware.yaml") << text; }

  // The errors that end the start; empty: it starts.
  std::vector<Diagnostic> refusal(const Scenario& scenario) {
    found_ = {};
    try {
      const Twin twin(scenario, log_, found_);
    } catch (const UnavailableError& error) {
      return error.diagnostics();
    }
    return {};
  }
  [[nodiscard]] std::string found(const std::string& rule) const {
    for (const Diagnostic& one : found_.all()) {
      if (one.rule == rule) return one.str();
    }
    return "";
  }

  const fs::path folder_ = fs::path(testing::TempDir()) / "hardware_start";
  Log log_;
  std::string logged_;
  Diagnostics found_;
};

TEST_F(HardwareStart, MissingPortIsOnlyCause) {
  hardware_yaml("Arm: {port: /dev/ttyNONE}\n");
  const std::vector<Diagnostic> errors = refusal(arm_with("doppel/FeetechSts", "false"));
  ASSERT_EQ(errors.size(), 1U);
  EXPECT_EQ(errors[0].rule, "hardware.not_started");
  EXPECT_THAT(errors[0].message, HasSubstr("there is no port /dev/ttyNONE"));
  EXPECT_THAT(logged_, IsEmpty()) << "nothing follows from it";
}

TEST_F(HardwareStart, HardwareThatIsToStayUnconfiguredIsNotOpened) {
  hardware_yaml("Arm: {port: /dev/ttyNONE}\n");
  Scenario scenario = arm_with("doppel/FeetechSts", "false");
  std::ofstream(folder_ / "controllers.yaml") << "controller_manager:\n  ros__parameters:\n    "
                                                 "hardware_components_initial_state: {unconfigured: [Arm]}\n";
  scenario.robots.front().controllers = {(folder_ / "controllers.yaml").string()};
  EXPECT_THAT(refusal(scenario), IsEmpty());
}

TEST_F(HardwareStart, PluginWithoutDriverIsRefusedWithWaysToHardware) {
  const Scenario scenario = arm_with("arm6dof/ArmHardwareInterface", "false");
  const std::vector<Diagnostic> errors = refusal(scenario);
  ASSERT_EQ(errors.size(), 1U);
  EXPECT_THAT(
      errors[0].message,
      HasSubstr("use_sim:=false asks for hardware, and doppel has no driver 'arm6dof/ArmHardwareInterface'"));
  for (const char* way : {"doppel/FeetechSts", "hardware.yaml", "doppel/Topic", "--plugin"})
    EXPECT_THAT(errors[0].fix, HasSubstr(way));
}

TEST_F(HardwareStart, MisspeltDriverIsRefusedWithNearest) {
  const std::vector<Diagnostic> errors = refusal(arm_with("doppel/FeetechSTS", "false"));
  ASSERT_EQ(errors.size(), 1U);
  EXPECT_THAT(errors[0].message, HasSubstr("did you mean 'doppel/FeetechSts'?"));
}

TEST_F(HardwareStart, PluginWithoutDriverIsSimulatedWhereNothingAsksForHardware) {
  EXPECT_THAT(refusal(arm_with("arm6dof/ArmHardwareInterface", "")), IsEmpty());
  EXPECT_THAT(found("ros2_control.plugin_simulated"), Not(HasSubstr("use_sim:=false")));
}

TEST_F(HardwareStart, MockHardwareThatWasAskedToBeRealIsWarned) {
  EXPECT_THAT(refusal(arm_with("mock_components/GenericSystem", "false")), IsEmpty());
  EXPECT_THAT(
      found("hardware.nothing_driven"),
      HasSubstr("use_sim:=false, but nothing drives hardware: 'Arm' has mock_components/GenericSystem"));
  EXPECT_THAT(refusal(arm_with("mock_components/GenericSystem", "true")), IsEmpty());
  EXPECT_THAT(found("hardware.nothing_driven"), IsEmpty());
}

TEST_F(HardwareStart, TopicBasedSystemIsNoSimulator) {
  EXPECT_THAT(refusal(arm_with("topic_based_ros2_control/TopicBasedSystem", "")), IsEmpty());
  EXPECT_THAT(found("ros2_control.plugin_mapped"), IsEmpty());
  EXPECT_THAT(found("ros2_control.plugin_simulated"), HasSubstr("use_sim:=false drives the devices"));
}

}  // namespace
}  // namespace doppel
