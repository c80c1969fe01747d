// Contact sensors on a plate on which a cube falls and from which it is taken.
#include <algorithm>

#include "doppel/base/core/test/heap_touches.h"
#include "doppel/ros/messages/gazebo_msgs.h"
#include "doppel/ros/messages/geometry_msgs.h"
#include "doppel/ros/messages/ros_gz_interfaces.h"
#include "doppel/ros/messages/sensor_msgs.h"
#include "physical_fixture.h"

namespace doppel {
namespace {

using gazebo_msgs::msg::ContactsState;
using ros_gz_interfaces::msg::Contacts;
using test::Sensed;

constexpr double kCubeWeight = 0.4 * 9.81;

// A body with a plate on a fixed joint, whose top is at z = 1.
RobotDescription table_with_plate() {
  RobotDescription robot;
  robot.name = "bench";
  robot.links = {test::make_frame("base_link"), test::make_link("plate", 1, {0, 0, 0}, {1e-2, 1e-2, 1e-2})};
  Collision box;
  box.geometry = Box{{1, 1, 0.1}};
  robot.links[1].collisions = {box};
  robot.joints = {test::make_joint("mount", JointType::fixed, "base_link", "plate", {0, 0, 0.95}, {0, 0, 1})};
  return robot;
}

World cube_above_plate(double height) {
  World world = test::empty_space();
  world.objects = {test::make_object("cube", Box{{0.1, 0.1, 0.1}}, {0.2, 0, 1.05 + height}, 0.4)};
  return world;
}

RigSensor contact_named(const std::string& collision, bool bumper = false) {
  RigSensor sensor = test::make_rig_sensor("bench", "plate", 1, "touch", 100);
  ContactDescription what;
  what.bumper = bumper;
  if (!collision.empty()) what.collisions = {collision};
  sensor.description.what = what;
  return sensor;
}

TEST(ContactOutput, TouchBeginsAndEndsWithEmptyMessage) {
  Sensed twin(table_with_plate(), cube_above_plate(0.05), {contact_named("plate_collision")});
  twin.start();
  std::vector<Contacts> messages;
  twin.read("/touch", messages);
  twin.run(0.05);
  ASSERT_EQ(messages.size(), 5U);
  for (const Contacts& message : messages) EXPECT_TRUE(message.contacts.empty());
  twin.run(1.95);
  ASSERT_EQ(messages.size(), 200U);
  ASSERT_EQ(messages.back().contacts.size(), 1U);
  const auto& contact = messages.back().contacts[0];
  EXPECT_EQ(contact.collision1.name, "bench::plate::plate_collision");
  EXPECT_EQ(contact.collision2.name, "cube::link::collision");
  EXPECT_EQ(messages.back().header.frame_id, "world");
  ASSERT_FALSE(contact.positions.empty());
  ASSERT_EQ(contact.wrenches.size(), contact.positions.size());
  ASSERT_EQ(contact.normals.size(), contact.positions.size());
  ASSERT_EQ(contact.depths.size(), contact.positions.size());
  double force = 0;
  for (std::size_t i = 0; i < contact.positions.size(); ++i) {
    force += contact.wrenches[i].body_1_wrench.force.z;
    EXPECT_NEAR(contact.positions[i].z, 1, 1e-3);
    EXPECT_NEAR(contact.normals[i].z, -1, 1e-6);
  }
  EXPECT_NEAR(force, -kCubeWeight, 1e-2 * kCubeWeight);
  twin.world.object("cube").place(make_pose({0, 0, 3}, {0, 0, 0}));
  messages.clear();
  twin.run(0.02);
  ASSERT_EQ(messages.size(), 2U);
  for (const Contacts& message : messages) EXPECT_TRUE(message.contacts.empty());
}

TEST(ContactOutput, CollisionsAreMeantByPlainAndLumpedNames) {
  for (const char* name : {"", "plate_collision", "base_link_fixed_joint_lump__plate_collision",
                           "base_link_fixed_joint_lump__plate_collision_1"}) {
    Sensed twin(table_with_plate(), cube_above_plate(0), {contact_named(name)});
    twin.start();
    std::vector<Contacts> messages;
    twin.read("/touch", messages);
    twin.run(0.3);
    ASSERT_EQ(messages.size(), 30U);
    EXPECT_EQ(messages.back().contacts.size(), 1U) << name;
    EXPECT_TRUE(twin.lines.empty()) << name;
  }
}

TEST(ContactOutput, UnknownCollisionIsReportedWithNearestName) {
  Sensed twin(table_with_plate(), cube_above_plate(0), {contact_named("plate_colision")});
  twin.start();
  ASSERT_EQ(twin.lines.size(), 1U);
  EXPECT_NE(twin.lines[0].find("plate_colision"), std::string::npos) << twin.lines[0];
  EXPECT_NE(twin.lines[0].find("did you mean 'plate_collision'"), std::string::npos) << twin.lines[0];
  twin.start();  // as after an edit of something else
  EXPECT_EQ(twin.lines.size(), 1U);
  twin.rig.set_sensors({contact_named("plate")}, *twin.world.engine);
  EXPECT_EQ(twin.lines.size(), 2U);
  twin.start();
  EXPECT_EQ(twin.lines.size(), 3U);
}

TEST(ContactOutput, BumperPublishesStatesWithTotalForceInNamedFrame) {
  RigSensor sensor = contact_named("", true);
  sensor.description.frame = "plate";
  Sensed twin(table_with_plate(), cube_above_plate(0), {sensor});
  twin.start();
  std::vector<ContactsState> messages;
  twin.read("/touch", messages);
  twin.run(1);
  ASSERT_EQ(messages.size(), 100U);
  EXPECT_EQ(messages.back().header.frame_id, "plate");
  ASSERT_EQ(messages.back().states.size(), 1U);
  const auto& state = messages.back().states[0];
  EXPECT_NEAR(state.total_wrench.force.z, -kCubeWeight, 1e-2 * kCubeWeight);
  ASSERT_FALSE(state.contact_positions.empty());
  EXPECT_NEAR(state.contact_positions[0].z, 0.05, 1e-3);
}

TEST(ContactOutput, LatencyDelaysMessagesAndKeepsStampsAndContents) {
  for (const bool bumper : {false, true}) {
    const auto run = [bumper](double latency) {
      RigSensor sensor = contact_named("", bumper);
      sensor.description.latency = latency;
      auto twin = std::make_unique<Sensed>(table_with_plate(), cube_above_plate(0.002), std::vector{sensor});
      twin->start();
      std::vector<Contacts> contacts;
      std::vector<ContactsState> states;
      if (bumper)
        twin->read("/touch", states);
      else
        twin->read("/touch", contacts);
      twin->run(0.2 + latency);
      return std::pair(contacts, states);
    };
    const auto direct = run(0), delayed = run(0.105);
    EXPECT_EQ(direct.first.size() + direct.second.size(), 20U);
    EXPECT_EQ(delayed.first.size(), direct.first.size());
    EXPECT_EQ(delayed.second.size(), direct.second.size());
    const auto same = [](const auto& a, const auto& b) { return to_cdr(a) == to_cdr(b); };
    EXPECT_TRUE(std::ranges::equal(direct.first, delayed.first, same));
    EXPECT_TRUE(std::ranges::equal(direct.second, delayed.second, same));
    EXPECT_TRUE(bumper ? !direct.second.back().states.empty() : !direct.first.back().contacts.empty());
  }
}

// Only the sensors' own work: physics, and readers of the fixture, are outside.
TEST(PhysicalRig, SamplesDoNotAllocate) {
  RigSensor imu = test::make_rig_sensor("bench", "plate", 1, "imu", 0);
  imu.description.what = ImuDescription{};
  RigSensor wrench = test::make_rig_sensor("bench", "plate", 1, "wrench", 0);
  wrench.description.what = ForceTorqueDescription{};
  RigSensor touch = contact_named("");
  touch.description.rate = 0;
  RigSensor late = touch;
  late.description.name = "late";
  late.description.latency = 0.01;
  Sensed twin(table_with_plate(), cube_above_plate(0), {imu, wrench, touch, late});
  twin.start();
  std::size_t messages = 0;
  const auto count = [&messages](const auto&) { ++messages; };
  twin.reader.subscribe<sensor_msgs::msg::Imu>("/imu", count);
  twin.reader.subscribe<geometry_msgs::msg::WrenchStamped>("/wrench", count);
  twin.reader.subscribe<Contacts>("/touch", count);
  twin.reader.subscribe<Contacts>("/late", count);
  twin.bus.spin();
  twin.run(0.1);  // the engine's own scratch, and until the delayed messages circulate
  messages = 0;
  const std::size_t touches = test::heap_touches_of([&] {
    for (int i = 0; i < 100; ++i) twin.step();
  });
  EXPECT_EQ(touches, 0U);
  EXPECT_EQ(messages, 400U);
}

}  // namespace
}  // namespace doppel
