// Sensors of a description as controllers read them: broadcasters in a twin, against the sensors' topics and closed forms.
#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "doppel/base/core/test/heap_touches.h"
#include "doppel/ros/messages/geometry_msgs.h"
#include "doppel/ros/messages/sensor_msgs.h"
#include "twin_fixture.h"

namespace doppel::test {
namespace {

constexpr double kWeight = 9.81;  // of the hand's kilogram, N
constexpr const char* kRobot = R"(<robot name="sensed">
  <link name="base_link"/>
  <link name="disc"><inertial><mass value="1"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
  <link name="hand"><inertial><mass value="1"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
  <joint name="turn" type="continuous"><parent link="base_link"/><child link="disc"/><axis xyz="0 0 1"/><origin xyz="0 0 1"/>
    <limit effort="100" velocity="20"/></joint>
  <joint name="wrist" type="fixed"><parent link="disc"/><child link="hand"/><origin xyz="0.3 0 0"/></joint>
  <gazebo reference="hand">
    <sensor name="imu" type="imu"><update_rate>100</update_rate><topic>imu/data</topic></sensor>
    <sensor name="field" type="magnetometer"><topic>field</topic></sensor>
    <sensor name="gps" type="navsat"><topic>fix</topic></sensor>
  </gazebo>
  <gazebo reference="wrist"><sensor name="ft" type="force_torque"><topic>wrist_ft</topic></sensor></gazebo>
  <ros2_control name="cell" type="system">
    <hardware><plugin>gz_ros2_control/GazeboSimSystem</plugin></hardware>
    <joint name="turn"><command_interface name="velocity"/><state_interface name="position"/><state_interface name="velocity"/></joint>
    <sensor name="imu">
      <state_interface name="orientation.x"/><state_interface name="orientation.y"/><state_interface name="orientation.z"/>
      <state_interface name="orientation.w"/>
      <state_interface name="angular_velocity.x"/><state_interface name="angular_velocity.y"/>
      <state_interface name="angular_velocity.z"/>
      <state_interface name="linear_acceleration.x"/><state_interface name="linear_acceleration.y"/>
      <state_interface name="linear_acceleration.z"/>
    </sensor>
    <sensor name="ft">
      <state_interface name="force.x"/><state_interface name="force.y"/><state_interface name="force.z"/>
      <state_interface name="torque.x"/><state_interface name="torque.y"/><state_interface name="torque.z"/>
    </sensor>
    <sensor name="hand_pose"><param name="frame_id">hand</param>
      <state_interface name="position.x"/><state_interface name="position.y"/><state_interface name="position.z"/>
      <state_interface name="orientation.x"/><state_interface name="orientation.y"/><state_interface name="orientation.z"/>
      <state_interface name="orientation.w"/>
    </sensor>
    NOISY
  </ros2_control>
</robot>)";
constexpr const char* kControllers = R"(
controller_manager:
  ros__parameters:
    update_rate: 500
    spin: {type: velocity_controllers/JointGroupVelocityController}
    imu_broadcaster: {type: imu_sensor_broadcaster/IMUSensorBroadcaster}
    ft_broadcaster: {type: force_torque_sensor_broadcaster/ForceTorqueSensorBroadcaster}
    hand: {type: pose_broadcaster/PoseBroadcaster}
spin: {ros__parameters: {joints: [turn]}}
imu_broadcaster: {ros__parameters: {sensor_name: imu, frame_id: hand}}
ft_broadcaster: {ros__parameters: {sensor_name: ft, frame_id: hand, offset: {force: {z: 0.81}}, multiplier: {force: {z: -2.0}}}}
hand: {ros__parameters: {pose_name: hand_pose, frame_id: world, tf: {enable: false}}}
)";

