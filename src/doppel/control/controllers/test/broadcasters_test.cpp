// The broadcasters of sensors, each under the controller manager: topics, fields, parameters and errors of Jazzy.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "doppel/base/core/test/heap_touches.h"
#include "doppel/control/manager/test/manager_rig.h"
#include "doppel/ros/messages/control_msgs.h"
#include "doppel/ros/messages/sensor_msgs.h"
#include "doppel/ros/messages/tf2_msgs.h"

namespace doppel {
namespace {

using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr const char* kImu = "imu_sensor_broadcaster/IMUSensorBroadcaster";
constexpr const char* kWrench = "force_torque_sensor_broadcaster/ForceTorqueSensorBroadcaster";
constexpr const char* kRange = "range_sensor_broadcaster/RangeSensorBroadcaster";
constexpr const char* kFix = "gps_sensor_broadcaster/GPSSensorBroadcaster";
constexpr const char* kField = "magnetometer_broadcaster/MagnetometerBroadcaster";
constexpr const char* kPose = "pose_broadcaster/PoseBroadcaster";
constexpr const char* kBattery = "battery_state_broadcaster/BatteryStateBroadcaster";
constexpr const char* kStates = "state_interfaces_broadcaster/StateInterfacesBroadcaster";

// State interfaces of one sensor; their values are `first`, `first` + 1 ...
FakeHardwareOptions sensing(const std::string& sensor, const std::vector<std::string>& names,
                            double first = 1) {
  FakeHardwareOptions options;
  options.joints = {"a"};
  for (const std::string& name : names) options.more_states.push_back({sensor, name, first++});
  return options;
}

std::vector<std::string> axes(const std::string& of) {
  return {of + ".x", of + ".y", of + ".z"};
}
std::vector<std::string> joined(std::initializer_list<std::vector<std::string>> lists) {
  std::vector<std::string> out;
  for (const auto& list : lists) out.insert(out.end(), list.begin(), list.end());
  return out;
}

struct BroadcasterRig : ManagerRig {
  BroadcasterRig(const std::string& type, const std::string& parameters, FakeHardwareOptions options)
      : ManagerRig(controller_yaml("c", type, parameters), {{"a"}}, std::move(options)) {}

