// The server without its sockets, and the bus behind it, on one thread.
#include "doppel/ros/server/hub.h"

#include <gtest/gtest.h>

#include "doppel/ros/messages/std_msgs.h"

namespace doppel {
namespace {

struct CountingLink final : ClientLink {
  void send(OutgoingFrame frame) override { messages += frame.head_size > 0 ? 1 : 0; }
  [[nodiscard]] std::size_t unsent_assets() const override { return 0; }
  int messages = 0;
};

class HubTest : public testing::Test {
 protected:
  void step() {
    bus_.spin();
    for (const auto& task : std::exchange(tasks_, {})) task();
  }
  void subscribe(Hub::ClientId client) {
    hub_.on_text(client, R"({"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 1}]})");
  }

  Bus bus_;
  Node one_{bus_, "/one"}, two_{bus_, "/two"};
  std::vector<std::function<void()>> tasks_;
  Hub hub_{bus_, HubOptions{}, [this](std::function<void()> task) { tasks_.push_back(std::move(task)); }};
};

TEST_F(HubTest, LatchedMessagesThatBeginForOneClientAreWholeForNext) {
  const Qos latched{.depth = 1, .latched = true};
  const auto one = one_.advertise<std_msgs::msg::String>("/text", latched);
  const auto two = two_.advertise<std_msgs::msg::String>("/text", latched);
  one.publish({.data = "1"}, bus_.now());
  two.publish({.data = "2"}, bus_.now());
  step();
  CountingLink first_link, second_link;
  const Hub::ClientId first = hub_.join(first_link), second = hub_.join(second_link);
  subscribe(first);
  step();
  static_cast<void>(hub_.pump(1));
  ASSERT_EQ(first_link.messages, 1);
  subscribe(second);
  for (int i = 0; i < 10; ++i) {
    step();
    while (hub_.pump(100)) {
    }
    hub_.tick();
  }
  EXPECT_EQ(first_link.messages, 2);
  EXPECT_EQ(second_link.messages, 2);
}

}  // namespace
}  // namespace doppel