class ControllerSensors : public TwinFixture {
 protected:
  void SetUp() override {
    log_.add_sink([this](const LogLine& line) {
      if (line.severity == Severity::error) errors_ += line.text + "\n";
    });
  }
  void bring_up_sensed(std::string robot = kRobot, std::uint64_t seed = 1) {
    // Tests run beside each other, each in a process of its own.
    const auto folder = this->folder();
    std::filesystem::create_directories(folder);
    save(std::move(robot));
    std::ofstream(folder / "controlled.yaml") << kControllers;
    Scenario scenario;
    scenario.robots = {{.target = (folder / "controlled.urdf").string()}};
    scenario.robots[0].controllers = {folder / "controlled.yaml"};
    scenario.sensors.seed = seed;
    scenario.sensors.lockstep = lockstep_;
    bring_up(scenario);
  }
  [[nodiscard]] static std::filesystem::path folder() {
    return std::filesystem::path(::testing::TempDir()) / fmt::format("controlled_{}", getpid());
  }
  static void save(std::string robot) {
    if (const auto at = robot.find("NOISY"); at != std::string::npos) robot.erase(at, 5);
    std::ofstream(folder() / "controlled.urdf") << robot;
  }
  Twin::Reload reload(std::string robot) {
    save(std::move(robot));
    Diagnostics said;
    return twin_->replace(Twin::prepare(twin_->running(), said));
  }
  // kRobot with another text in the place of one that it has.
  static std::string edited(const std::string& from, const std::string& to, std::string robot = kRobot) {
    const std::size_t at = robot.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return robot.replace(at, from.size(), to);
  }
  [[nodiscard]] double state(const std::string& name) {
    return twin_->robot().controller_manager().state(name);
  }
  template <class M>
  M last(const std::string& topic) {
    const auto all = received<M>(topic);
    EXPECT_FALSE(all.empty()) << topic;
    return all.empty() ? M{} : all.back();
  }
  void spin(double speed) {
    publish("/spin/commands", "std_msgs/msg/Float64MultiArray", "{data: [" + std::to_string(speed) + "]}");
  }
  std::string errors_;
  bool lockstep_ = false;
};

TEST_F(ControllerSensors, ImuThroughBroadcasterAtRestAndOnTurntable) {
  bring_up_sensed();
  EXPECT_EQ(errors_, "");
  listen("/imu_broadcaster/imu");
  run(0.1);
  const auto resting = received<sensor_msgs::msg::Imu>("/imu_broadcaster/imu");
  ASSERT_EQ(resting.size(), 50U);
  EXPECT_NEAR(resting.front().linear_acceleration.z, kWeight, 1e-6);
  EXPECT_NEAR(resting.back().linear_acceleration.z, kWeight, 1e-6);
  EXPECT_EQ(resting.back().header.frame_id, "hand");
  constexpr double kSpeed = 2, kRadius = 0.3;
  spin(kSpeed);
  run(1);
  const auto turning = last<sensor_msgs::msg::Imu>("/imu_broadcaster/imu");
  EXPECT_NEAR(turning.linear_acceleration.x, -kSpeed * kSpeed * kRadius, 1e-3 * kSpeed * kSpeed * kRadius);
  EXPECT_NEAR(turning.angular_velocity.z, kSpeed, 1e-4);
}

TEST_F(ControllerSensors, ValuesEqualThoseOfTopicOfSameInstant) {
  bring_up_sensed();
  listen("/imu_broadcaster/imu");
  listen("/imu/data");
  spin(3);
  run(0.2);
  std::vector<sensor_msgs::msg::Imu> read, sampled;
  TopicId broadcast = 0;
  for (const TopicInfo& topic : twin_->bus().topics())
    if (topic.name == "/imu_broadcaster/imu") broadcast = topic.id;
  Edge::Incoming incoming;
  while (edge_->next(incoming))
    ASSERT_TRUE(from_cdr(incoming.cdr, (incoming.topic == broadcast ? read : sampled).emplace_back()).ok());
  std::size_t compared = 0;
  for (const auto& one : sampled) {
    for (const auto& other : read) {
      if (other.header.stamp.nanosec != one.header.stamp.nanosec) continue;
      ++compared;
      EXPECT_EQ(other.linear_acceleration.x, one.linear_acceleration.x);
      EXPECT_EQ(other.linear_acceleration.y, one.linear_acceleration.y);
      EXPECT_EQ(other.angular_velocity.z, one.angular_velocity.z);
      EXPECT_EQ(other.orientation.z, one.orientation.z);
    }
  }
  EXPECT_GE(compared, 18U);
}

