// What a ROS 2 process on Cyclone DDS receives from the twin, and that the arm follows its commands.

#include "cyclone_peer.h"

#include <gtest/gtest.h>
#include <sensor_msgs.h>
#include <std_msgs.h>
#include <tf2_msgs.h>
#include <trajectory_msgs.h>

#include <cmath>
#include <cstring>
#include <set>

#include "twin_process.h"

namespace doppel::ros2_testing {
namespace {

using JointState = sensor_msgs_msg_dds__JointState_;
using TFMessage = tf2_msgs_msg_dds__TFMessage_;
using Text = std_msgs_msg_dds__String_;

class CyclonePeerTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { twin = new TwinProcess; }
  static void TearDownTestSuite() {
    delete twin;
    twin = nullptr;
  }
  void TearDown() override {
    if (HasFailure()) std::fputs(twin->output().c_str(), stderr);
  }
  static inline TwinProcess* twin = nullptr;
  CyclonePeer peer{own_domain()};
};

std::set<std::string> names_in(const TFMessage& tf) {
  std::set<std::string> names;
  for (std::uint32_t i = 0; i < tf.transforms_._length; ++i)
    names.insert(tf.transforms_._buffer[i].child_frame_id_);
  return names;
}

double position_of(const JointState& state, const char* joint) {
  for (std::uint32_t i = 0; i < state.name_._length; ++i)
    if (std::strcmp(state.name_._buffer[i], joint) == 0) return state.position_._buffer[i];
  return NAN;
}

TEST_F(CyclonePeerTest, JointStatesAreReceived) {
  auto states = peer.subscribe(CYCLONE_TYPE(sensor_msgs, msg, JointState), "rt/joint_states");
  std::int64_t first = -1;
  EXPECT_TRUE(states.next([&](const JointState& state) {
    EXPECT_EQ(state.name_._length, state.position_._length);
    EXPECT_EQ(state.name_._length, state.velocity_._length);
    EXPECT_TRUE(std::isfinite(position_of(state, "Revolute 6")));
    const auto& stamp = state.header_.stamp_;
    const std::int64_t time = stamp.sec_ * std::int64_t{1'000'000'000} + stamp.nanosec_;
    EXPECT_GE(time, first);
    if (first < 0) first = time;
    return time > first;
  })) << "expected two messages with increasing stamps";
}

TEST_F(CyclonePeerTest, TransformsAreReceived) {
  auto moving = peer.subscribe(CYCLONE_TYPE(tf2_msgs, msg, TFMessage), "rt/tf");
  EXPECT_TRUE(moving.next([](const TFMessage& tf) {
    for (std::uint32_t i = 0; i < tf.transforms_._length; ++i) {
      const auto& q = tf.transforms_._buffer[i].transform_.rotation_;
      EXPECT_NEAR(q.x_ * q.x_ + q.y_ * q.y_ + q.z_ * q.z_ + q.w_ * q.w_, 1, 1e-9);
    }
    return names_in(tf).contains("base_link_upper_1");
  }));
}

// Each peer here joins after the twin has published these once.
TEST_F(CyclonePeerTest, LateSubscriberReceivesLatched) {
  auto fixed = peer.subscribe(CYCLONE_TYPE(tf2_msgs, msg, TFMessage), "rt/tf_static", true);
  auto description = peer.subscribe(CYCLONE_TYPE(std_msgs, msg, String), "rt/robot_description", true);
  EXPECT_TRUE(fixed.next([](const TFMessage& tf) { return tf.transforms_._length > 0; }));
  EXPECT_TRUE(description.next([](const Text& urdf) {
    const std::string text = urdf.data_;
    EXPECT_NE(text.find("<robot"), std::string::npos);
    EXPECT_NE(text.find("</robot>"), std::string::npos)
        << "expected the whole description; received " << text.size() << " bytes";
    return true;
  }));
}

TEST_F(CyclonePeerTest, TrajectoryIsFollowed) {
  auto states = peer.subscribe(CYCLONE_TYPE(sensor_msgs, msg, JointState), "rt/joint_states");
  auto commands = peer.advertise(CYCLONE_TYPE(trajectory_msgs, msg, JointTrajectory),
                                 "rt/omarm_arm_controller/joint_trajectory");
  ASSERT_TRUE(eventually([&] { return commands.matched() > 0; }))
      << "expected the controller's subscription to match";

  const char* joints[] = {"Revolute 1", "Revolute 2", "Revolute 3", "Revolute 4", "Revolute 5", "Revolute 6"};
  double positions[] = {0.25, 0, 0, 0, 0, 0.5};
  trajectory_msgs_msg_dds__JointTrajectoryPoint_ point{};
  point.positions_ = {6, 6, positions, false};
  point.time_from_start_.nanosec_ = 500'000'000;
  trajectory_msgs_msg_dds__JointTrajectory_ trajectory{};
  char no_frame[] = "";
  trajectory.header_.frame_id_ = no_frame;
  trajectory.joint_names_ = {6, 6, const_cast<char**>(joints), false};
  trajectory.points_ = {1, 1, &point, false};
  // The controller reads commands with best effort, as in Jazzy: one sent before the twin has discovered this
  // peer is lost.
  int received = 0;
  EXPECT_TRUE(states.next([&](const JointState& state) {
    if (received++ % 100 == 0) commands.publish(trajectory);  // twice the duration of the trajectory
    return std::abs(position_of(state, "Revolute 1") - 0.25) < 0.01 &&
           std::abs(position_of(state, "Revolute 6") - 0.5) < 0.01;
  }));
}

}  // namespace
}  // namespace doppel::ros2_testing
