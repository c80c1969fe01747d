// Sensors of the environment on bodies at known places, against closed forms.
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "doppel/base/core/test/heap_touches.h"
#include "doppel/ros/messages/ros_gz_interfaces.h"
#include "doppel/ros/messages/sensor_msgs.h"
#include "physical_fixture.h"

namespace doppel {
namespace {

using ros_gz_interfaces::msg::Altimeter;
using ros_gz_interfaces::msg::LogicalCameraImage;
using sensor_msgs::msg::FluidPressure;
using sensor_msgs::msg::MagneticField;
using sensor_msgs::msg::NavSatFix;
using test::Sensed;
using test::vector_of;

constexpr double kFreeFall = 9.81, kRadPerDegree = std::numbers::pi / 180;

RobotDescription loose_brick() {
  RobotDescription robot;
  robot.name = "brick";
  robot.links = {test::make_link("body", 2, {0, 0, 0}, {0.01, 0.02, 0.03})};
  return robot;
}

RobotDescription mast() {
  RobotDescription robot;
  robot.name = "mast";
  robot.links = {test::make_frame("base"), test::make_link("top", 1, {0, 0, 0}, {1e-3, 1e-3, 1e-3})};
  robot.joints = {test::make_joint("turn", JointType::continuous, "base", "top", {0, 0, 2}, {0, 0, 1})};
  return robot;
}

RigSensor sensor_on(const std::string& instance, const std::string& link, int index, EnvironmentKind kind,
                    double rate = 100) {
  RigSensor sensor = test::make_rig_sensor(instance, link, index, "sensor", rate);
  EnvironmentDescription what;
  what.kind = kind;
  sensor.description.what = what;
  return sensor;
}

EnvironmentDescription& environment_of(RigSensor& sensor) {
  return std::get<EnvironmentDescription>(sensor.description.what);
}

template <Message M>
std::vector<M> readings_of(const RigSensor& sensor, const EarthFrame& earth = {}, double seconds = 0.01) {
  Sensed twin(mast(), test::empty_space(), {sensor});
  twin.rig.set_earth(earth);
  twin.start();
  std::vector<M> out;
  twin.read("/sensor", out);
  twin.run(seconds);
  return out;
}

TEST(Environment, SatellitesReadPlaceOfSensorOnEllipsoid) {
  EarthFrame earth;
  earth.is_given = true;
  earth.origin = {47.0, 8.0, 400};
  RigSensor sensor = sensor_on("mast", "top", 1, EnvironmentKind::navsat);
  sensor.description.X_LS = make_pose({0, 1000, 0}, {0, 0, 0});
  const auto readings = readings_of<NavSatFix>(sensor, earth);
  ASSERT_EQ(readings.size(), 1U);
  // A kilometre along the meridian, whose radius of curvature is a (1 - e^2) / (1 - e^2 sin^2)^1.5.
  constexpr double kA = 6378137, kE2 = 6.69437999014e-3;
  const double s = std::sin(47 * kRadPerDegree);
  const double radius = kA * (1 - kE2) / std::pow(1 - kE2 * s * s, 1.5) + 402;
  EXPECT_NEAR(readings[0].latitude, 47 + std::atan(1000 / radius) / kRadPerDegree, 1e-8);
  EXPECT_NEAR(readings[0].longitude, 8, 1e-12);
  // The tangent plane rises above the ellipsoid by d^2 / 2 r.
  EXPECT_NEAR(readings[0].altitude, 402 + 1e6 / (2 * radius), 1e-3);
  EXPECT_EQ(readings[0].status.status, sensor_msgs::msg::NavSatStatus::STATUS_FIX);
  EXPECT_EQ(readings[0].status.service, sensor_msgs::msg::NavSatStatus::SERVICE_GPS);
  EXPECT_EQ(readings[0].position_covariance_type, NavSatFix::COVARIANCE_TYPE_UNKNOWN);
  EXPECT_EQ(readings[0].header.frame_id, "top");
}

TEST(Environment, NoiseOfSatellitesIsInMetres) {
  constexpr double kStddev = 3, kMetrePerDegree = 6378137 * kRadPerDegree;
  RigSensor sensor = sensor_on("mast", "top", 1, EnvironmentKind::navsat, 0);
  environment_of(sensor).noise[0].stddev = kStddev;
  environment_of(sensor).noise[1].stddev = 2 * kStddev;
  const auto readings = readings_of<NavSatFix>(sensor, {}, 4);
  double across = 0, up = 0;
  for (const NavSatFix& fix : readings) {
    across += std::pow(fix.longitude * kMetrePerDegree, 2);
    up += std::pow(fix.altitude - 2, 2);
  }
  const auto count = static_cast<double>(readings.size());
  EXPECT_NEAR(std::sqrt(across / count), kStddev, 0.1);
  EXPECT_NEAR(std::sqrt(up / count), 2 * kStddev, 0.2);
  EXPECT_DOUBLE_EQ(readings[0].position_covariance[4], kStddev * kStddev);
  EXPECT_DOUBLE_EQ(readings[0].position_covariance[8], 4 * kStddev * kStddev);
  EXPECT_EQ(readings[0].position_covariance_type, NavSatFix::COVARIANCE_TYPE_DIAGONAL_KNOWN);
}

TEST(Environment, MagnetometerReadsFieldOfWorldInItsOwnAxes) {
  RigSensor sensor = sensor_on("mast", "top", 1, EnvironmentKind::magnetometer);
  // x of the sensor is y of the world.
  sensor.description.X_LS = sensor.X_LF = make_pose({0, 0, 0}, {0, 0, std::numbers::pi / 2});
  const auto by_default = readings_of<MagneticField>(sensor);
  ASSERT_EQ(by_default.size(), 1U);
  EXPECT_LT(
      (vector_of(by_default[0].magnetic_field) - Eigen::Vector3d(22.8758e-6, -5.5645e-6, -42.3884e-6)).norm(),
      1e-15);
  EarthFrame earth;
  earth.magnetic_field = {1e-5, 0, -2e-5};
  environment_of(sensor).noise[2].stddev = 1e-7;
  const auto given = readings_of<MagneticField>(sensor, earth);
  EXPECT_NEAR(given[0].magnetic_field.y, -1e-5, 1e-15);
  EXPECT_DOUBLE_EQ(given[0].magnetic_field_covariance[8], 1e-14);
}

TEST(Environment, AltimeterReadsHeightAndSpeedFromItsStart) {
  constexpr double kFall = 0.5;
  Sensed twin(loose_brick(), test::empty_space(), {sensor_on("brick", "body", 1, EnvironmentKind::altimeter)},
              BaseKind::floating);
  const double start = twin.world.engine->instance(0).base_pose().translation().z();
  twin.start();
  std::vector<Altimeter> readings;
  twin.read("/sensor", readings);
  twin.run(kFall);
  ASSERT_EQ(readings.size(), 50U);
  EXPECT_NEAR(readings.back().vertical_position, -kFreeFall * kFall * kFall / 2, 5e-3);
  EXPECT_NEAR(readings.back().vertical_velocity, -kFreeFall * kFall, 1e-6);
  EXPECT_DOUBLE_EQ(readings.back().vertical_reference, start);
}

TEST(Environment, PressureFallsByWeightOfAirAbove) {
  RigSensor sensor = sensor_on("mast", "top", 1, EnvironmentKind::air_pressure);
  sensor.description.X_LS = make_pose({0, 0, 98}, {0, 0, 0});
  environment_of(sensor).noise[0] = {0, 0, 0, 0, 0.5, 0, 0};
  const auto rounded = readings_of<FluidPressure>(sensor);
  ASSERT_EQ(rounded.size(), 1U);
  EXPECT_NEAR(std::remainder(rounded[0].fluid_pressure, 0.5), 0, 1e-9);
  environment_of(sensor).noise[0] = {};
  // 100 m of air of 1.2250 kg/m^3 at sea level, 1.2133 at 100 m: by the mean of both.
  EXPECT_NEAR(readings_of<FluidPressure>(sensor)[0].fluid_pressure, 101325 - 100 * 9.80665 * 1.21915, 0.5);
  environment_of(sensor).reference = 1000;
  environment_of(sensor).noise[0].stddev = 2;
  const auto noisy = readings_of<FluidPressure>(sensor);
  EXPECT_NEAR(noisy[0].fluid_pressure, 88797, 50);  // at 1100 m, by the published table
  EXPECT_DOUBLE_EQ(noisy[0].variance, 4);
}

TEST(Environment, LogicalCameraSeesModelsWhoseOriginsAreInItsFrustum) {
  World world = test::empty_space();
  const auto add = [&](const char* name, const Eigen::Vector3d& at) {
    WorldObject ball;
    ball.name = name;
    ball.shape = Sphere{0.01};
    ball.X_WO.translation() = at;
    world.objects.push_back(ball);
  };
  // The camera is 2 m above the ground and looks along x, by 45 degrees to each side and by atan(0.5) up and down.
  add("ahead", {3, 0, 2});
  add("left", {3, 2.9, 2});
  add("too_far_left", {3, 3.1, 2});
  add("high", {3, 0, 3.45});
  add("too_high", {3, 0, 3.55});
  add("behind", {-3, 0, 2});
  add("near", {0.4, 0, 2});
  add("far", {5.1, 0, 2});
  RigSensor sensor = sensor_on("mast", "top", 1, EnvironmentKind::logical_camera);
  environment_of(sensor).near = 0.5;
  environment_of(sensor).far = 5;
  environment_of(sensor).hfov = std::numbers::pi / 2;
  environment_of(sensor).aspect = 2;
  Sensed twin(mast(), world, {sensor});
  twin.start();
  std::vector<LogicalCameraImage> pictures;
  twin.read("/sensor", pictures);
  twin.run(0.02);
  ASSERT_EQ(pictures.size(), 2U);
  std::vector<std::string> seen;
  for (const auto& model : pictures[1].model) seen.push_back(model.name);
  EXPECT_THAT(seen, testing::UnorderedElementsAre("ahead", "left", "high"));
  EXPECT_NEAR(pictures[1].pose.position.z, 2, 1e-12);
  EXPECT_NEAR(pictures[1].model.at(1).pose.position.y, 2.9, 1e-9);
  EXPECT_NEAR(pictures[1].model.at(1).pose.position.z, 0, 1e-9);
}

TEST(Environment, LatencyDelaysMessageAndKeepsStamp) {
  constexpr double kLatency = 0.025;
  RigSensor sensor = sensor_on("mast", "top", 1, EnvironmentKind::magnetometer);
  sensor.description.latency = kLatency;
  Sensed twin(mast(), test::empty_space(), {sensor});
  twin.start();
  std::vector<MagneticField> readings;
  twin.read("/sensor", readings);
  twin.run(0.034);
  EXPECT_TRUE(readings.empty());
  twin.run(0.001);
  ASSERT_EQ(readings.size(), 1U);
  EXPECT_NEAR(to_seconds(test::time_of(readings[0].header)), 0.01, 1e-9);
  twin.run(0.165);
  EXPECT_EQ(readings.size(), 17U);
  EXPECT_NEAR(to_seconds(test::time_of(readings.back().header)), 0.17, 1e-9);
}

TEST(Environment, LogicalCameraWithLatencySeesWhatWasThereAtItsStamp) {
  World world = test::empty_space();
  WorldObject ball;
  ball.name = "ball";
  ball.shape = Sphere{0.01};
  ball.X_WO.translation() = Eigen::Vector3d(3, 0, 2);
  world.objects.push_back(ball);
  RigSensor sensor = sensor_on("mast", "top", 1, EnvironmentKind::logical_camera);
  environment_of(sensor).far = 100;
  environment_of(sensor).hfov = 1;
  sensor.description.latency = 0.025;
  Sensed twin(mast(), world, {sensor});
  twin.start();
  std::vector<LogicalCameraImage> pictures;
  twin.read("/sensor", pictures);
  twin.run(0.015);
  twin.world.object("ball").place(make_pose({-3, 0, 2}, {0, 0, 0}));
  twin.run(0.019);
  EXPECT_TRUE(pictures.empty());
  twin.run(0.011);
  ASSERT_EQ(pictures.size(), 2U);
  EXPECT_NEAR(to_seconds(test::time_of(pictures[0].header)), 0.01, 1e-9);
  EXPECT_EQ(pictures[0].header.frame_id, "top");
  EXPECT_EQ(pictures[0].model.size(), 1U);
  EXPECT_EQ(pictures[1].header.frame_id, "top");
  EXPECT_TRUE(pictures[1].model.empty());
}

TEST(Environment, SensorsDoNotAllocateWhilePublishing) {
  std::vector<RigSensor> sensors;
  for (const EnvironmentKind kind :
       {EnvironmentKind::navsat, EnvironmentKind::magnetometer, EnvironmentKind::altimeter,
        EnvironmentKind::air_pressure, EnvironmentKind::logical_camera}) {
    RigSensor& sensor = sensors.emplace_back(sensor_on("mast", "top", 1, kind, 0));
    sensor.description.name = "sensor_" + std::to_string(sensors.size());
    const bool delayed = kind == EnvironmentKind::navsat || kind == EnvironmentKind::logical_camera;
    sensor.description.latency = delayed ? 0.02 : 0;
    environment_of(sensor).noise[0].stddev = 1e-6;
    environment_of(sensor).far = 100;
    environment_of(sensor).hfov = 1;
  }
  World world = test::empty_space();
  WorldObject ball;
  ball.name = "a ball whose name is too long to be kept without memory of its own";
  ball.shape = Sphere{0.01};
  ball.X_WO.translation() = Eigen::Vector3d(3, 0, 2);
  world.objects.push_back(ball);
  Sensed twin(mast(), world, sensors);
  twin.start();
  const auto edge = twin.bus.attach("listener");
  for (const TopicInfo& topic : twin.bus.topics()) edge->subscribe(topic.id);
  twin.bus.spin();
  twin.run(0.05);
  EXPECT_EQ(test::heap_touches_of([&] {
              for (int i = 0; i < 50; ++i) twin.step();
            }),
            0U);
}

}  // namespace
}  // namespace doppel
