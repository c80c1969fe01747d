// Messages that arrive faster than the loop handles them.

#include "doppel/ros/messages/controller_manager_msgs.h"
#include "doppel/ros/network/test/bridge_testing.h"

namespace doppel::ros2 {
namespace {

using controller_manager_msgs::srv::LoadController;
using std_msgs::msg::String;
class BridgeBacklogTest : public BridgeTest {};

TEST_F(BridgeBacklogTest, FloodWaitsInHistoryUntilLoopCatchesUp) {
  int received = 0;
  node.subscribe<Float64>("/in", [&](const Float64&) { ++received; }, {.depth = 100000});
  start();
  auto writer = peer->make_writer(topic_spec("/in", kFloat, {.depth = 100000}));
  while (writer->matched() == 0) std::this_thread::yield();
  for (int i = 0; i < 20000; ++i) writer->write(to_cdr(Float64{1}));
  std::this_thread::sleep_for(milliseconds(300));  // the loop is stopped
  EXPECT_LT(bridge->status().received, 10000U);
  EXPECT_TRUE(comes_true([&] { return received == 20000; }));
}

// Large messages count by their bytes: at most 64 MB wait for a loop that is stopped.
TEST_F(BridgeBacklogTest, LargeMessagesAndCallsWaitInHistories) {
  constexpr std::size_t kMax = 8, kAll = 12;
  const std::string large(std::size_t{8} << 20, 't');
  std::size_t received = 0, called = 0;
  node.subscribe<String>("/in", [&](const String&) { ++received; }, {.depth = 100});
  node.serve<LoadController>("~/load", [&](const auto&, const auto&) { ++called; });
  start();
  auto writer = peer->make_writer(topic_spec("/in", "std_msgs/msg/String", {.depth = 100}));
  ServiceClient client(*peer, {"/arm/load", "controller_manager_msgs/srv/LoadController", "", ""});
  ASSERT_TRUE(comes_true([&] { return writer->matched() > 0 && client.is_available(); }));
  for (std::size_t i = 0; i < kAll; ++i) {
    writer->write(to_cdr(String{large}));
    client.send(to_cdr(LoadController::Request{large}));
  }
  while (bridge->status().received < kMax || bridge->status().requests < kMax) std::this_thread::yield();
  // A client that finds its service shows that the bridge has finished a pass after these messages.
  const auto turn = bridge->make_client("/arm", "/arm/load", "controller_manager_msgs/srv/LoadController");
  while (!turn->is_available()) std::this_thread::yield();
  bus.spin();
  EXPECT_EQ(received, kMax);
  EXPECT_EQ(called, kMax);
  EXPECT_TRUE(comes_true([&] { return received == kAll && called == kAll; }))
      << "expected all; received " << received << " messages, " << called << " calls";
}

}  // namespace
}  // namespace doppel::ros2