TEST_F(ControllerSensors, WeightOfHandThroughOffsetAndMultiplier) {
  bring_up_sensed();
  listen("/ft_broadcaster/wrench");
  run(0.1);
  const auto wrench = last<geometry_msgs::msg::WrenchStamped>("/ft_broadcaster/wrench");
  EXPECT_NEAR(wrench.wrench.force.z, (-kWeight + 0.81) * -2, 1e-6);
  EXPECT_NEAR(wrench.wrench.force.x, 0, 1e-6);
}

TEST_F(ControllerSensors, PoseOfLinkThroughBroadcaster) {
  bring_up_sensed();
  listen("/hand/pose");
  spin(1);
  run(1);
  const auto pose = last<geometry_msgs::msg::PoseStamped>("/hand/pose").pose;
  // The twin is a step further, and a control period ahead of the last reading.
  const double angle = joint("turn").q;
  EXPECT_NEAR(pose.position.x, 0.3 * std::cos(angle), 2e-3);
  EXPECT_NEAR(pose.position.y, 0.3 * std::sin(angle), 2e-3);
  EXPECT_NEAR(std::hypot(pose.position.x, pose.position.y), 0.3, 1e-9);
  EXPECT_NEAR(pose.position.z, 1, 1e-9);
  EXPECT_NEAR(2 * std::atan2(pose.orientation.z, pose.orientation.w), angle, 5e-3);
}

TEST_F(ControllerSensors, TopicsOfEnvironmentAreListedAndPublished) {
  bring_up_sensed();
  for (const Diagnostic& said : diagnostics_.all()) EXPECT_NE(said.rule, "sensor.type") << said.str();
  listen("/fix");
  listen("/field");
  run(0.05);
  const auto fix = last<sensor_msgs::msg::NavSatFix>("/fix");
  EXPECT_NEAR(fix.longitude, 0.3 / 6378138 * 180 / M_PI, 1e-9);
  EXPECT_NEAR(fix.altitude, 1, 1e-6);
  std::vector<std::string> names;
  for (const RigStatus& status : twin_->sensors()) names.push_back(status.sensor.name);
  EXPECT_EQ(names, (std::vector<std::string>{"sensed/hand/imu", "sensed/hand/field", "sensed/hand/gps",
                                             "sensed/wrist/ft"}));
}

TEST_F(ControllerSensors, UnboundSensorReadsNaNAndIsErrorOnce) {
  std::string robot = kRobot;
  robot.replace(robot.find("NOISY"), 5,
                R"(<sensor name="lost"><state_interface name="orientation.w"/></sensor>)");
  bring_up_sensed(robot);
  EXPECT_NE(errors_.find("'lost' of <ros2_control> reads NaN"), std::string::npos) << errors_;
  EXPECT_EQ(errors_.find("reads NaN"), errors_.rfind("reads NaN"));
  run(0.01);
  EXPECT_TRUE(std::isnan(twin_->robot().controller_manager().state("lost/orientation.w")));
}

TEST_F(ControllerSensors, ValueUnboundByEditReadsWhatFirstStartOfEditedFileReads) {
  const std::string written =
      edited("NOISY", R"(<sensor name="height"><state_interface name="vertical_reference">
        <param name="initial_value">7.5</param></state_interface><state_interface name="vertical_velocity"/></sensor>)");
  const std::string sensed =
      edited("<sensor name=\"field\"", "<sensor name=\"height\" type=\"altimeter\"/><sensor name=\"field\"",
             written);
  bring_up_sensed(sensed);
  run(0.01);
  EXPECT_NEAR(state("height/vertical_reference"), 1, 1e-9);
  EXPECT_EQ(reload(written), Twin::Reload::controllers_kept);
  run(0.01);
  const double reference = state("height/vertical_reference"), velocity = state("height/vertical_velocity");
  bring_up_sensed(written);
  run(0.01);
  EXPECT_EQ(state("height/vertical_reference"), 7.5);
  EXPECT_TRUE(std::isnan(state("height/vertical_velocity")));
  EXPECT_EQ(reference, 7.5);
  EXPECT_TRUE(std::isnan(velocity));
}

