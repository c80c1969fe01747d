// Values of sensors for controllers, against those of the topics and closed forms.
#include "doppel/sensors/rigs/sensor_readings.h"

#include <cmath>

#include "doppel/base/core/test/heap_touches.h"
#include "doppel/ros/messages/sensor_msgs.h"
#include "physical_fixture.h"

namespace doppel {
namespace {

using sensor_msgs::msg::Imu;
using test::Sensed;
using test::vector_of;

constexpr double kUpAtRest = 9.81;

RobotDescription eccentric_table() {
  RobotDescription robot;
  robot.name = "table";
  robot.links = {test::make_frame("base"), test::make_link("disc", 2, {0.1, 0, 0}, {0.01, 0.01, 0.02})};
  robot.joints = {test::make_joint("turn", JointType::continuous, "base", "disc", {0, 0, 0.5}, {0, 0, 1})};
  return robot;
}

RigSensor imu_on_disc() {
  RigSensor sensor = test::make_rig_sensor("table", "disc", 1, "imu", 0);
  sensor.description.what = ImuDescription{};
  sensor.X_LF = sensor.description.X_LS = make_pose({0.3, 0, 0.1}, {0.2, 0, 0});
  return sensor;
}

RigSensor wrench_on_turn() {
  RigSensor sensor = test::make_rig_sensor("table", "disc", 1, "wrench", 0);
  sensor.description.joint = "turn";
  sensor.description.what = ForceTorqueDescription{};
  return sensor;
}

struct Read : Sensed {
  explicit Read(const std::vector<RigSensor>& sensors, std::uint64_t seed = 1)
      : Sensed(eccentric_table(), test::empty_space(), sensors),
        readings(sensors, RigOptions{seed, false}, EarthFrame{}, Duration{1'000'000}) {
    readings.bind(*world.engine);
  }
  void step_and_read() {
    readings.before_step(*world.engine);
    step();
    readings.read(*world.engine);
  }
  [[nodiscard]] Eigen::Vector3d vector(std::size_t sensor, std::size_t first) const {
    const auto v = readings.values(sensor);
    return {v[first], v[first + 1], v[first + 2]};
  }
  SensorReadings readings;
};

TEST(SensorReadings, ValuesOnTurntableEqualThoseOfTopics) {
  Read twin({imu_on_disc(), wrench_on_turn()});
  twin.world.set_state({0.2}, {7});
  twin.start();
  twin.readings.restart(*twin.world.engine);
  std::vector<Imu> topic;
  std::vector<geometry_msgs::msg::WrenchStamped> wrenches;
  twin.read("/imu", topic);
  twin.read("/wrench", wrenches);
  for (int i = 0; i < 20; ++i) {
    twin.world.robot.apply_joint_effort(twin.world.joint("turn"), 0.1 * i);
    twin.step_and_read();
    ASSERT_EQ(topic.size(), static_cast<std::size_t>(i + 1));
    EXPECT_EQ(twin.vector(0, 4), vector_of(topic.back().angular_velocity));
    EXPECT_EQ(twin.vector(0, 7), vector_of(topic.back().linear_acceleration));
    EXPECT_EQ(twin.readings.values(0)[2], topic.back().orientation.z);
    EXPECT_EQ(twin.vector(1, 0), vector_of(wrenches.back().wrench.force));
    EXPECT_EQ(twin.vector(1, 3), vector_of(wrenches.back().wrench.torque));
  }
  EXPECT_NEAR(wrenches.back().wrench.force.z, -2 * kUpAtRest, 1e-6);
}

TEST(SensorReadings, FirstReadingIsThatOfRest) {
  Read twin({imu_on_disc(), wrench_on_turn()});
  twin.readings.read(*twin.world.engine);
  EXPECT_NEAR(twin.vector(0, 7).norm(), kUpAtRest, 1e-9);
  EXPECT_NEAR(twin.vector(1, 0).z(), -2 * kUpAtRest, 1e-9);
}

TEST(SensorReadings, StateThatIsWrittenIsNoAcceleration) {
  Read twin({imu_on_disc()});
  twin.step_and_read();
  twin.world.set_state({1}, {5});
  twin.readings.state_written();
  twin.readings.read(*twin.world.engine);
  const Eigen::Vector3d expected(-25 * 0.3, kUpAtRest * std::sin(0.2), kUpAtRest * std::cos(0.2));
  EXPECT_LT((twin.vector(0, 7) - expected).norm(), 1e-9);
  EXPECT_NEAR(2 * std::acos(twin.readings.values(0)[3]), 1, 1e-9);  // still relative to the start
}

TEST(SensorReadings, NoiseIsThatOfInstantWhateverWasReadOrWrittenBefore) {
  RigSensor sensor = imu_on_disc();
  std::get<ImuDescription>(sensor.description.what).angular_velocity[2] = {0, 0.1, 0, 0, 0, 0.02, 10};
  const auto last = [&](bool disturbed) {
    Read twin({sensor});
    for (int i = 0; i < 20; ++i) {
      twin.readings.before_step(*twin.world.engine);
      twin.step();
      if (!disturbed || i == 19) twin.readings.read(*twin.world.engine);
      if (!disturbed || i % 3 != 0) continue;
      twin.world.set_state({0}, {0});
      for (int again = 0; again < i; ++again) {
        twin.readings.state_written();
        twin.readings.read(*twin.world.engine);
      }
    }
    return twin.readings.values(0)[6];
  };
  EXPECT_EQ(last(true), last(false));
}

TEST(SensorReadings, NoiseDependsOnSeedAndNumberAndStartsAgain) {
  RigSensor sensor = imu_on_disc();
  std::get<ImuDescription>(sensor.description.what).angular_velocity[2].stddev = 0.1;
  const auto series = [&](std::uint64_t seed) {
    Read twin({sensor}, seed);
    std::vector<double> out;
    for (int i = 0; i < 5; ++i) {
      twin.step_and_read();
      twin.readings.read(*twin.world.engine);  // the same instant: the same reading
      out.push_back(twin.readings.values(0)[6]);
    }
    twin.world.engine->reset();
    twin.readings.restart(*twin.world.engine);
    twin.step_and_read();
    EXPECT_EQ(twin.readings.values(0)[6], out[0]);
    return out;
  };
  const std::vector<double> one = series(1);
  EXPECT_EQ(one, series(1));
  EXPECT_NE(one, series(2));
  EXPECT_NE(one[0], one[1]);
}

TEST(SensorReadings, SensorOfAbsentInstanceReadsNaN) {
  RigSensor sensor = imu_on_disc();
  sensor.instance = "elsewhere";
  Read twin({sensor});
  twin.step_and_read();
  EXPECT_TRUE(std::isnan(twin.readings.values(0)[0]));
}

TEST(SensorReadings, ContinueInPlaceOfOthersWithTheirStart) {
  Read twin({imu_on_disc()});
  twin.world.set_state({0.5}, {0});
  twin.readings.restart(*twin.world.engine);
  twin.world.set_state({0.8}, {0});
  SensorReadings fresh({imu_on_disc()}, RigOptions{1, false}, EarthFrame{}, Duration{1'000'000});
  fresh.bind(*twin.world.engine);
  fresh.resume(twin.readings, twin.world.engine->time());
  fresh.read(*twin.world.engine);
  EXPECT_NEAR(2 * std::acos(fresh.values(0)[3]), 0.3, 1e-9);
}

TEST(SensorReadings, ReadingDoesNotAllocate) {
  Read twin({imu_on_disc(), wrench_on_turn()});
  twin.step_and_read();
  EXPECT_EQ(test::heap_touches_of([&] {
              for (int i = 0; i < 50; ++i) twin.step_and_read();
            }),
            0U);
}

}  // namespace
}  // namespace doppel
