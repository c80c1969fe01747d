// Latched topics keep a message for each publisher; the network's edge is kept apart from the other edges.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

#include "doppel/ros/bus/bus.h"
#include "doppel/ros/messages/std_msgs.h"

namespace doppel {
namespace {

using std_msgs::msg::String;
using testing::ElementsAre;
using testing::IsEmpty;

TopicInfo topic_named(const Bus& bus, std::string_view name) {
  for (const TopicInfo& info : bus.topics()) {
    if (info.name == name) return info;
  }
  return {};
}

std::vector<std::string> texts_of(Edge& edge) {
  std::vector<std::string> texts;
  for (Edge::Incoming incoming; edge.next(incoming);) {
    String message;
    EXPECT_TRUE(from_cdr(incoming.cdr, message));
    texts.push_back(message.data);
  }
  return texts;
}

TEST(Edge, NetworkMessageOnTopicOfNodeReachesNodesAlone) {
  Bus bus;
  Node node(bus, "/robot_state_publisher");
  const auto publisher = node.advertise<String>("/robot_description", {.depth = 1, .latched = true});
  publisher.publish({"own"}, {});
  std::vector<std::string> read;
  node.subscribe<String>("/robot_description", [&](const String& m) { read.push_back(m.data); });
  const auto net = bus.attach("net", {.receives_own = false, .is_network = true}), page = bus.attach("page"),
             shell = bus.attach("shell");
  const TopicId id = topic_named(bus, "/robot_description").id;
  page->subscribe(id);
  bus.spin();
  Edge::Incoming first;
  ASSERT_TRUE(page->next(first));

  const auto from_network = [&](const char* name) {
    ASSERT_TRUE(net->publish("/remote", name, "std_msgs/msg/String", to_cdr(String{"of another robot"})));
    bus.spin();
  };
  from_network("/robot_description");
  EXPECT_THAT(read, ElementsAre("own", "of another robot"));
  EXPECT_THAT(texts_of(*page), IsEmpty());
  ASSERT_TRUE(shell->publish("/shell", "/robot_description", "std_msgs/msg/String", to_cdr(String{"typed"})));
  publisher.publish({"newer"}, {});
  bus.spin();
  Edge::Incoming second;
  ASSERT_TRUE(page->next(second));
  EXPECT_EQ(second.sequence, first.sequence + 1) << "expected no gap where the foreign message was";
  EXPECT_THAT(texts_of(*page), ElementsAre("typed"));

  node.subscribe<String>("/goal", [](const String&) {});
  page->subscribe(topic_named(bus, "/goal").id);
  bus.spin();
  from_network("/goal");
  EXPECT_THAT(texts_of(*page), ElementsAre("of another robot"));
}

TEST(Edge, LatchedTopicKeepsLastMessageOfEachPublisher) {
  Bus bus;
  auto left = std::make_unique<Node>(bus, "/left"), right = std::make_unique<Node>(bus, "/right");
  Node plain(bus, "/plain");
  const Qos latched{.depth = 1, .latched = true};
  const auto of_left = left->advertise<String>("/x", latched),
             of_right = right->advertise<String>("/x", latched);
  const auto of_plain = plain.advertise<String>("/x");
  of_left.publish({"left"}, {});
  of_right.publish({"right"}, {});
  of_plain.publish({"plain"}, {});
  const auto shell = bus.attach("shell"), page = bus.attach("page");
  ASSERT_TRUE(shell->advertise("/shell", "/x", "std_msgs/msg/String", latched));
  ASSERT_TRUE(shell->publish("/shell", "/x", "std_msgs/msg/String", to_cdr(String{"shell"})));
  bus.spin();
  const TopicId id = topic_named(bus, "/x").id;
  const auto kept = [&] {
    std::vector<std::string> texts;
    Node late(bus, "/late");
    late.subscribe<String>("/x", [&texts](const String& m) { texts.push_back(m.data); });
    page->subscribe(id);
    bus.spin();
    EXPECT_EQ(texts_of(*page), texts);
    page->unsubscribe(id);
    bus.spin();
    return texts;
  };
  EXPECT_THAT(kept(), ElementsAre("left", "right", "shell"));
  left.reset();
  shell->unadvertise("/shell", "/x");
  bus.spin();
  of_left.publish({"of a node that has gone"}, {});
  EXPECT_THAT(kept(), ElementsAre("right"));
  right.reset();
  EXPECT_FALSE(topic_named(bus, "/x").latched);
}

TEST(Edge, LatchedMessagesAreNumberedWithoutGap) {
  Bus bus;
  Node left(bus, "/left"), right(bus, "/right");
  const Qos latched{.depth = 1, .latched = true};
  const auto of_left = left.advertise<String>("/x", latched),
             of_right = right.advertise<String>("/x", latched);
  of_left.publish({"left"}, {});
  for (int i = 0; i < 5; ++i) of_right.publish({"right"}, {});
  const auto page = bus.attach("page");
  page->subscribe(topic_named(bus, "/x").id);
  bus.spin();
  of_left.publish({"newer"}, {});
  Edge::Incoming incoming;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> numbers;
  while (page->next(incoming)) numbers.emplace_back(incoming.sequence, incoming.latched);
  EXPECT_THAT(numbers, ElementsAre(std::pair(5U, 2U), std::pair(6U, 1U), std::pair(7U, 0U)));
}

}  // namespace
}  // namespace doppel
