// IMUs on bodies at rest, falling and turning, against closed forms.
#include "doppel/sensors/rigs/physical_rig.h"

#include <cmath>
#include <map>

#include "doppel/ros/messages/sensor_msgs.h"
#include "physical_fixture.h"

namespace doppel {
namespace {

using sensor_msgs::msg::Imu;
using test::Sensed;
using test::vector_of;

constexpr double kGravity = 9.81;

RobotDescription turntable() {
  RobotDescription robot;
  robot.name = "table";
  robot.links = {test::make_frame("base"), test::make_link("disc", 2, {0, 0, 0}, {0.01, 0.01, 0.02})};
  robot.joints = {test::make_joint("turn", JointType::continuous, "base", "disc", {0, 0, 0.5}, {0, 0, 1})};
  return robot;
}

RobotDescription brick() {
  RobotDescription robot;
  robot.name = "brick";
  robot.links = {test::make_link("body", 2, {0, 0, 0}, {0.01, 0.02, 0.03})};
  return robot;
}

RigSensor imu_on(const std::string& instance, const std::string& link, int index, double rate = 100) {
  RigSensor sensor = test::make_rig_sensor(instance, link, index, "imu", rate);
  sensor.description.what = ImuDescription{};
  return sensor;
}

ImuDescription& described(RigSensor& sensor) {
  return std::get<ImuDescription>(sensor.description.what);
}

Eigen::Matrix3d rotation_of(const Imu& imu) {
  return Eigen::Quaterniond(imu.orientation.w, imu.orientation.x, imu.orientation.y, imu.orientation.z)
      .toRotationMatrix();
}

TEST(PhysicalRig, ImuAtRestReadsGravityUpwardsInItsOwnAxes) {
  RigSensor tilted = imu_on("table", "base", 0);
  tilted.description.name = "tilted";
  tilted.X_LF = tilted.description.X_LS = make_pose({0.1, 0, 0}, {M_PI / 2, 0, 0});
  Sensed twin(turntable(), test::empty_space(), {imu_on("table", "disc", 1), tilted});
  twin.start();
  std::vector<Imu> level, turned;
  twin.read("/imu", level);
  twin.read("/tilted", turned);
  twin.run(0.1);
  ASSERT_EQ(level.size(), 10U);
  ASSERT_EQ(turned.size(), 10U);
  EXPECT_LT((vector_of(level.back().linear_acceleration) - Eigen::Vector3d(0, 0, kGravity)).norm(), 1e-6);
  EXPECT_LT((vector_of(turned.back().linear_acceleration) - Eigen::Vector3d(0, kGravity, 0)).norm(), 1e-6);
  EXPECT_LT(vector_of(level.back().angular_velocity).norm(), 1e-9);
  EXPECT_EQ(level.back().header.frame_id, "disc");
}

TEST(PhysicalRig, ImuInFreeFallReadsNothing) {
  Sensed twin(brick(), test::empty_space(), {imu_on("brick", "body", 1)}, BaseKind::floating);
  twin.start();
  std::vector<Imu> readings;
  twin.read("/imu", readings);
  twin.run(1);
  ASSERT_EQ(readings.size(), 100U);
  for (const Imu& imu : readings) EXPECT_LT(vector_of(imu.linear_acceleration).norm(), 1e-9);
}

TEST(PhysicalRig, ImuOnTurntableReadsCentripetalAcceleration) {
  constexpr double kSpeed = 7, kRadius = 0.3;
  RigSensor sensor = imu_on("table", "disc", 1);
  sensor.X_LF = sensor.description.X_LS = make_pose({kRadius, 0, 0.1}, {0, 0, 0});
  Sensed twin(turntable(), test::empty_space(), {sensor});
  twin.world.set_state({0.2}, {kSpeed});
  twin.start();
  std::vector<Imu> readings;
  twin.read("/imu", readings);
  twin.run(0.5);
  ASSERT_EQ(readings.size(), 50U);
  const double expected = kSpeed * kSpeed * kRadius;
  for (const Imu& imu : readings) {
    EXPECT_NEAR(imu.linear_acceleration.x, -expected, 1e-3 * expected);
    EXPECT_NEAR(imu.linear_acceleration.y, 0, 1e-3 * expected);
    EXPECT_NEAR(imu.linear_acceleration.z, kGravity, 1e-6);
    EXPECT_NEAR(imu.angular_velocity.z, kSpeed, 1e-6);
  }
}

TEST(PhysicalRig, ImuOnAcceleratedDiscReadsTangentialAcceleration) {
  constexpr double kEffort = 0.1, kInertia = 0.02, kRadius = 0.4;
  RigSensor sensor = imu_on("table", "disc", 1, 0);
  sensor.X_LF = sensor.description.X_LS = make_pose({kRadius, 0, 0}, {0, 0, 0});
  Sensed twin(turntable(), test::empty_space(), {sensor});
  twin.start();
  std::vector<Imu> readings;
  twin.read("/imu", readings);
  twin.world.robot.apply_joint_effort(twin.world.joint("turn"), kEffort);
  twin.step();
  ASSERT_EQ(readings.size(), 1U);
  EXPECT_NEAR(readings[0].linear_acceleration.y, kEffort / kInertia * kRadius, 1e-6);
}

TEST(PhysicalRig, OrientationRefersToStartWorldOrNamedAxes) {
  constexpr double kSpeed = 1, kStart = 0.4;
  std::vector<RigSensor> sensors;
  for (const auto& [name, reference] : {std::pair{"start", OrientationReference::start},
                                        {"enu", OrientationReference::world_enu},
                                        {"ned", OrientationReference::ned},
                                        {"nwu", OrientationReference::nwu}}) {
    RigSensor& sensor = sensors.emplace_back(imu_on("table", "disc", 1));
    sensor.description.name = name;
    described(sensor).reference = reference;
  }
  Sensed twin(turntable(), test::empty_space(), sensors);
  twin.world.set_state({kStart}, {kSpeed});
  twin.start();
  std::vector<Imu> start, enu, ned, nwu;
  twin.read("/start", start);
  twin.read("/enu", enu);
  twin.read("/ned", ned);
  twin.read("/nwu", nwu);
  twin.run(0.3);
  ASSERT_EQ(start.size(), 30U);
  EXPECT_NEAR(rpy_from_rotation(rotation_of(start.back())).z(), 0.3 * kSpeed, 1e-6);
  EXPECT_NEAR(rpy_from_rotation(rotation_of(enu.back())).z(), kStart + 0.3 * kSpeed, 1e-6);
  const double heading = kStart + 0.3 * kSpeed;
  // x of the sensor: cos north of east. In north-east-down it has the components (sin, cos, 0), in north-west-up
  // (sin, -cos, 0).
  EXPECT_LT(
      (rotation_of(ned.back()).col(0) - Eigen::Vector3d(std::sin(heading), std::cos(heading), 0)).norm(),
      1e-6);
  EXPECT_LT(
      (rotation_of(nwu.back()).col(0) - Eigen::Vector3d(std::sin(heading), -std::cos(heading), 0)).norm(),
      1e-6);
  EXPECT_NEAR(rotation_of(ned.back())(2, 2), -1, 1e-9);
}

TEST(PhysicalRig, OrientationIsRelativeToNewStartAfterReset) {
  Sensed twin(turntable(), test::empty_space(), {imu_on("table", "disc", 1)});
  twin.world.set_state({0.0}, {1.0});
  twin.start();
  std::vector<Imu> readings;
  twin.read("/imu", readings);
  twin.run(0.2);
  twin.world.engine->reset();
  twin.world.set_state({0.7}, {0.0});
  twin.rig.reset(*twin.world.engine);
  readings.clear();
  twin.run(0.02);
  ASSERT_EQ(readings.size(), 2U);
  EXPECT_LT((rotation_of(readings[0]) - Eigen::Matrix3d::Identity()).norm(), 1e-9);
}

TEST(PhysicalRig, CovariancesAreVariancesAndOrientationOffIsMarked) {
  RigSensor sensor = imu_on("table", "disc", 1);
  described(sensor).linear_acceleration[1].stddev = 0.2;
  described(sensor).angular_velocity[2].stddev = 0.03;
  described(sensor).orientation_enabled = false;
  Sensed twin(turntable(), test::empty_space(), {sensor});
  twin.start();
  std::vector<Imu> readings;
  twin.read("/imu", readings);
  twin.run(0.01);
  ASSERT_EQ(readings.size(), 1U);
  EXPECT_DOUBLE_EQ(readings[0].linear_acceleration_covariance[4], 0.04);
  EXPECT_DOUBLE_EQ(readings[0].linear_acceleration_covariance[0], 0);
  EXPECT_DOUBLE_EQ(readings[0].angular_velocity_covariance[8], 9e-4);
  EXPECT_DOUBLE_EQ(readings[0].orientation_covariance[0], -1);
}

TEST(PhysicalRig, StateWrittenBetweenStepsIsNoAcceleration) {
  Sensed twin(turntable(), test::empty_space(), {imu_on("table", "disc", 1, 0)});
  twin.start();
  std::vector<Imu> readings;
  twin.read("/imu", readings);
  twin.run(0.01);
  twin.world.set_state({1.0}, {5.0});
  readings.clear();
  twin.step();
  ASSERT_EQ(readings.size(), 1U);
  EXPECT_LT((vector_of(readings[0].linear_acceleration) - Eigen::Vector3d(0, 0, kGravity)).norm(), 1e-6);
}

TEST(PhysicalRig, SamplesComeAtExactRateOnNearestSteps) {
  for (const double rate : {30.0, 60.0, 7.0, 0.0, 1500.0}) {
    Sensed twin(turntable(), test::empty_space(), {imu_on("table", "disc", 1, rate)});
    twin.start();
    std::vector<Imu> readings;
    twin.read("/imu", readings);
    twin.run(2);
    const double reached = rate == 0 || rate > 1000 ? 1000 : rate;
    ASSERT_EQ(readings.size(), static_cast<std::size_t>(2 * reached)) << rate;
    for (std::size_t i = 0; i < readings.size(); ++i)
      EXPECT_NEAR(to_seconds(test::time_of(readings[i].header)), static_cast<double>(i + 1) / reached,
                  0.5e-3 + 1e-9);
    EXPECT_EQ(twin.lines.size(), rate > 1000 ? 1U : 0U);
  }
}

std::vector<double> noise_of(std::uint64_t seed, bool reads_from_start) {
  RigSensor sensor = imu_on("table", "disc", 1);
  described(sensor).linear_acceleration[0] = {0, 0.1, 0, 0.05, 0, 0.02, 1};
  Sensed twin(turntable(), test::empty_space(), {sensor}, BaseKind::fixed, seed);
  twin.start();
  std::vector<Imu> readings;
  if (reads_from_start) twin.read("/imu", readings);
  twin.run(0.5);
  readings.clear();
  if (!reads_from_start) twin.read("/imu", readings);
  twin.run(0.5);
  std::vector<double> out;
  for (const Imu& imu : readings) out.push_back(imu.linear_acceleration.x);
  return out;
}

// The noise of an IMU's last sample after 5.01 s: its noise is `first`, and from 5 s on, by an edit, `second`.
double noise_after_edit(const NoiseDescription& first, const NoiseDescription& second,
                        bool reads_from_start) {
  RigSensor sensor = imu_on("table", "disc", 1);
  described(sensor).linear_acceleration[0] = first;
  Sensed twin(turntable(), test::empty_space(), {sensor}, BaseKind::fixed, 3);
  twin.start();
  std::vector<Imu> readings;
  if (reads_from_start) twin.read("/imu", readings);
  twin.run(5);
  described(sensor).linear_acceleration[0] = second;
  twin.rig.set_sensors({sensor}, *twin.world.engine);
  if (!reads_from_start) twin.read("/imu", readings);
  twin.run(0.01);
  return readings.empty() ? std::nan("") : readings.back().linear_acceleration.x;
}

TEST(PhysicalRig, WalkOfBiasContinuesThroughEditAndBeginsWhereEditAddsIt) {
  constexpr double kOneStep = 0.002;  // 0.02 sqrt(0.01 s)
  const NoiseDescription walk{0, 0, 0, 0, 0, 0.02, 1e6}, same_walk{0, 1e-12, 0, 0, 0, 0.02, 1e6};
  const double walked = noise_after_edit(walk, walk, true);
  EXPECT_GT(std::abs(walked), 6 * kOneStep);
  EXPECT_EQ(noise_after_edit(walk, walk, false), walked);
  EXPECT_NEAR(noise_after_edit(walk, same_walk, true), walked, 1e-10);
  const double begun = noise_after_edit({}, walk, true);
  EXPECT_NE(begun, 0);
  EXPECT_LT(std::abs(begun), 6 * kOneStep);
  EXPECT_EQ(begun, noise_after_edit({}, walk, false));
}

TEST(PhysicalRig, MessagesThatWaitAreSentThroughEditUnlessItChangesTheirSensor) {
  RigSensor sensor = imu_on("table", "disc", 1);
  sensor.description.latency = 0.025;
  for (const double latency : {0.025, 0.0, 0.1}) {
    Sensed twin(turntable(), test::empty_space(), {sensor});
    twin.start();
    std::vector<std::pair<Time, Time>> came;
    twin.reader.subscribe<Imu>("/imu", [&](const Imu& imu) {
      came.emplace_back(test::time_of(imu.header), twin.world.engine->time());
    });
    twin.bus.spin();
    twin.run(0.042);  // the samples of 20, 30 and 40 ms wait
    ASSERT_EQ(came.size(), 1U);
    RigSensor edited = sensor;
    edited.description.latency = latency;
    twin.rig.set_sensors({edited}, *twin.world.engine);
    twin.run(0.12);
    ASSERT_GE(came.size(), 2U);
    const bool same = latency == sensor.description.latency;
    EXPECT_EQ(came[1].first, time_from_nanoseconds((same ? 20 : 50) * 1'000'000)) << latency << " s";
    for (std::size_t i = 1; i < came.size(); ++i) {
      EXPECT_EQ(came[i].second, came[i].first + from_seconds(latency));
      EXPECT_EQ(came[i].first, came[1].first + Duration{10'000'000} * static_cast<int>(i - 1));
    }
  }
}

std::uint64_t hash_of(std::uint64_t seed) {
  RigSensor sensor = imu_on("table", "disc", 1);
  described(sensor).angular_velocity[1].stddev = 0.1;
  Sensed twin(turntable(), test::empty_space(), {sensor}, BaseKind::fixed, seed);
  twin.start();
  std::vector<Imu> readings;
  twin.read("/imu", readings);
  twin.run(0.2);
  return twin.rig.status().at(0).hash;
}

TEST(PhysicalRig, HashIsThatOfSeed) {
  EXPECT_EQ(hash_of(1), hash_of(1));
  EXPECT_NE(hash_of(1), hash_of(2));
}

TEST(PhysicalRig, NoiseDependsOnSeedAndNotOnReaders) {
  const std::vector<double> one = noise_of(1, true);
  ASSERT_EQ(one.size(), 50U);
  EXPECT_EQ(one, noise_of(1, false));
  EXPECT_NE(one, noise_of(2, true));
}

}  // namespace
}  // namespace doppel
