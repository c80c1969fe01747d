// Sensors in whole twins: those of a world's models, and those that a reload changes.
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>

#include "doppel/base/core/test/heap_touches.h"
#include "doppel/ros/messages/diagnostic_msgs.h"
#include "doppel/ros/messages/sensor_msgs.h"
#include "doppel/ros/messages/tf2_msgs.h"
#include "twin_fixture.h"

namespace doppel::test {
namespace {

class WorldSensors : public TwinFixture {
 protected:
  void bring_up_room() {
    Scenario scenario;
    scenario.world = DOPPEL_SOURCE_DIR "/worlds/sensors.sdf";
    scenario.sensors.lockstep = true;
    bring_up(scenario);
  }
  template <class M>
  M first(const std::string& topic) {
    listen(topic);
    run(0.3);
    const auto messages = received<M>(topic);
    if (messages.empty()) {
      ADD_FAILURE() << topic << " brought nothing";
      return {};
    }
    return messages.front();
  }
};

// -- the plan of worlds/sensors.sdf at the height of the lidar (0.4 m): distances along a ray from p in direction d
double to_rectangle(const Eigen::Vector2d& p, const Eigen::Vector2d& d, const Eigen::Vector2d& centre,
                    const Eigen::Vector2d& size) {
  double enter = -INFINITY, leave = INFINITY;
  for (int k = 0; k < 2; ++k) {
    const double a = (centre[k] - size[k] / 2 - p[k]) / d[k], b = (centre[k] + size[k] / 2 - p[k]) / d[k];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  if (enter > leave || leave < 0) return INFINITY;
  return enter > 0 ? enter : leave;  // from within: the walls of the room
}

double to_circle(const Eigen::Vector2d& p, const Eigen::Vector2d& d, const Eigen::Vector2d& centre,
                 double radius) {
  const double b = (p - centre).dot(d), c = (p - centre).squaredNorm() - radius * radius;
  return b * b < c || b > 0 ? INFINITY : -b - std::sqrt(b * b - c);
}

TEST_F(WorldSensors, ScanOfRoomFollowsItsPlan) {
  bring_up_room();
  const auto scan = first<sensor_msgs::msg::LaserScan>("/scan");
  ASSERT_EQ(scan.ranges.size(), 721U);
  const Eigen::Vector2d p(-1.88, 0);
  int on_column = 0, on_legs = 0, edges = 0;
  for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
    const double angle = scan.angle_min + static_cast<double>(i) * scan.angle_increment;
    const Eigen::Vector2d d(std::cos(angle), std::sin(angle));
    const double walls = to_rectangle(p, d, {0, 0}, {8, 6}), column = to_circle(p, d, {1.5, 1.8}, 0.3);
    double legs = INFINITY;
    for (const double x : {1.85, 2.55})
      for (const double y : {-0.95, 0.15}) legs = std::min(legs, to_rectangle(p, d, {x, y}, {0.05, 0.05}));
    double lines = INFINITY;  // on the east wall, 4 mm thick
    for (int k = -5; k <= 5; ++k)
      lines = std::min(lines, to_rectangle(p, d, {3.998, 0.5 * k}, {0.004, 0.02}));
    const double expected = std::min({walls, column, legs, lines});
    on_column += expected == column ? 1 : 0;
    on_legs += expected == legs ? 1 : 0;
    // A ray within the rounding of its direction of an edge may pass it on either side.
    if (std::abs(expected - scan.ranges[i]) > 0.003) {
      ++edges;
      continue;
    }
    if (expected == column) {  // a polygon, whose deviation along a grazing ray is larger than across
      const Eigen::Vector2d point = p + static_cast<double>(scan.ranges[i]) * d;
      EXPECT_NEAR((point - Eigen::Vector2d(1.5, 1.8)).norm(), 0.3, 1e-4) << "angle " << angle;
    } else {
      EXPECT_NEAR(scan.ranges[i], expected, 1e-5 * expected) << "angle " << angle;
    }
  }
  EXPECT_GT(on_column, 15);
  EXPECT_GT(on_legs, 3);
  EXPECT_LE(edges, 8) << "rays that touch an edge";
}

TEST_F(WorldSensors, FramesOfMovingModelFollowIt) {
  bring_up_room();
  listen("/tf");
  run(0.5);
  const auto messages = received<tf2_msgs::msg::TFMessage>("/tf");
  ASSERT_GE(messages.size(), 20U);
  double least = INFINITY, most = -INFINITY;
  for (const auto& message : messages)
    for (const auto& transform : message.transforms) {
      if (transform.child_frame_id != "pendulum/swing_imu_frame") continue;
      EXPECT_EQ(transform.header.frame_id, "world");
      const auto& p = transform.transform.translation;
      EXPECT_NEAR(std::hypot(p.x - 0.2, p.y + 0.9, p.z - 2.3), 1, 1e-6) << "1 m from the hinge";
      least = std::min(least, p.y);
      most = std::max(most, p.y);
    }
  EXPECT_GT(most - least, 0.2) << "it swings";
}

TEST_F(WorldSensors, EveryFrameOfTheirMessagesIsInTf) {
  bring_up_room();
  std::set<std::string> frames;
  listen("/tf_static");
  run(0.05);
  for (const auto& message : received<tf2_msgs::msg::TFMessage>("/tf_static"))
    for (const auto& transform : message.transforms) frames.insert(transform.child_frame_id);
  listen("/tf");
  run(0.05);
  for (const auto& message : received<tf2_msgs::msg::TFMessage>("/tf"))
    for (const auto& transform : message.transforms) frames.insert(transform.child_frame_id);
  for (const RigStatus& status : twin_->sensors()) {
    EXPECT_TRUE(status.sensor.frame == "world" || frames.contains(status.sensor.frame))
        << status.sensor.name << ": " << status.sensor.frame;
    EXPECT_TRUE(frames.contains(status.sensor.origin_frame))
        << status.sensor.name << ": " << status.sensor.origin_frame;
  }
}

TEST_F(WorldSensors, FramesOfWrenchesInAxesOfLinksAreInTf) {
  const auto file =
      std::filesystem::path(::testing::TempDir()) / ("wrenches_" + std::to_string(getpid()) + ".sdf");
  const auto sensor = [](const std::string& name, const std::string& frame) {
    return "<sensor name='" + name +
           "' type='force_torque'><pose>0.1 0 0 0 0 0.3</pose><force_torque><frame>" + frame +
           "</frame></force_torque></sensor>";
  };
  const std::string inertial =
      "<inertial><mass>1</mass><inertia><ixx>0.01</ixx><iyy>0.01</iyy><izz>0.01</izz></inertia></inertial>";
  std::ofstream(file)
      << "<sdf version='1.9'><world name='w'><model name='swing'><pose>0 0 2 0 0 0</pose><link name='post'>"
      << inertial << "</link><link name='bob'><pose>0 0 -0.5 0 0 0</pose>" << inertial
      << "</link><joint name='hold' type='fixed'><parent>world</parent><child>post</child></joint>"
         "<joint name='hinge' type='revolute'><parent>post</parent><child>bob</child><axis><xyz>0 1 "
         "0</xyz></axis>"
      << sensor("in_parent", "parent") << sensor("in_child", "child") << sensor("in_own", "sensor")
      << "</joint></model></world></sdf>";
  Scenario scenario;
  scenario.world = file;
  bring_up(scenario);
  listen("/tf");
  run(0.05);
  std::set<std::string> frames;
  for (const auto& message : received<tf2_msgs::msg::TFMessage>("/tf"))
    for (const auto& transform : message.transforms) frames.insert(transform.child_frame_id);
  std::set<std::string> named;
  for (const RigStatus& status : twin_->sensors()) {
    named.insert(status.sensor.frame);
    EXPECT_TRUE(frames.contains(status.sensor.frame)) << status.sensor.name << ": " << status.sensor.frame;
    EXPECT_TRUE(frames.contains(status.sensor.origin_frame)) << status.sensor.name;
  }
  EXPECT_EQ(named, (std::set<std::string>{"swing/post", "swing/bob", "swing/in_own_frame"}));
}

TEST_F(WorldSensors, LoopWithFramesOfMovingModelsDoesNotAllocate) {
  bring_up_room();
  for (const char* topic : {"/tf", "/swing_imu", "/swing_wrench", "/carton_contact", "/diagnostics"})
    listen(topic);
  run(0.4);
  EXPECT_EQ(heap_touches_of([&] {
              for (int i = 0; i < 1100; ++i) {
                twin_->between_steps();
                twin_->step();
              }
            }),
            0U);
}

TEST_F(WorldSensors, DiagnosticsWarnOfSamplesThatAreLeftOut) {
  Scenario scenario;  // the loop does not wait, and is much faster than the pictures
  scenario.world = DOPPEL_SOURCE_DIR "/worlds/sensors.sdf";
  bring_up(scenario);
  listen("/barrel/image_raw");
  run(2.5);
  listen("/diagnostics");
  run(3);
  int warned = 0;
  for (const auto& message : received<diagnostic_msgs::msg::DiagnosticArray>("/diagnostics"))
    for (const auto& status : message.status) {
      if (status.name == "doppel: sensor mast/mast/scan") {
        EXPECT_EQ(status.message, "is not read");
      }
      if (status.name != "doppel: sensor mast/mast/barrel" ||
          status.level == diagnostic_msgs::msg::DiagnosticStatus::OK)
        continue;
      const std::string since = " samples left out since the last message: too slow";
      EXPECT_NE(status.message.find(since), std::string::npos) << status.message;
      // Nobody has read the messages of the first seconds.
      if (++warned == 1) {
        EXPECT_EQ(status.message, status.values.at(3).value + since);
      }
    }
  EXPECT_GE(warned, 1);
}

TEST_F(WorldSensors, TopicOfTwoSensorsIsReported) {
  const auto file = std::filesystem::path(::testing::TempDir()) / "two_cameras.urdf";
  const auto write = [&](const std::string& more) {
    std::ofstream(file) << R"(<robot name="two"><link name="base_link"/><gazebo reference="base_link">
      <sensor name="left" type="camera"><topic>left</topic></sensor>
      <sensor name="right" type="camera"><topic>right</topic></sensor>)"
                        << more << "</gazebo></robot>";
  };
  write("");
  std::string said;
  log_.add_sink([&](const LogLine& line) { said += line.text + "\n"; });
  bring_up(file.string());
  EXPECT_NE(said.find("two/base_link/left, two/base_link/right publish on the same topic /camera_info"),
            std::string::npos)
      << said;
  const auto reload = [&](const std::string& more) {
    said.clear();
    write(more);
    Diagnostics found;
    twin_->replace(Twin::prepare(twin_->running(), found));
    twin_->between_steps();
    return said.find("publish on the same topic /camera_info") != std::string::npos;
  };
  EXPECT_FALSE(reload("<sensor name=\"imu\" type=\"imu\"/>")) << said;
  EXPECT_TRUE(reload("<sensor name=\"third\" type=\"camera\"><topic>third</topic></sensor>")) << said;
}

TEST_F(WorldSensors, EditTurnsSensorOfLightIntoPhysicalOneOnSameTopic) {
  const auto file =
      std::filesystem::path(::testing::TempDir()) / ("turned_" + std::to_string(getpid()) + ".urdf");
  const auto write = [&](const std::string& type) {
    std::ofstream(file) << R"(<robot name="turned"><link name="base_link"/><gazebo reference="base_link">
      <sensor name="s" type=")"
                        << type << R"("><topic>x</topic></sensor></gazebo></robot>)";
  };
  write("gpu_lidar");
  std::string errors;
  log_.add_sink([&](const LogLine& line) {
    if (line.severity == Severity::error) errors += line.text + "\n";
  });
  bring_up(file.string());
  for (const std::string type : {"imu", "gpu_lidar"}) {
    write(type);
    Diagnostics found;
    twin_->replace(Twin::prepare(twin_->running(), found));
    twin_->between_steps();
    ASSERT_EQ(twin_->sensors().size(), 1U) << errors;
    EXPECT_EQ(twin_->sensors()[0].sensor.type, type);
    EXPECT_EQ(errors, "");
  }
}

