// Nodes that are created beside those that they will replace.

#include "doppel/ros/bus/stage.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "doppel/ros/messages/std_msgs.h"
#include "doppel/ros/messages/std_srvs.h"

namespace doppel {
namespace {

using std_msgs::msg::Int32;
using std_msgs::msg::String;
using std_srvs::srv::Trigger;
using testing::ElementsAre;
using testing::IsEmpty;

// A node like a robot's: it publishes latched, subscribes and serves.
struct Part {
  Part(Bus& bus, const std::string& says) : node(bus, "/robot"), text(says) {
    state = node.advertise<String>("state", {.depth = 1, .latched = true});
    state.publish({says}, {});
    node.subscribe<Int32>("command", [this](const Int32& message) { received.push_back(message.data); });
    node.serve<Trigger>("who", [this](const auto&, auto respond) { respond({true, text}); });
  }
  Node node;
  std::string text;
  Publisher<String> state;
  std::vector<int> received;
};

std::string answer_of(Bus& bus, Edge& edge) {
  std::string out = "none";
  edge.call("/who", to_cdr(Trigger::Request{}), [&out](Status status, Bytes bytes) {
    Trigger::Response response;
    if (status && from_cdr(bytes, response)) out = response.message;
  });
  bus.spin();
  return out;
}

void command(Bus& bus, Edge& edge, int value) {
  const Int32 message{value};
  ASSERT_TRUE(edge.publish("/client", "/command", "std_msgs/msg/Int32", to_cdr(message)));
  bus.spin();
}

TEST(BusStage, FailureRestoresFormerNodes) {
  Bus bus;
  auto edge = bus.attach("test");
  Part former(bus, "former");
  const auto topics = bus.topics();
  {
    const BusStage stage(bus);
    EXPECT_THAT(bus.nodes(), IsEmpty());
    const Part next(bus, "next");
    EXPECT_THAT(bus.nodes(), ElementsAre("/robot"));
  }
  {
    const BusStage stage(bus);
    Node other(bus, "/other");
    other.advertise<Int32>("state");  // of another type than the old node's
  }
  EXPECT_THAT(bus.nodes(), ElementsAre("/robot"));
  ASSERT_EQ(bus.topics().size(), topics.size());
  for (std::size_t i = 0; i < topics.size(); ++i) {
    EXPECT_EQ(bus.topics()[i].name, topics[i].name);
    EXPECT_EQ(bus.topics()[i].id, topics[i].id);
    EXPECT_EQ(bus.topics()[i].type, topics[i].type);
    EXPECT_EQ(bus.topics()[i].publishers.size(), topics[i].publishers.size());
    EXPECT_EQ(bus.topics()[i].latched, topics[i].latched);
  }
  EXPECT_EQ(answer_of(bus, *edge), "former");
  command(bus, *edge, 7);
  EXPECT_THAT(former.received, ElementsAre(7));
}

TEST(BusStage, CommitReplacesFormerNodes) {
  Bus bus;
  auto edge = bus.attach("test");
  auto former = std::make_unique<Part>(bus, "former");
  Node world(bus, "/world");
  world.serve<Trigger>("reset", [](const auto&, auto respond) { respond({true, "world"}); });
  std::unique_ptr<Part> next;
  {
    BusStage stage(bus);
    next = std::make_unique<Part>(bus, "next");
    stage.commit();
  }
  EXPECT_EQ(answer_of(bus, *edge), "next");
  former.reset();
  EXPECT_EQ(answer_of(bus, *edge), "next");
  EXPECT_THAT(bus.nodes(), ElementsAre("/robot", "/world"));
  EXPECT_EQ(bus.services().size(), 2u);
  command(bus, *edge, 9);
  EXPECT_THAT(next->received, ElementsAre(9));
  // The latched message is that of the new node.
  std::string kept;
  Node late(bus, "/late");
  late.subscribe<String>("/state", [&kept](const String& message) { kept = message.data; });
  EXPECT_EQ(kept, "next");
}

TEST(BusStage, EdgeSubscriptionsSurvive) {
  Bus bus;
  auto edge = bus.attach("test");
  Part former(bus, "former");
  for (const TopicInfo& topic : bus.topics()) {
    if (topic.name == "/state") edge->subscribe(topic.id);
  }
  bus.spin();
  Edge::Incoming message;
  EXPECT_TRUE(edge->next(message));
  { const BusStage stage(bus); }
  former.state.publish({"again"}, {});
  EXPECT_TRUE(edge->next(message));
}

TEST(BusStage, OtherThreadsSeeFormerGraphUntilCommit) {
  Bus bus;
  auto edge = bus.attach("test");
  auto former = std::make_unique<Part>(bus, "former");
  std::unique_ptr<Part> next;
  std::string answer = "none";
  {
    BusStage stage(bus);
    std::thread([&] {
      EXPECT_THAT(bus.nodes(), ElementsAre("/robot"));
      EXPECT_EQ(bus.services().size(), 1U);
      EXPECT_EQ(bus.topics().size(), 2U);
      edge->call("/who", to_cdr(Trigger::Request{}), [&](const Status& status, const Bytes& bytes) {
        Trigger::Response response;
        answer = status && from_cdr(bytes, response) ? response.message : status.why();
      });
    }).join();
    next = std::make_unique<Part>(bus, "next");
    stage.commit();
  }
  former.reset();
  bus.spin();
  EXPECT_EQ(answer, "next");
}

TEST(NameRules, RulesOfOwnerAreRemovedWithIt) {
  NameRules rules;
  rules.add("a:=b");
  const int owner = 0;
  rules.add("c:=d", {&owner, "arm"});
  EXPECT_EQ(rules.resolve(NameKind::topic, "c", "/node"), "/d");
  rules.remove({&owner, "hand"});
  EXPECT_EQ(rules.resolve(NameKind::topic, "c", "/node"), "/d");
  rules.remove_all_of(&owner);
  EXPECT_EQ(rules.resolve(NameKind::topic, "c", "/node"), "/c");
  EXPECT_EQ(rules.resolve(NameKind::topic, "a", "/node"), "/b");
}

}  // namespace
}  // namespace doppel
