// A Twist on the wire from Fast DDS, where the controller of a base reads TwistStamped, beside a stamped publisher.

#include <geometry_msgs.h>
#include <gtest/gtest.h>
#include <sensor_msgs.h>

#include <algorithm>
#include <cmath>

#include "fast_peer.h"
#include "twin_process.h"

namespace doppel::ros2_testing {
namespace {

using geometry_msgs::msg::dds_::Twist_;
using geometry_msgs::msg::dds_::TwistStamped_;
using sensor_msgs::msg::dds_::JointState_;

TEST(FastTwist, TwistAndTwistStampedBothDrive) {
  TwinProcess twin({"--robot", (source_folder() / "tests/ros2/rover/urdf/rover.urdf:rover@1,0,0").string()});
  FastPeer peer{own_domain()}, other{own_domain()};
  auto states = peer.subscribe<JointState_>("rt/rover/joint_states");
  auto plain = peer.advertise<Twist_>("rt/rover/base/cmd_vel");
  const auto reaches = [&](double velocity, const std::function<void()>& command) {
    return states
        .next([&](const JointState_& state) {
          command();
          return std::ranges::any_of(state.velocity_(),
                                     [&](double v) { return std::abs(v - velocity) < 0.5; });
        })
        .has_value();
  };
  Twist_ twist;
  twist.linear_().x_() = 0.5;
  EXPECT_TRUE(reaches(5, [&] { plain.publish(twist); })) << twin.output();
  auto stamped = other.advertise<TwistStamped_>("rt/rover/base/cmd_vel");
  TwistStamped_ message;  // with the stamp 0
  message.twist_().linear_().x_() = -0.3;
  EXPECT_TRUE(reaches(-3, [&] { stamped.publish(message); })) << twin.output();
  EXPECT_TRUE(eventually(
      [&] { return twin.output().find("publishes geometry_msgs/msg/Twist on") != std::string::npos; }));
  const std::string said = twin.output();
  const std::size_t first = said.find("publishes geometry_msgs/msg/Twist on");
  ASSERT_NE(first, std::string::npos) << said;
  EXPECT_EQ(said.find("publishes geometry_msgs/msg/Twist on", first + 1), std::string::npos) << said;
}

}  // namespace
}  // namespace doppel::ros2_testing
