// Publishers of a Twist on the network where the bus reads TwistStamped, on a network in memory.
#include <gmock/gmock.h>

#include "doppel/ros/messages/geometry_msgs.h"
#include "doppel/ros/network/test/bridge_testing.h"

namespace doppel::ros2 {
namespace {

using geometry_msgs::msg::Twist;
using geometry_msgs::msg::TwistStamped;
using ::testing::HasSubstr;

constexpr const char* kTwist = "geometry_msgs/msg/Twist";

// Its own bus, because that of BridgeTest does not convert.
class BridgeTwistsTest : public BridgeTest {
 protected:
  void up(TwistPolicy policy) {
    own.emplace(BusOptions{.twists = policy});
    base.emplace(*own, "/base");
    base->subscribe<TwistStamped>("~/cmd_vel", [this](const TwistStamped& m) { received.push_back(m); });
    over.emplace(*own, BridgeOptions{}, log,
                 [this](const auto&, auto on_activity) { return network.join(std::move(on_activity)); });
  }
  ~BridgeTwistsTest() override { over.reset(); }
  template <class Condition>
  bool happens(const Condition& condition) {
    return comes_true([&] {
      own->spin();
      return condition();
    });
  }
  [[nodiscard]] std::size_t advised() {
    const std::lock_guard lock(mutex);
    return static_cast<std::size_t>(std::ranges::count_if(
        said, [](const auto& text) { return text.find(" publishes ") != std::string::npos; }));
  }

  std::vector<TwistStamped> received;
  std::optional<Bus> own;
  std::optional<doppel::Node> base;
  std::optional<Bridge> over;
};

TEST_F(BridgeTwistsTest, TwistOfNetworkIsConvertedAndReportedOnce) {
  up(TwistPolicy::convert);
  own->set_now(time_from_seconds(7));
  const auto writer = peer->make_writer(topic_spec("/base/cmd_vel", kTwist));
  ASSERT_TRUE(happens([&] { return writer->matched() == 1; }));
  for (int i = 0; i < 3; ++i) writer->write(to_cdr(Twist{{0.5, 0, 0}, {}}));
  ASSERT_TRUE(happens([&] { return received.size() == 3; }));
  EXPECT_EQ(received[0].twist.linear.x, 0.5);
  EXPECT_EQ(received[0].header.stamp.sec, 7);
  EXPECT_TRUE(happens([&] { return advised() > 0; }));
  EXPECT_EQ(advised(), 1U);
  const std::lock_guard lock(mutex);
  EXPECT_THAT(said, ::testing::Contains(HasSubstr("set stamped:=true")));
}

TEST_F(BridgeTwistsTest, ReportNamesNodeThatIsAnnouncedLater) {
  up(TwistPolicy::convert);
  Graph graph(*peer);
  graph.set_own_nodes({{.name = "/other", .readers = {}, .writers = {}}});
  const auto writer = peer->make_writer(topic_spec("/base/cmd_vel", kTwist));
  ASSERT_TRUE(happens([&] { return writer->matched() == 1; }));
  EXPECT_EQ(advised(), 0U) << "expected no report without the node's name";
  graph.set_own_nodes({{.name = "/teleop_twist_keyboard", .readers = {}, .writers = {writer->gid()}}});
  ASSERT_TRUE(happens([&] { return advised() == 1; }));
  const std::lock_guard lock(mutex);
  EXPECT_THAT(said, ::testing::Contains(HasSubstr("/teleop_twist_keyboard (")));
}

TEST_F(BridgeTwistsTest, ReportDoesNotWaitForeverForName) {
  up(TwistPolicy::explain);
  Graph graph(*peer);
  graph.set_own_nodes({{.name = "/other", .readers = {}, .writers = {}}});
  const auto writer = peer->make_writer(topic_spec("/base/cmd_vel", kTwist));
  EXPECT_TRUE(happens([&] { return advised() == 1; }));
}

TEST_F(BridgeTwistsTest, StampedPublisherBesideItIsReceivedOnce) {
  up(TwistPolicy::convert);
  const auto plain = peer->make_writer(topic_spec("/base/cmd_vel", kTwist));
  const auto other = network.join([] {});
  const auto stamped = other->make_writer(topic_spec("/base/cmd_vel", "geometry_msgs/msg/TwistStamped"));
  ASSERT_TRUE(happens([&] { return plain->matched() == 1 && stamped->matched() == 1; }));
  stamped->write(to_cdr(TwistStamped{{}, {{2, 0, 0}, {}}}));
  plain->write(to_cdr(Twist{{1, 0, 0}, {}}));
  ASSERT_TRUE(happens([&] { return received.size() == 2; }));
  EXPECT_TRUE(happens([&] { return advised() > 0; }));
  EXPECT_EQ(advised(), 1U);
}

TEST_F(BridgeTwistsTest, ReaderEndsWithItsPublisher) {
  up(TwistPolicy::convert);
  auto writer = peer->make_writer(topic_spec("/base/cmd_vel", kTwist));
  ASSERT_TRUE(happens([&] { return writer->matched() == 1; }));
  const auto readers_of_twist = [&] {
    const auto all = endpoints("/base/cmd_vel");
    return std::ranges::count_if(
        all, [](const auto& info) { return !info.is_writer && info.type == dds_type(kTwist); });
  };
  EXPECT_EQ(readers_of_twist(), 1);
  writer.reset();
  EXPECT_TRUE(happens([&] { return readers_of_twist() == 0; }));
}

TEST_F(BridgeTwistsTest, StrictOnlyReports) {
  up(TwistPolicy::explain);
  const auto writer = peer->make_writer(topic_spec("/base/cmd_vel", kTwist));
  ASSERT_TRUE(happens([&] { return advised() == 1; }));
  EXPECT_EQ(writer->matched(), 0U);
  const std::lock_guard lock(mutex);
  EXPECT_THAT(said, ::testing::Contains(HasSubstr("its messages are refused, because of --strict")));
}

}  // namespace
}  // namespace doppel::ros2
