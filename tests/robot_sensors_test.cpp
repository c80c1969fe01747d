// Physical sensors of a robot's description in a twin: topics, rates, frames, and a loop that does not allocate.
#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "doppel/base/core/test/heap_touches.h"
#include "doppel/ros/messages/geometry_msgs.h"
#include "doppel/ros/messages/ros_gz_interfaces.h"
#include "doppel/ros/messages/sensor_msgs.h"
#include "twin_fixture.h"

namespace doppel::test {
namespace {

constexpr double kGravity = 9.81;
constexpr const char* kRobot = R"(<robot name="sensed">
  <link name="base_link"><inertial><mass value="1"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
  <link name="hand">
    <inertial><origin xyz="0 0 0.1"/><mass value="2"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>
    <collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision>
  </link>
  <joint name="wrist" type="fixed"><parent link="base_link"/><child link="hand"/><origin xyz="0 0 1"/></joint>
  <gazebo reference="hand">
    <sensor name="imu_sensor" type="imu">
      <pose>0 0 0.05 1.5707963267948966 0 0</pose><update_rate>50</update_rate><topic>imu/data</topic>
    </sensor>
    <sensor name="touch" type="contact"><update_rate>20</update_rate>
      <contact><collision>base_link_fixed_joint_lump__hand_collision</collision></contact>
    </sensor>
  </gazebo>
  <gazebo reference="wrist">
    <sensor name="wrist_ft" type="force_torque"><update_rate>100</update_rate></sensor>
  </gazebo>
</robot>)";

class RobotSensorsInTwin : public TwinFixture {
 protected:
  void SetUp() override {
    file_ = std::filesystem::path(::testing::TempDir()) / fmt::format("sensed_{}.urdf", getpid());
    std::ofstream(file_) << kRobot;
  }
  std::filesystem::path file_;
};

TEST_F(RobotSensorsInTwin, PublishOnTheirTopicsAtTheirRates) {
  bring_up(file_.string());
  for (const char* topic : {"/imu/data", "/wrist_ft", "/touch"}) listen(topic);
  run(0.1);
  received<sensor_msgs::msg::Imu>("/imu/data");
  run(1);
  const auto readings = received<sensor_msgs::msg::Imu>("/imu/data");
  ASSERT_EQ(readings.size(), 50U);
  EXPECT_EQ(readings.back().header.frame_id, "imu_sensor_frame");
  EXPECT_NEAR(readings.back().linear_acceleration.y, kGravity, 1e-6);
  run(1);
  const auto wrenches = received<geometry_msgs::msg::WrenchStamped>("/wrist_ft");
  ASSERT_EQ(wrenches.size(), 100U);
  EXPECT_NEAR(wrenches.back().wrench.force.z, -2 * kGravity, 1e-6);
  EXPECT_EQ(wrenches.back().header.frame_id, "hand");
  run(1);
  const auto touches = received<ros_gz_interfaces::msg::Contacts>("/touch");
  ASSERT_EQ(touches.size(), 20U);
  EXPECT_TRUE(touches.back().contacts.empty());
}

TEST_F(RobotSensorsInTwin, TopicsAndFramesHaveNamespaceOfRobot) {
  Scenario scenario;
  scenario.robots = {{.target = file_.string()}};
  scenario.robots[0].name_space = "left";
  bring_up(scenario);
  listen("/left/wrist_ft");
  run(0.1);
  const auto wrenches = received<geometry_msgs::msg::WrenchStamped>("/left/wrist_ft");
  ASSERT_EQ(wrenches.size(), 10U);
  EXPECT_EQ(wrenches.back().header.frame_id, "left/hand");
}

TEST_F(RobotSensorsInTwin, PublishersAreReliableAndVolatileWithDepthOfFive) {
  bring_up(file_.string());
  int found = 0;
  for (const TopicInfo& topic : twin_->bus().topics()) {
    if (topic.name != "/imu/data" && topic.name != "/wrist_ft" && topic.name != "/touch") continue;
    ++found;
    ASSERT_EQ(topic.publishers.size(), 1U);
    EXPECT_EQ(topic.publishers[0].qos, (Qos{.depth = 5}));
  }
  EXPECT_EQ(found, 3);
}

TEST_F(RobotSensorsInTwin, ContinueFromNewStartAfterReset) {
  bring_up(file_.string());
  listen("/wrist_ft");
  run(0.35);
  twin_->reset();
  received<geometry_msgs::msg::WrenchStamped>("/wrist_ft");
  run(0.1);
  const auto wrenches = received<geometry_msgs::msg::WrenchStamped>("/wrist_ft");
  ASSERT_EQ(wrenches.size(), 10U);
  EXPECT_EQ(wrenches.front().header.stamp.nanosec, 10'000'000U);
}

TEST_F(RobotSensorsInTwin, ListNamesSensorsByLinkOrJoint) {
  bring_up(file_.string());
  std::vector<std::string> names;
  for (const RigStatus& status : twin_->sensors()) names.push_back(status.sensor.name);
  EXPECT_EQ(names, (std::vector<std::string>{"sensed/hand/imu_sensor", "sensed/hand/touch",
                                             "sensed/wrist/wrist_ft"}));
}

TEST_F(RobotSensorsInTwin, ListHasOriginsOfSensorsInFramesOfTf) {
  Scenario scenario;
  scenario.robots = {{.target = file_.string()}};
  scenario.robots[0].name_space = "left";
  bring_up(scenario);
  const std::vector<RigStatus> list = twin_->sensors();
  ASSERT_EQ(list.size(), 3U);
  for (const RigStatus& status : list) {
    const doppel_msgs::msg::Sensor& sensor = status.sensor;
    EXPECT_EQ(sensor.origin_frame, "left/hand") << sensor.name;
    EXPECT_EQ(sensor.origin.x, 0) << sensor.name;
    EXPECT_EQ(sensor.origin.z, sensor.type == "imu" ? 0.05 : 0) << sensor.name;
  }
}

TEST_F(RobotSensorsInTwin, RevisionChangesWithValuesOfItsSensorOnly) {
  bring_up(file_.string());
  const auto revisions = [&] {
    std::vector<std::uint64_t> out;
    for (const RigStatus& status : twin_->sensors()) out.push_back(status.sensor.revision);
    return out;
  };
  const auto edit = [&](const std::string& from, const std::string& to) {
    std::string text = kRobot;
    text.replace(text.find(from), from.size(), to);
    std::ofstream(file_) << text;
    twin_->replace(Twin::prepare(twin_->running(), diagnostics_));
    twin_->between_steps();
    return revisions();
  };
  const auto first = revisions();
  ASSERT_EQ(first.size(), 3U);
  EXPECT_EQ(edit("<link name=\"hand\">", "<!-- lower\n -->\n<link name=\"hand\">"), first) << "only moved";
  const auto second = edit("<pose>0 0 0.05", "<pose>0 0 0.06");
  EXPECT_NE(second[0], first[0]);
  EXPECT_EQ(second[1], first[1]);
  EXPECT_EQ(second[2], first[2]);
  const auto third = edit("<pose>0 0 0.05", "<pose>0 0 0.05");
  EXPECT_NE(third[0], second[0]);
  EXPECT_NE(third[0], first[0]) << "a reader may not have seen the second";
}

TEST_F(RobotSensorsInTwin, LoopWithListenersDoesNotAllocate) {
  bring_up(file_.string());
  for (const TopicInfo& topic : twin_->bus().topics()) edge_->subscribe(topic.id);
  run(0.4);
  EXPECT_EQ(heap_touches_of([&] {
              for (int i = 0; i < 400; ++i) twin_->step();
            }),
            0U);
}

}  // namespace
}  // namespace doppel::test