// S15.
TEST_F(WorldSensors, ReloadWithOtherFieldOfViewIsInNextFrame) {
  const auto file = std::filesystem::path(::testing::TempDir()) / "reloaded_camera.urdf";
  const auto write = [&](const char* hfov) {
    std::ofstream(file) << R"(<robot name="seeing"><link name="base_link"/><gazebo reference="base_link">
      <sensor name="camera" type="camera"><topic>camera/image</topic><update_rate>20</update_rate><camera>
        <horizontal_fov>)"
                        << hfov
                        << R"(</horizontal_fov><image><width>64</width><height>48</height></image></camera>
      </sensor></gazebo></robot>)";
  };
  write("1.0");
  Scenario scenario;
  scenario.robots = {{.target = file.string()}};
  scenario.sensors.lockstep = true;
  bring_up(scenario);
  const auto before = first<sensor_msgs::msg::CameraInfo>("/camera/camera_info");
  EXPECT_NEAR(before.k[0], 32 / std::tan(0.5), 1e-9);
  const auto topics_of = [&] {
    std::set<std::pair<std::string, TopicId>> out;
    for (const TopicInfo& topic : twin_->bus().topics())
      if (topic.name.starts_with("/camera/")) out.insert({topic.name, topic.id});
    return out;
  };
  const auto topics = topics_of();
  write("1.4");
  Diagnostics said;
  twin_->replace(Twin::prepare(twin_->running(), said));
  EXPECT_EQ(topics_of(), topics) << "as soon as the loop goes on";
  run(0.06);
  EXPECT_EQ(topics_of(), topics);
  const auto after = received<sensor_msgs::msg::CameraInfo>("/camera/camera_info");
  ASSERT_FALSE(after.empty()) << "the reader of before is still one";
  EXPECT_EQ(after.back().header.stamp.nanosec, 350'000'000U) << "the first frame after the reload";
  EXPECT_NEAR(after.back().k[0], 32 / std::tan(0.7), 1e-9);
}

}  // namespace
}  // namespace doppel::test
