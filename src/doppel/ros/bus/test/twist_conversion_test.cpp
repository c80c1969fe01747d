// A Twist where TwistStamped is read, and the reverse.
#include "doppel/ros/bus/twist_conversion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "doppel/ros/bus/bus.h"
#include "doppel/ros/messages/geometry_msgs.h"
#include "doppel/ros/messages/std_msgs.h"

namespace doppel {
namespace {

using geometry_msgs::msg::Twist;
using geometry_msgs::msg::TwistStamped;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr const char *kPlain = "geometry_msgs/msg/Twist", *kStamped = "geometry_msgs/msg/TwistStamped";

class TwistConversionTest : public ::testing::Test {
 protected:
  void start(TwistPolicy policy) {
    bus = std::make_unique<Bus>(
        BusOptions{.twists = policy, .advise = [this](const std::string& text) { advice.push_back(text); }});
    node = std::make_unique<Node>(*bus, "/base");
    node->subscribe<TwistStamped>("~/cmd_vel", [this](const TwistStamped& m) { stamped.push_back(m); });
    node->subscribe<Twist>("/plain", [this](const Twist& m) { plain.push_back(m); });
    edge = bus->attach("edge");
  }
  Status publish(const std::string& from, const std::string& topic, const char* type, const Bytes& cdr) {
    const Status status = edge->publish(from, topic, type, cdr);
    bus->spin();
    return status;
  }

  std::vector<std::string> advice;
  std::vector<TwistStamped> stamped;
  std::vector<Twist> plain;
  std::unique_ptr<Bus> bus;
  std::unique_ptr<Node> node;
  std::unique_ptr<Edge> edge;
};

TEST_F(TwistConversionTest, TwistIsStampedAndReportedOnceForEachPublisher) {
  start(TwistPolicy::convert);
  bus->set_now(time_from_seconds(2.5));
  const Bytes twist = to_cdr(Twist{{1, 0, 0}, {0, 0, 0.5}});
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(publish("/teleop", "/base/cmd_vel", kPlain, twist).ok());
  ASSERT_THAT(stamped, SizeIs(3));
  EXPECT_EQ(stamped[0].twist.linear.x, 1);
  EXPECT_EQ(stamped[0].twist.angular.z, 0.5);
  EXPECT_EQ(stamped[0].header.stamp.sec, 2);
  EXPECT_EQ(stamped[0].header.stamp.nanosec, 500'000'000U);
  ASSERT_THAT(advice, SizeIs(1));
  EXPECT_THAT(advice[0], HasSubstr("/teleop publishes geometry_msgs/msg/Twist on /base/cmd_vel, where "
                                   "geometry_msgs/msg/TwistStamped is read"));
  EXPECT_THAT(advice[0], HasSubstr("set stamped:=true"));
  ASSERT_TRUE(publish("/other", "/base/cmd_vel", kPlain, twist).ok());
  EXPECT_THAT(advice, SizeIs(2));
}

TEST_F(TwistConversionTest, StampIsLeftOutForReaderOfTwist) {
  start(TwistPolicy::convert);
  TwistStamped message;
  message.twist.linear.x = 3;
  ASSERT_TRUE(publish("/nav", "/plain", kStamped, to_cdr(message)).ok());
  ASSERT_THAT(plain, SizeIs(1));
  EXPECT_EQ(plain[0].linear.x, 3);
  ASSERT_THAT(advice, SizeIs(1));
  EXPECT_THAT(advice[0], HasSubstr("stamped:=false"));
}

TEST_F(TwistConversionTest, StrictRefusesWithSameExplanation) {
  start(TwistPolicy::explain);
  const Status status = publish("/teleop", "/base/cmd_vel", kPlain, to_cdr(Twist{}));
  EXPECT_THAT(status.why(), HasSubstr("its messages are refused, because of --strict"));
  EXPECT_THAT(status.why(), HasSubstr("stamped:=true"));
  EXPECT_THAT(stamped, IsEmpty());
  ASSERT_THAT(advice, SizeIs(1));
  EXPECT_EQ(advice[0], status.why());
}

TEST_F(TwistConversionTest, OtherTypesAndMalformedBytesAreRefused) {
  start(TwistPolicy::convert);
  EXPECT_THAT(publish("/x", "/base/cmd_vel", "std_msgs/msg/Float64", to_cdr(std_msgs::msg::Float64{1})).why(),
              HasSubstr("has type"));
  EXPECT_FALSE(publish("/x", "/base/cmd_vel", kPlain, to_cdr(std_msgs::msg::Float64{1})).ok());
  EXPECT_THAT(stamped, IsEmpty());
  EXPECT_THAT(advice, IsEmpty());
}

TEST_F(TwistConversionTest, TopicThatNobodyReadsKeepsItsType) {
  start(TwistPolicy::convert);
  node->advertise<TwistStamped>("~/cmd_vel_out");
  EXPECT_THAT(publish("/x", "/base/cmd_vel_out", kPlain, to_cdr(Twist{})).why(), HasSubstr("has type"));
}

TEST_F(TwistConversionTest, UserProgramsAreNotConverted) {
  start(BusOptions{}.twists);
  EXPECT_THAT(publish("/x", "/base/cmd_vel", kPlain, to_cdr(Twist{})).why(), HasSubstr("has type"));
}

}  // namespace
}  // namespace doppel