  void start() { ManagerRig::start({"c"}); }
  [[nodiscard]] std::string refusal() {
    return input_error_of([this] { start(); });
  }
  template <Message M>
  M last(const std::string& topic) {
    Recorder<M> recorder(bus, topic);
    if (manager->controllers().empty()) start();
    now = Time(std::chrono::milliseconds(2500));
    run(1);
    bus.spin();
    return recorder.messages.empty() ? M{} : recorder.messages.back();
  }
};

std::vector<double> numbers(const geometry_msgs::msg::Vector3& v) {
  return {v.x, v.y, v.z};
}

TEST(Broadcasters, ImuHasItsTenInterfacesFrameAndCovariances) {
  BroadcasterRig rig(
      kImu,
      "sensor_name: imu, frame_id: imu_link, static_covariance_orientation: [1., 2., 3., 4., 5., "
      "6., 7., 8., 9.]",
      sensing("imu", joined({axes("orientation"),
                             {"orientation.w"},
                             axes("angular_velocity"),
                             axes("linear_acceleration")})));
  const auto imu = rig.last<sensor_msgs::msg::Imu>("/c/imu");
  EXPECT_EQ(imu.orientation.x, 1);
  EXPECT_EQ(imu.orientation.w, 4);
  EXPECT_THAT(numbers(imu.angular_velocity), ElementsAre(5, 6, 7));
  EXPECT_THAT(numbers(imu.linear_acceleration), ElementsAre(8, 9, 10));
  EXPECT_EQ(imu.orientation_covariance[5], 6);
  EXPECT_THAT(imu.angular_velocity_covariance, Each(0));
  EXPECT_EQ(imu.header.frame_id, "imu_link");
  EXPECT_EQ(imu.header.stamp.sec, 2);
  EXPECT_EQ(imu.header.stamp.nanosec, 500'000'000U);
}

TEST(Broadcasters, ForceTorqueAddsOffsetBeforeItMultiplies) {
  BroadcasterRig rig(
      kWrench,
      "sensor_name: ft, frame_id: tool0, offset: {force: {z: 0.5}}, multiplier: {force: {z: -2.}, "
      "torque: {x: 10.}}",
      sensing("ft", joined({axes("force"), axes("torque")})));
  auto wrench = rig.last<geometry_msgs::msg::WrenchStamped>("/c/wrench");
  EXPECT_THAT(numbers(wrench.wrench.force), ElementsAre(1, 2, -7));
  EXPECT_THAT(numbers(wrench.wrench.torque), ElementsAre(40, 5, 6));
  EXPECT_EQ(wrench.header.frame_id, "tool0");
}

TEST(Broadcasters, ForceTorqueOfNamedInterfacesHasNaNForOthers) {
  BroadcasterRig rig(kWrench, "frame_id: tool0, interface_names: {force: {z: ft/push}, torque: {y: ft/turn}}",
                     sensing("ft", {"push", "turn"}));
  const auto wrench = rig.last<geometry_msgs::msg::WrenchStamped>("/c/wrench");
  EXPECT_EQ(wrench.wrench.force.z, 1);
  EXPECT_EQ(wrench.wrench.torque.y, 2);
  EXPECT_TRUE(std::isnan(wrench.wrench.force.x));
}

TEST(Broadcasters, ForceTorqueWithNeitherOrBothWaysOfNamingIsRefused) {
  const FakeHardwareOptions hardware = sensing("ft", axes("force"));
  EXPECT_THAT(BroadcasterRig(kWrench, "frame_id: tool0", hardware).refusal(),
              HasSubstr("neither 'sensor_name' nor 'interface_names'"));
  EXPECT_THAT(
      BroadcasterRig(kWrench, "frame_id: tool0, sensor_name: ft, interface_names: {force: {x: ft/force.x}}",
                     hardware)
          .refusal(),
      HasSubstr("both 'sensor_name' and 'interface_names'"));
}

TEST(Broadcasters, FilterChainOfForceTorqueIsReportedOnce) {
  BroadcasterRig rig(
      kWrench,
      "sensor_name: ft, frame_id: tool0, sensor_filter_chain: {filter1: {name: low_pass, type: "
      "control_filters/LowPassFilterWrench}}",
      sensing("ft", joined({axes("force"), axes("torque")})));
  rig.start();
  EXPECT_EQ(rig.count(Severity::warning, "filter chain is without effect"), 1U) << rig.said();
  EXPECT_EQ(rig.count(Severity::warning, "sensor_filter_chain"), 0U) << rig.said();
}

TEST(Broadcasters, RangeHasValuesOfParametersAndDefaultsOfJazzy) {
  BroadcasterRig rig(kRange, "sensor_name: sonar, frame_id: front, radiation_type: 1, max_range: 7.",
                     sensing("sonar", {"range"}, 3.5));
  const auto range = rig.last<sensor_msgs::msg::Range>("/c/range");
  EXPECT_EQ(range.range, 3.5F);
  EXPECT_EQ(range.radiation_type, sensor_msgs::msg::Range::INFRARED);
  EXPECT_EQ(range.max_range, 7.0F);
  EXPECT_EQ(range.min_range, 0.52F);
  EXPECT_EQ(range.field_of_view, 0.52F);
}

TEST(Broadcasters, FixHasCovarianceOfParameterOrOfInterfaces) {
  const std::vector<std::string> place{"status", "service", "latitude", "longitude", "altitude"};
  const std::string parameters = "sensor_name: gps, frame_id: antenna";
  BroadcasterRig rig(kFix, parameters + ", static_position_covariance: [4., 0., 0., 0., 5., 0., 0., 0., 6.]",
                     sensing("gps", place));
  const auto fix = rig.last<sensor_msgs::msg::NavSatFix>("/c/gps/fix");
  EXPECT_EQ(fix.status.status, 1);
  EXPECT_EQ(fix.status.service, 2);
  EXPECT_EQ(fix.latitude, 3);
  EXPECT_EQ(fix.altitude, 5);
  EXPECT_EQ(fix.position_covariance[4], 5);
  EXPECT_EQ(fix.position_covariance_type, sensor_msgs::msg::NavSatFix::COVARIANCE_TYPE_KNOWN);
  BroadcasterRig reading(
      kFix, parameters + ", read_covariance_from_interface: true",
      sensing("gps",
              joined({place, {"latitude_covariance", "longitude_covariance", "altitude_covariance"}})));
  const auto read = reading.last<sensor_msgs::msg::NavSatFix>("/c/gps/fix");
  EXPECT_EQ(read.position_covariance[0], 6);
  EXPECT_EQ(read.position_covariance[8], 8);
  EXPECT_EQ(read.position_covariance_type, sensor_msgs::msg::NavSatFix::COVARIANCE_TYPE_DIAGONAL_KNOWN);
}

TEST(Broadcasters, MagneticFieldHasStaticCovariance) {
  BroadcasterRig rig(kField,
                     "sensor_name: mag, frame_id: imu_link, static_covariance: [1., 0., 0., 0., 2., 0., 0., "
                     "0., 3.]",
                     sensing("mag", axes("magnetic_field")));
  const auto field = rig.last<sensor_msgs::msg::MagneticField>("/c/magnetic_field");
  EXPECT_THAT(numbers(field.magnetic_field), ElementsAre(1, 2, 3));
  EXPECT_EQ(field.magnetic_field_covariance[8], 3);
}

FakeHardwareOptions posed(double w) {
  FakeHardwareOptions options = sensing("tool", axes("position"));
  for (const char* name : {"orientation.x", "orientation.y", "orientation.z"})
    options.more_states.push_back({"tool", name, 0});
  options.more_states.push_back({"tool", "orientation.w", w});
  return options;
}

TEST(Broadcasters, PoseIsAlsoTransformUnlessSwitchedOff) {
  BroadcasterRig rig(kPose, "pose_name: tool, frame_id: base", posed(1));
  Recorder<tf2_msgs::msg::TFMessage> transforms(rig.bus, "/tf");
  const auto pose = rig.last<geometry_msgs::msg::PoseStamped>("/c/pose");
  EXPECT_EQ(pose.pose.position.z, 3);
  EXPECT_EQ(pose.pose.orientation.w, 1);
  EXPECT_EQ(pose.header.frame_id, "base");
  ASSERT_EQ(transforms.messages.size(), 1U);
  EXPECT_EQ(transforms.messages[0].transforms.at(0).child_frame_id, "tool");
  EXPECT_EQ(transforms.messages[0].transforms.at(0).transform.translation.y, 2);
  BroadcasterRig off(kPose, "pose_name: tool, frame_id: base, tf: {enable: false}", posed(1));
  off.start();
  for (const TopicInfo& topic : off.bus.topics()) EXPECT_NE(topic.name, "/tf");
}

TEST(Broadcasters, PoseThatIsNoneIsReportedOnceAndNoTransform) {
  BroadcasterRig rig(kPose, "pose_name: tool, frame_id: base", posed(0.5));
  Recorder<tf2_msgs::msg::TFMessage> transforms(rig.bus, "/tf");
  rig.start();
  rig.run(200);
  EXPECT_EQ(transforms.messages.size(), 0U);
  EXPECT_EQ(rig.count(Severity::error, "not of unit length"), 1U) << rig.said();
}

TEST(Broadcasters, StateInterfacesHaveNamesAndValuesInOrder) {
  BroadcasterRig rig(kStates, "interfaces: [imu/b, a/position, imu/a]", sensing("imu", {"a", "b"}));
  const auto values = rig.last<control_msgs::msg::Float64Values>("/c/values");
  EXPECT_THAT(values.values, ElementsAre(2, 0, 1));
  const auto names = rig.last<control_msgs::msg::Keys>("/c/names");  // comes late
  EXPECT_THAT(names.keys, ElementsAre("imu/b", "a/position", "imu/a"));
  EXPECT_THAT(BroadcasterRig(kStates, "", sensing("imu", {"a"})).refusal(), HasSubstr("publishes nothing"));
}

TEST(Broadcasters, BatteriesAreMeanSumAndWorstOfAll) {
  FakeHardwareOptions hardware;
  hardware.joints = {"a"};
  hardware.more_states = {{"left", "battery_voltage", 11},     {"left", "battery_charge", 2},
                          {"right", "battery_voltage", 13},    {"right", "battery_charge", 3},
                          {"right", "battery_percentage", 90}, {"right", "battery_power_supply_health", 2}};
  BroadcasterRig rig(
      kBattery,
      "batteries: [left, right], interfaces: {left: {battery_charge: true}, right: {battery_charge: "
      "true, battery_percentage: true, battery_power_supply_health: true}}, left: {minimum_voltage: "
      "10., maximum_voltage: 12., capacity: 4., location: bay, power_supply_technology: 2}, right: "
      "{capacity: 5., power_supply_technology: 2}",
      hardware);
  const auto all = rig.last<sensor_msgs::msg::BatteryState>("/c/battery_state");
  EXPECT_EQ(all.voltage, 12);
  EXPECT_EQ(all.charge, 5);
  EXPECT_EQ(all.percentage, 70);  // 50 by its voltage, and 90
  EXPECT_EQ(all.capacity, 9);
  EXPECT_EQ(all.power_supply_health, 2);
  EXPECT_EQ(all.power_supply_technology, 2);
  EXPECT_EQ(all.location, "bay, , ");
  EXPECT_TRUE(std::isnan(all.current));
  const auto each = rig.last<control_msgs::msg::BatteryStateArray>("/c/raw_battery_states");
  ASSERT_EQ(each.battery_states.size(), 2U);
  EXPECT_EQ(each.battery_states[0].percentage, 50);
  EXPECT_EQ(each.battery_states[0].header.frame_id, "left");
  EXPECT_TRUE(each.battery_states[1].present);
}

TEST(Broadcasters, DeprecatedBatteryReadsVoltageAlone) {
  BroadcasterRig rig(kBattery, "sensor_name: pack, design_capacity: 8., power_supply_technology: 3",
                     sensing("pack", {"voltage"}, 24));
  const auto state = rig.last<sensor_msgs::msg::BatteryState>("/c/battery_state");
  EXPECT_EQ(state.voltage, 24);
  EXPECT_EQ(state.design_capacity, 8);
  EXPECT_EQ(state.power_supply_technology, 3);
  EXPECT_THAT(BroadcasterRig(kBattery, "", sensing("pack", {"voltage"})).refusal(),
              HasSubstr("neither 'batteries' nor 'sensor_name'"));
  EXPECT_THAT(
      BroadcasterRig(kBattery, "batteries: [pack], pack: {minimum_voltage: 12., maximum_voltage: 10.}",
                     sensing("pack", {"battery_voltage"}))
          .refusal(),
      HasSubstr("is not above its minimum_voltage"));
}

TEST(Broadcasters, MissingNamesAndWrongListsAreRefusedWithPlace) {
  const FakeHardwareOptions hardware = sensing("imu", axes("angular_velocity"));
  for (const char* type : {kImu, kRange, kFix, kField})
    EXPECT_THAT(BroadcasterRig(type, "frame_id: base", hardware).refusal(),
                HasSubstr("has no 'sensor_name'"));
  EXPECT_THAT(BroadcasterRig(kImu, "sensor_name: imu", hardware).refusal(), HasSubstr("has no 'frame_id'"));
  EXPECT_THAT(BroadcasterRig(kPose, "frame_id: base", hardware).refusal(), HasSubstr("has no 'pose_name'"));
  EXPECT_THAT(BroadcasterRig(
                  kImu, "sensor_name: imu, frame_id: base, static_covariance_orientation: [1., 2.]", hardware)
                  .refusal(),
              testing::AllOf(HasSubstr("9 numbers, not 2"), HasSubstr("test.yaml:2")));
  BroadcasterRig typo(kImu, "sensor_name: imu, frame_id: base, static_covariance_orientatio: [1., 2.]",
                      hardware);
  static_cast<void>(typo.refusal());
  EXPECT_EQ(typo.count(Severity::warning, "did you mean 'static_covariance_orientation'"), 1U) << typo.said();
}

TEST(Broadcasters, UpdateWithListenersDoesNotAllocate) {
  FakeHardwareOptions hardware = posed(1);
  for (const std::string& name : joined({axes("force"),
                                         axes("torque"),
                                         axes("orientation"),
                                         {"orientation.w"},
                                         axes("angular_velocity"),
                                         axes("linear_acceleration")}))
    hardware.more_states.push_back({"imu", name, 0});
  hardware.more_states.push_back({"pack", "battery_voltage", 12});
  const std::string all = R"(
controller_manager:
  ros__parameters:
    imu: {type: imu_sensor_broadcaster/IMUSensorBroadcaster}
    ft: {type: force_torque_sensor_broadcaster/ForceTorqueSensorBroadcaster}
    pose: {type: pose_broadcaster/PoseBroadcaster}
    battery: {type: battery_state_broadcaster/BatteryStateBroadcaster}
    states: {type: state_interfaces_broadcaster/StateInterfacesBroadcaster}
imu: {ros__parameters: {sensor_name: imu, frame_id: a_frame_whose_name_is_too_long_for_a_short_string}}
ft: {ros__parameters: {sensor_name: imu, frame_id: tool0}}
pose: {ros__parameters: {pose_name: tool, frame_id: base}}
battery: {ros__parameters: {batteries: [pack], pack: {location: a_place_whose_name_is_too_long_for_a_short_string}}}
states: {ros__parameters: {interfaces: [imu/force.x, tool/position.y]}}
)";
  ManagerRig rig(all, {{"a"}}, hardware);
  rig.start({"imu", "ft", "pose", "battery", "states"});
  const auto edge = rig.bus.attach("listener");
  for (const TopicInfo& topic : rig.bus.topics()) edge->subscribe(topic.id);
  rig.run(3);
  test::HeapTouches touches;
  for (int i = 0; i < 200; ++i) {
    touches.run();
    rig.manager->tick(rig.now);
    touches.pause();
    rig.now += rig.manager->period();
  }
  EXPECT_EQ(touches.count(), 0U);
  Edge::Incoming message;
  EXPECT_TRUE(edge->next(message));
}

}  // namespace
}  // namespace doppel
