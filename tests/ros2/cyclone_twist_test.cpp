// A Twist on the wire from Cyclone DDS, where the controller of a base reads TwistStamped: it drives, and the twin
// reports what to set.

#include <geometry_msgs.h>
#include <gtest/gtest.h>
#include <sensor_msgs.h>

#include <algorithm>

#include "cyclone_peer.h"
#include "twin_process.h"

namespace doppel::ros2_testing {
namespace {

using JointState = sensor_msgs_msg_dds__JointState_;

std::string rover() {
  return (source_folder() / "tests/ros2/rover/urdf/rover.urdf:rover@1,0,0").string();
}

double fastest(const JointState& state) {
  double most = 0;
  for (std::uint32_t i = 0; i < state.velocity_._length; ++i)
    most = std::max(most, state.velocity_._buffer[i]);
  return most;
}

TEST(CycloneTwist, TwistDrivesBaseAndIsReported) {
  TwinProcess twin({"--robot", rover()});
  CyclonePeer peer{own_domain()};
  auto states = peer.subscribe(CYCLONE_TYPE(sensor_msgs, msg, JointState), "rt/rover/joint_states");
  auto commands = peer.advertise(CYCLONE_TYPE(geometry_msgs, msg, Twist), "rt/rover/base/cmd_vel");
  ASSERT_TRUE(eventually([&] { return commands.matched() > 0; })) << twin.output();
  geometry_msgs_msg_dds__Twist_ twist{};
  twist.linear_.x_ = 0.5;
  EXPECT_TRUE(states.next([&](const JointState& state) {
    commands.publish(twist);
    return fastest(state) > 4.5;  // 0.5 m/s on wheels of 0.1 m
  })) << twin.output();
  EXPECT_TRUE(eventually([&] {
    return twin.output().find("publishes geometry_msgs/msg/Twist on /rover/base/cmd_vel") !=
           std::string::npos;
  })) << twin.output();
  EXPECT_NE(twin.output().find("stamped:=true"), std::string::npos) << twin.output();
}

TEST(CycloneTwist, StrictTwinOnlyReports) {
  TwinProcess twin({"--robot", rover(), "--strict"});
  CyclonePeer peer{own_domain()};
  auto commands = peer.advertise(CYCLONE_TYPE(geometry_msgs, msg, Twist), "rt/rover/base/cmd_vel");
  EXPECT_TRUE(eventually([&] { return twin.output().find("because of --strict") != std::string::npos; }))
      << twin.output();
  EXPECT_EQ(commands.matched(), 0);
}

}  // namespace
}  // namespace doppel::ros2_testing