TEST_F(ControllerSensors, UnboundSensorIsLoggedAgainOnlyWhenEditChangesWhy) {
  const auto lost = [](const std::string& name, const std::string& interface) {
    return "<sensor name=\"" + name + "\"><state_interface name=\"" + interface + "\"/></sensor>";
  };
  const std::string one = edited("NOISY", lost("lost", "orientation.w"));
  bring_up_sensed(one);
  EXPECT_FALSE(errors_.empty());
  errors_.clear();
  reload(one);
  // On another line, by an edit with which the controllers continue.
  EXPECT_EQ(reload(edited("<link name=\"base_link\"/>", "\n\n<link name=\"base_link\"/>", one)),
            Twin::Reload::controllers_kept);
  EXPECT_EQ(errors_, "");
  EXPECT_EQ(
      reload(edited("NOISY", lost("lost", "orientation.w") + "<sensor name=\"gone\">"
                                                             "<state_interface name=\"force.x\"/></sensor>")),
      Twin::Reload::controllers_recreated);
  EXPECT_EQ(errors_.find("'lost'"), std::string::npos) << errors_;
  EXPECT_NE(errors_.find("'gone'"), std::string::npos) << errors_;
  errors_.clear();
  reload(kRobot);
  EXPECT_EQ(errors_, "");
  reload(one);
  EXPECT_NE(errors_.find("'lost'"), std::string::npos) << errors_;
}

// What the controllers and the topic of one IMU say: angles from the start about z, and their noise.
TEST_F(ControllerSensors, WrittenStateKeepsReferenceAndNoiseAndResetRenewsThem) {
  const std::string noisy = edited(
      "<update_rate>100</update_rate>",
      "<update_rate>100</update_rate><imu><angular_velocity><z><noise type='gaussian'><stddev>0.1</stddev>"
      "</noise></z></angular_velocity></imu>");
  struct Seen {
    double angle = 0, read_angle = 0, noise = 0, read_noise = 0;
  };
  const auto angle_of = [](const sensor_msgs::msg::Imu& imu) {
    return 2 * std::atan2(imu.orientation.z, imu.orientation.w);
  };
  const auto see = [&] {
    Seen out;
    listen("/imu/data");
    run(0.02);
    const auto topic = last<sensor_msgs::msg::Imu>("/imu/data");
    out.angle = angle_of(topic);
    out.noise = topic.angular_velocity.z - joint("turn").v;
    out.read_angle = 2 * std::atan2(state("imu/orientation.z"), state("imu/orientation.w"));
    out.read_noise = state("imu/angular_velocity.z") - joint("turn").v;
    return out;
  };
  const auto after = [&](const std::vector<std::string>& calls) {
    bring_up_sensed(noisy);
    run(0.1);
    for (const std::string& yaml : calls) call("/gazebo/set_state", "doppel_msgs/srv/SetState", yaml);
    return see();
  };
  const std::string turned = "{names: [turn], positions: [0.5]}";
  const Seen still = after({}), once = after({turned}), often = after({"{}", turned, turned, turned});
  EXPECT_NEAR(once.angle, 0.5, 1e-3);
  EXPECT_NEAR(once.read_angle, 0.5, 1e-3);
  EXPECT_NE(still.noise, 0);
  EXPECT_NE(still.read_noise, 0);
  for (const Seen& one : {once, often}) {
    EXPECT_NEAR(one.noise, still.noise, 1e-6);
    EXPECT_NEAR(one.read_noise, still.read_noise, 1e-6);
  }
  twin_->reset();
  run(0.1);
  const Seen reset = see();
  EXPECT_NEAR(reset.angle, 0, 1e-3);
  EXPECT_NEAR(reset.read_angle, 0, 1e-3);
  EXPECT_NEAR(reset.noise, still.noise, 1e-6);
  EXPECT_NEAR(reset.read_noise, still.read_noise, 1e-6);
}

TEST_F(ControllerSensors, EditThatRecreatesControllersKeepsReferenceAndNoise) {
  const std::string noisy = edited(
      "<update_rate>100</update_rate>",
      "<update_rate>100</update_rate><imu><angular_velocity><z><noise type='gaussian'><stddev>0.1</stddev>"
      "</noise></z></angular_velocity></imu>");
  const auto noise_after = [&](const std::string& edit) {
    bring_up_sensed(noisy);
    run(0.1);
    call("/gazebo/set_state", "doppel_msgs/srv/SetState", "{names: [turn], positions: [0.5]}");
    run(0.02);
    if (!edit.empty()) {
      EXPECT_EQ(reload(edit), Twin::Reload::controllers_recreated);
    }
    run(0.02);
    EXPECT_NEAR(2 * std::atan2(state("imu/orientation.z"), state("imu/orientation.w")), 0.5, 1e-3);
    return state("imu/angular_velocity.z") - joint("turn").v;
  };
  const double undisturbed = noise_after("");
  EXPECT_NE(undisturbed, 0);
  EXPECT_NEAR(
      noise_after(edited("NOISY", R"(<sensor name="gone"><state_interface name="x"/></sensor>)", noisy)),
      undisturbed, 1e-6);
}

