// Which simulated sensor a <sensor> of <ros2_control> reads, and what is reported where it reads none.
#include "doppel/sensors/models/sensor_binding.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "doppel/scenario/compile/compiled_scenario.h"
#include "doppel/sensors/models/reading_names.h"

namespace doppel {
namespace {

using testing::HasSubstr;

constexpr const char* kSensedLinks = R"(<robot name="bound">
  <link name="base_link"/>
  <link name="hand"><inertial><mass value="1"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
  <joint name="wrist" type="fixed"><parent link="base_link"/><child link="hand"/><origin xyz="0 0 1"/></joint>
  <gazebo reference="hand">
    <sensor name="imu" type="imu"><pose>0 0 0.1 0 0 0</pose></sensor>
    <sensor name="eye" type="camera"/><sensor name="echoes" type="sonar"><pose>0 0 0.2 0 0 0</pose></sensor>
  </gazebo>
)";

std::string interfaces(const std::vector<std::string>& names) {
  std::string out;
  for (const std::string& name : names) out += "<state_interface name=\"" + name + "\"/>";
  return out;
}

class SensorBindingTest : public ::testing::Test {
 protected:
  // `sensors`: of the <ros2_control>, which is on line 9.
  SensorBindings bind(const std::string& sensors, std::optional<BaseKind> base = std::nullopt) {
    const auto file = std::filesystem::path(::testing::TempDir()) / fmt::format("bound_{}.urdf", getpid());
    std::ofstream(file) << kSensedLinks
                        << "<ros2_control name=\"cell\" type=\"system\"><hardware><plugin>mock_components/"
                           "GenericSystem</plugin></hardware>"
                        << sensors << "</ros2_control></robot>";
    Scenario scenario;
    scenario.robots = {{.target = file.string()}};
    scenario.robots[0].base = base;
    Diagnostics diagnostics;
    machine_ = std::make_unique<CompiledScenario>(scenario, diagnostics);
    const CompiledRobot& robot = *machine_->robots.at(0);
    return bind_sensors(robot.hardware().at(0), robot.model(), robot.sensors());
  }
  [[nodiscard]] static std::string said(const SensorBindings& bindings) {
    std::string out;
    for (const Diagnostic& one : bindings.unbound.all()) out += one.str() + "\n";
    return out;
  }
  std::unique_ptr<CompiledScenario> machine_;
};

TEST_F(SensorBindingTest, EqualNameBindsEachInterfaceToItsValue) {
  const SensorBindings bound =
      bind("<sensor name=\"imu\">" + interfaces({"angular_velocity.z", "orientation.w"}) + "</sensor>");
  EXPECT_EQ(said(bound), "");
  ASSERT_EQ(bound.sensors.size(), 1U);
  EXPECT_EQ(bound.sensors[0].description.X_LS.translation().z(), 0.1);
  const auto names = reading_names(bound.sensors[0].description);
  EXPECT_EQ(names.at(bound.values.at(0).at(0)->value), "angular_velocity.z");
  EXPECT_EQ(names.at(bound.values.at(0).at(1)->value), "orientation.w");
}

TEST_F(SensorBindingTest, ParametersPlaceSensorOnLinkJointOrFrame) {
  const SensorBindings bound = bind(
      "<sensor name=\"a\"><param name=\"frame_id\">hand</param>" + interfaces({"angular_velocity.x"}) +
      "</sensor><sensor name=\"b\"><param name=\"joint\">wrist</param>" +
      interfaces({"force.x", "torque.z"}) + "</sensor><sensor name=\"c\"><param name=\"link\">hand</param>" +
      interfaces({"position.x", "orientation.x", "orientation.y", "orientation.z", "orientation.w"}) +
      "</sensor><sensor name=\"d\"><param name=\"frame_id\">imu_frame</param>" + interfaces({"latitude"}) +
      "</sensor>");
  EXPECT_EQ(said(bound), "");
  ASSERT_EQ(bound.sensors.size(), 4U);
  EXPECT_TRUE(std::holds_alternative<ImuDescription>(bound.sensors[0].description.what));
  EXPECT_TRUE(std::holds_alternative<ForceTorqueDescription>(bound.sensors[1].description.what));
  EXPECT_EQ(bound.sensors[1].description.joint, "wrist");
  for (const RobotSensor& sensor : bound.sensors) EXPECT_EQ(sensor.description.link, "hand");
  EXPECT_EQ(std::get<EnvironmentDescription>(bound.sensors[2].description.what).kind, EnvironmentKind::pose);
  EXPECT_EQ(std::get<EnvironmentDescription>(bound.sensors[3].description.what).kind,
            EnvironmentKind::navsat);
  EXPECT_EQ(bound.sensors[3].X_LF.translation().z(), 0.1);
}

TEST_F(SensorBindingTest, RangeIsThatOfSensorOfNameFrameOrLink) {
  for (const char* named :
       {"<sensor name=\"echoes\">", "<sensor name=\"a\"><param name=\"frame_id\">echoes_frame</param>",
        "<sensor name=\"b\"><param name=\"link\">hand</param>"}) {
    const SensorBindings bound = bind(named + interfaces({"range"}) + "</sensor>");
    EXPECT_EQ(said(bound), "");
    ASSERT_EQ(bound.sensors.size(), 1U) << named;
    EXPECT_EQ(bound.sensors[0].description.name, "echoes");
    EXPECT_TRUE(bound.values.at(0).at(0).has_value());
  }
}

TEST_F(SensorBindingTest, SensorWithoutCounterpartIsErrorWithPlaceAndFix) {
  const SensorBindings bound = bind("<sensor name=\"imi\">" + interfaces({"orientation.w"}) + "</sensor>");
  EXPECT_TRUE(bound.sensors.empty());
  EXPECT_FALSE(bound.values.at(0).at(0).has_value());
  EXPECT_THAT(said(bound),
              testing::AllOf(HasSubstr("error"), HasSubstr(".urdf:9:"),
                             HasSubstr("'imi' of <ros2_control> reads NaN"), HasSubstr("did you mean 'imu'?"),
                             HasSubstr("type=\"imu\""), HasSubstr("<param name=\"frame_id\">LINK</param>")));
}

TEST_F(SensorBindingTest, NamesOfParametersAndTypesAreReported) {
  EXPECT_THAT(said(bind("<sensor name=\"ft\"><param name=\"joint\">wrst</param>" + interfaces({"force.x"}) +
                        "</sensor>")),
              testing::AllOf(HasSubstr("<param name=\"joint\">wrst</param> names nothing of the robot"),
                             HasSubstr("did you mean 'wrist'?")));
  EXPECT_THAT(said(bind("<sensor name=\"ft\"><param name=\"link\">base_link</param>" +
                        interfaces({"force.x"}) + "</sensor>")),
              HasSubstr("no joint carries"));
  EXPECT_THAT(said(bind("<sensor name=\"eye\">" + interfaces({"force.x"}) + "</sensor>")),
              HasSubstr("'eye' of the description has the type 'camera'"));
  EXPECT_THAT(
      said(bind("<sensor name=\"echo\">" + interfaces({"range"}) + "</sensor>")),
      testing::AllOf(HasSubstr("error"), HasSubstr("did you mean 'echoes'?"), HasSubstr("type=\"sonar\"")));
  EXPECT_THAT(said(bind("<sensor name=\"front\"><param name=\"frame_id\">base_link</param>" +
                        interfaces({"range"}) + "</sensor>")),
              HasSubstr("no range sensor is at"));
  EXPECT_THAT(
      said(bind("<sensor name=\"imu\">" + interfaces({"orientation.w", "orientation.roll"}) + "</sensor>")),
      HasSubstr("'imu/orientation.roll' reads NaN"));
}

TEST_F(SensorBindingTest, WrenchOfBaseLinkIsErrorWithPlaceAndFixWhetherBaseFloatsOrNot) {
  for (const BaseKind base : {BaseKind::fixed, BaseKind::floating}) {
    for (const char* key : {"frame_id", "link"}) {
      const SensorBindings bound =
          bind(fmt::format("<sensor name=\"ft\"><param name=\"{}\">base_link</param>", key) +
                   interfaces({"force.x"}) + "</sensor>",
               base);
      EXPECT_TRUE(bound.sensors.empty());
      EXPECT_THAT(said(bound),
                  testing::AllOf(HasSubstr(".urdf:9:"), HasSubstr("error"), HasSubstr("no joint carries"),
                                 HasSubstr("<param name=\"joint\">JOINT</param>")));
    }
  }
}

TEST_F(SensorBindingTest, WrittenInitialValuesAreConstants) {
  const std::string value = "<param name=\"initial_value\">12.5</param></state_interface>";
  EXPECT_EQ(said(bind("<sensor name=\"pack\"><state_interface name=\"voltage\">" + value + "</sensor>")), "");
  EXPECT_THAT(said(bind("<sensor name=\"ft\"><state_interface name=\"force.x\">" + value + "</sensor>")),
              testing::AllOf(HasSubstr("warning"), HasSubstr("keeps its initial values")));
  EXPECT_THAT(said(bind("<sensor name=\"pack\">" + interfaces({"voltage"}) + "</sensor>")),
              testing::AllOf(HasSubstr("error"), HasSubstr("initial_value")));
}

}  // namespace
}  // namespace doppel