TEST_F(ControllerSensors, NoiseOfReadSensorsEntersHashOfState) {
  std::string noisy = kRobot;
  noisy.replace(
      noisy.find("<update_rate>100</update_rate>"), 30,
      "<update_rate>100</update_rate><imu><angular_velocity><z><noise type='gaussian'><stddev>0.1</stddev>"
      "</noise></z></angular_velocity></imu>");
  const auto hash_of = [&](const std::string& robot, std::uint64_t seed) {
    bring_up_sensed(robot, seed);
    run(0.1);
    return twin_->state_hash();
  };
  EXPECT_EQ(hash_of(kRobot, 1), hash_of(kRobot, 2));
  EXPECT_EQ(hash_of(noisy, 1), hash_of(noisy, 1));
  EXPECT_NE(hash_of(noisy, 1), hash_of(noisy, 2));
}

// A sonar that faces a wall in 2 m.
constexpr const char* kSonar =
    R"(<link name="wall"><visual><geometry><box size="0.1 4 4"/></geometry></visual></link>
  <joint name="stands" type="fixed"><parent link="base_link"/><child link="wall"/><origin xyz="2.35 0 1"/></joint>
  <gazebo reference="hand"><sensor name="front" type="ray"><update_rate>10</update_rate>
    <ray><scan><horizontal><samples>1</samples><min_angle>0</min_angle><max_angle>0</max_angle></horizontal></scan>
      <range><min>0.02</min><max>4</max></range>
      <noise><type>gaussian</type><stddev>0.01</stddev></noise></ray>
    <plugin name="front_plugin" filename="libgazebo_ros_ray_sensor.so"><output_type>sensor_msgs/Range</output_type>
      <ros><remapping>~/out:=front</remapping></ros></plugin></sensor></gazebo>
  <ros2_control name="cell")";

TEST_F(ControllerSensors, RangeIsThatOfLastSampleAndMeasuredForControllersAlone) {
  const std::string robot =
      edited("<ros2_control name=\"cell\"", kSonar,
             edited("NOISY", R"(<sensor name="front"><state_interface name="range"/></sensor>)"));
  lockstep_ = true;
  const auto hash_of = [&](std::uint64_t seed) {
    bring_up_sensed(robot, seed);
    EXPECT_EQ(errors_, "");
    run(0.098);
    EXPECT_TRUE(std::isnan(state("front/range")));
    run(0.102);
    EXPECT_NEAR(state("front/range"), 2, 0.05);
    EXPECT_NE(state("front/range"), 2);
    return twin_->state_hash();
  };
  EXPECT_EQ(hash_of(1), hash_of(1));
  EXPECT_NE(hash_of(1), hash_of(2));
  listen("/front");
  run(0.12);
  EXPECT_EQ(static_cast<float>(state("front/range")), last<sensor_msgs::msg::Range>("/front").range);
  twin_->reset();
  run(0.05);
  EXPECT_TRUE(std::isnan(state("front/range")));
  lockstep_ = false;  // when a sample is finished depends on the machine
  const auto free_hash = [&](std::uint64_t seed) {
    bring_up_sensed(robot, seed);
    run(0.2);
    return twin_->state_hash();
  };
  EXPECT_EQ(free_hash(1), free_hash(2));
}

TEST_F(ControllerSensors, LoopWithBroadcastersDoesNotAllocate) {
  bring_up_sensed();
  for (const TopicInfo& topic : twin_->bus().topics()) edge_->subscribe(topic.id);
  run(0.4);
  EXPECT_EQ(heap_touches_of([&] {
              for (int i = 0; i < 400; ++i) twin_->step();
            }),
            0U);
}

}  // namespace
}  // namespace doppel::test
