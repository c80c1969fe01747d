// Topics and services between nodes and edges, in one thread.

#include "doppel/ros/bus/bus.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>

#include <thread>

#include "doppel/ros/messages/sensor_msgs.h"
#include "doppel/ros/messages/std_srvs.h"

namespace doppel {
namespace {

using std::chrono::milliseconds;
using std_msgs::msg::Float64;
using std_msgs::msg::Int32;
using std_msgs::msg::String;
using std_srvs::srv::SetBool;
using std_srvs::srv::Trigger;
using testing::ElementsAre;
using testing::Field;
using testing::HasSubstr;
using testing::IsEmpty;

TopicInfo topic(const Bus& bus, std::string_view name) {
  for (const TopicInfo& info : bus.topics()) {
    if (info.name == name) return info;
  }
  return {};
}

std::vector<std::string> names(const std::vector<EndpointInfo>& endpoints) {
  std::vector<std::string> result;
  for (const EndpointInfo& endpoint : endpoints) result.push_back(endpoint.node);
  return result;
}

bool is_readable(const Edge& edge) {
  pollfd poll_fd{edge.readable_fd(), POLLIN, 0};
  return poll(&poll_fd, 1, 0) == 1;
}

template <class M>
std::vector<M> take_all(Edge& edge, TopicId id) {
  std::vector<M> messages;
  Edge::Incoming incoming;
  while (edge.next(incoming)) {
    EXPECT_EQ(incoming.topic, id);
    const Status status = from_cdr(incoming.cdr, messages.emplace_back());
    EXPECT_TRUE(status) << status.why();
  }
  return messages;
}

struct Answer {
  int count = 0;
  Status status;
  Bytes bytes;
  std::function<void(Status, Bytes)> receiver() {
    return [this](Status s, Bytes b) {
      ++count;
      status = std::move(s);
      bytes = std::move(b);
    };
  }
};

TEST(Bus, RequestsBeyondEdgeShareWaitInOrder) {
  Bus bus;
  const auto edge = bus.attach("/edge");
  int served = 0;
  bool own = false, ordered = true;
  for (int i = 0; i < 100; ++i) {
    edge->post([&, i] {
      ordered = ordered && served++ == i;
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    });
  }
  bus.post([&own] { own = true; });
  bus.set_edge_share(0.01);
  bus.spin();
  EXPECT_TRUE(own);
  EXPECT_LT(served, 100);
  bus.set_edge_share(0);
  bus.spin();
  EXPECT_EQ(served, 100);
  EXPECT_TRUE(ordered);
}

TEST(Bus, TopicsThatNothingUsesAreFreed) {
  Bus bus;
  const auto edge = bus.attach("/edge");
  const auto publish = [&] {
    EXPECT_TRUE(edge->publish("/client", "/mine", "std_msgs/msg/Float64", to_cdr(Float64{1})));
    bus.spin();
    return topic(bus, "/mine").id;
  };
  const TopicId first = publish();
  EXPECT_EQ(publish(), first);
  edge->unadvertise("/client", "/mine");
  bus.spin();
  EXPECT_EQ(topic(bus, "/mine").id, 0u);
  const TopicId second = publish();
  EXPECT_NE(second, first) << "expected a new topic, because the former one was freed";
  edge->subscribe(second);
  edge->unadvertise("/client", "/mine");
  bus.spin();
  EXPECT_EQ(topic(bus, "/mine").id, second) << "expected a subscriber to keep the topic";
  edge->unsubscribe(second);
  bus.spin();
  EXPECT_EQ(topic(bus, "/mine").id, 0u);
}

TEST(Bus, TopicOfPublisherThatOutlivesItsNodeIsKept) {
  Bus bus;
  const auto edge = bus.attach("/edge");
  Publisher<Float64> late;
  TopicId id = 0;
  {
    Node node(bus, "/a");
    late = node.advertise<Float64>("~/value");
    id = topic(bus, "/a/value").id;
  }
  EXPECT_EQ(topic(bus, "/a/value").id, 0u);
  edge->subscribe(id);
  bus.spin();
  late.publish({3}, time_from_nanoseconds(0));
  EXPECT_EQ(take_all<Float64>(*edge, id).size(), 1u);
  late = {};
  edge->unsubscribe(id);
  bus.spin();
  Node again(bus, "/a");
  again.advertise<Float64>("~/value");
  EXPECT_NE(topic(bus, "/a/value").id, id);
}

TEST(Bus, ResolvesNamesAndListsGraph) {
  Bus bus;
  Node a(bus, "/a"), b(bus, "/b");
  a.advertise<String>("~/own");
  a.advertise<String>("plain");
  b.subscribe<String>("/a/own", [](const String&) {});
  EXPECT_THAT(names(topic(bus, "/a/own").publishers), ElementsAre("/a"));
  EXPECT_THAT(names(topic(bus, "/a/own").subscribers), ElementsAre("/b"));
  EXPECT_EQ(topic(bus, "/plain").type, "std_msgs/msg/String");
  EXPECT_THAT(bus.nodes(), ElementsAre("/a", "/b"));
}

TEST(Bus, PublishCallsSubscribersImmediately) {
  Bus bus;
  Node node(bus, "/n");
  const auto publisher = node.advertise<Float64>("x");
  EXPECT_FALSE(publisher.has_listeners());
  double received = 0;
  node.subscribe<Float64>("x", [&](const Float64& m) { received = m.data; });
  EXPECT_TRUE(publisher.has_listeners());
  publisher.publish({2.5}, {});
  EXPECT_EQ(received, 2.5);
}

TEST(Bus, TopicOfAnotherTypeIsRefused) {
  Bus bus;
  Node a(bus, "/a"), b(bus, "/b");
  a.advertise<Float64>("x");
  try {
    b.subscribe<String>("x", [](const String&) {});
    FAIL() << "expected an error: the topic has another type";
  } catch (const std::logic_error& e) {
    EXPECT_THAT(e.what(), HasSubstr("/x has type std_msgs/msg/Float64 in node /a"));
  }
  EXPECT_THROW(Node(bus, "no_slash"), std::logic_error);
}

TEST(Bus, NodeDestructionRemovesItsEndpoints) {
  Bus bus;
  const auto before = bus.graph_version();
  {
    Node node(bus, "/n");
    node.advertise<Float64>("x");
    node.subscribe<Float64>("y", [](const Float64&) {});
    node.serve<Trigger>("~/go", [](const auto&, const auto&) {});
    EXPECT_EQ(bus.graph_version(), before + 4);
    EXPECT_EQ(bus.services().at(0).node, "/n");
  }
  EXPECT_THAT(bus.topics(), IsEmpty());
  EXPECT_THAT(bus.services(), IsEmpty());
  EXPECT_THAT(bus.nodes(), IsEmpty());
  EXPECT_EQ(bus.graph_version(), before + 8);
  Node other(bus, "/o");
  EXPECT_NO_THROW(other.advertise<String>("x")) << "expected the name to be free for another type";
}

TEST(Bus, ThrowingSubscriberIsReportedOnceAndOthersAreCalled) {
  std::vector<std::string> reports;
  Bus bus({.report = [&reports](const std::string& problem) { reports.push_back(problem); }});
  Node node(bus, "/node");
  int received = 0;
  const auto throws = [](const Int32& message) {
    if (message.data == 1) throw std::runtime_error("no such thing");
    throw 42;  // NOLINT: no std::exception
  };
  node.subscribe<Int32>("/number", throws);
  node.subscribe<Int32>("/number", [&received](const Int32&) { ++received; });
  auto publisher = node.advertise<Int32>("/number");
  for (int i = 1; i <= 3; ++i) publisher.publish(Int32{i}, Time{});
  EXPECT_EQ(received, 3);
  EXPECT_THAT(reports, ElementsAre(testing::AllOf(HasSubstr("/number"), HasSubstr("no such thing"))));
}

TEST(Bus, CallbackCanDestroyItsNodeAndSubscribe) {
  Bus bus;
  Node source(bus, "/source");
  const auto publisher = source.advertise<Int32>("x");
  auto node = std::make_unique<Node>(bus, "/n");
  int received = 0;
  node->subscribe<Int32>("x", [&](const Int32&) {
    ++received;
    source.subscribe<Int32>("x", [&received](const Int32&) { received += 100; });
    node.reset();
  });
  publisher.publish({1}, {});
  EXPECT_EQ(received % 100, 1);
  received = 0;
  publisher.publish({1}, {});
  EXPECT_EQ(received, 100);
}

TEST(Edge, SubscriptionReceivesMessages) {
  Bus bus;
  Node node(bus, "/n");
  const auto publisher = node.advertise<Int32>("x");
  const auto edge = bus.attach("edge");
  const TopicId id = topic(bus, "/x").id;
  edge->subscribe(id);
  publisher.publish({1}, {});  // not yet: the subscription takes effect at the next step
  bus.spin();
  EXPECT_THAT(names(topic(bus, "/x").subscribers), ElementsAre("edge"));
  publisher.publish({2}, Time(milliseconds(7)));
  EXPECT_TRUE(is_readable(*edge));
  Edge::Incoming incoming;
  ASSERT_TRUE(edge->next(incoming));
  EXPECT_EQ(incoming.stamp, Time(milliseconds(7)));
  EXPECT_FALSE(edge->next(incoming));
  EXPECT_FALSE(is_readable(*edge)) << "expected next() to drain the descriptor";
  edge->unsubscribe(id);
  bus.spin();
  EXPECT_FALSE(publisher.has_listeners());
}

TEST(Edge, EncodedMessageIsSharedByEdgesAndReadByNodes) {
  Bus bus;
  Node node(bus, "/camera"), reader(bus, "/reader");
  const auto out = node.advertise<String>("/text");
  std::string read;
  reader.subscribe<String>("/text", [&read](const String& message) { read = message.data; });
  const auto a = bus.attach("a"), b = bus.attach("b");
  const TopicId id = topic(bus, "/text").id;
  a->subscribe(id);
  b->subscribe(id);
  bus.spin();
  const auto cdr = std::make_shared<const Bytes>(to_cdr(String{"a picture"}));
  out.publish_encoded(cdr, time_from_nanoseconds(5));
  EXPECT_EQ(read, "a picture");
  EXPECT_EQ(cdr.use_count(), 3);
  Edge::Incoming incoming;
  ASSERT_TRUE(a->next(incoming));
  EXPECT_EQ(incoming.cdr.data(), cdr->data());
  EXPECT_EQ(incoming.stamp, time_from_nanoseconds(5));
  EXPECT_EQ(take_all<String>(*b, id).front().data, "a picture");
  EXPECT_FALSE(a->next(incoming));
  EXPECT_EQ(cdr.use_count(), 1);
}

TEST(Edge, SlowEdgeSharesNoMoreBytesThanItsRingHas) {
  const auto cdr = std::make_shared<const Bytes>(to_cdr(String{std::string(1000, 'x')}));
  {
    Bus bus;
    Node node(bus, "/camera");
    const auto out = node.advertise<String>("/text");
    const auto slow = bus.attach("slow", {.ring_bytes = 4096});
    slow->subscribe(topic(bus, "/text").id);
    bus.spin();
    for (int i = 0; i < 100; ++i) out.publish_encoded(cdr, time_from_nanoseconds(i));
    EXPECT_EQ(cdr.use_count(), 1 + 4);
    EXPECT_EQ(bus.skipped(), 96U);
    EXPECT_EQ(take_all<String>(*slow, topic(bus, "/text").id).size(), 4U);
    out.publish_encoded(cdr, time_from_nanoseconds(200));
  }
  EXPECT_EQ(cdr.use_count(), 1);
}

TEST(Edge, LatchedTopicReachesLateSubscriber) {
  Bus bus;
  Node node(bus, "/n");
  const auto publisher = node.advertise<String>("x", {.depth = 1, .latched = true});
  publisher.publish({"first, and longer"}, {});
  publisher.publish({"last"}, {});
  const auto edge = bus.attach("edge");
  edge->subscribe(topic(bus, "/x").id);
  bus.spin();
  const auto messages = take_all<String>(*edge, topic(bus, "/x").id);
  ASSERT_EQ(messages.size(), 1U);
  EXPECT_EQ(messages[0].data, "last");
  std::string received;
  node.subscribe<String>("x", [&](const String& m) { received = m.data; });
  EXPECT_EQ(received, "last");
}

TEST(Edge, LatchedMessageIsRetriedWhenRingWasFull) {
  Bus bus;
  Node node(bus, "/n");
  const auto stream = node.advertise<String>("stream");
  const auto latched = node.advertise<String>("x", {.depth = 1, .latched = true});
  latched.publish({std::string(500, 'l')}, {});
  const auto edge = bus.attach("edge", {.ring_bytes = 1024});
  edge->subscribe(topic(bus, "/stream").id);
  bus.spin();
  stream.publish({std::string(700, 's')}, {});
  edge->subscribe(topic(bus, "/x").id);
  bus.spin();
  Edge::Incoming incoming;
  ASSERT_TRUE(edge->next(incoming));
  EXPECT_EQ(incoming.topic, topic(bus, "/stream").id);
  EXPECT_FALSE(edge->next(incoming));
  bus.spin();
  ASSERT_TRUE(edge->next(incoming));
  EXPECT_EQ(incoming.topic, topic(bus, "/x").id);
}

TEST(Edge, SlowEdgeCountsLostMessages) {
  Bus bus;
  Node node(bus, "/n");
  const auto publisher = node.advertise<String>("x");
  const auto edge = bus.attach("edge", {.ring_bytes = 1024});
  edge->subscribe(topic(bus, "/x").id);
  bus.spin();
  for (int i = 0; i < 100; ++i) publisher.publish({std::string(100, 'x')}, {});
  const auto got = take_all<String>(*edge, topic(bus, "/x").id).size();
  EXPECT_GT(got, 3U);
  EXPECT_EQ(got + edge->dropped(), 100U);
}

TEST(Edge, PublishReachesNodesAndEdges) {
  Bus bus;
  bus.set_now(Time(milliseconds(5)));
  Node node(bus, "/n");
  double received = 0;
  node.subscribe<Float64>("x", [&](const Float64& m) { received = m.data; });
  const auto one = bus.attach("one"), two = bus.attach("two");
  two->subscribe(topic(bus, "/x").id);
  bus.spin();
  ASSERT_TRUE(one->publish("/cli", "/x", "std_msgs/Float64", to_cdr(Float64{4})));
  EXPECT_EQ(received, 0) << "expected no callback outside of the loop";
  bus.spin();
  EXPECT_EQ(received, 4);
  EXPECT_THAT(names(topic(bus, "/x").publishers), ElementsAre("/cli"));
  EXPECT_EQ(topic(bus, "/x").received, 1U);
  const auto got = take_all<Float64>(*two, topic(bus, "/x").id);
  ASSERT_EQ(got.size(), 1U);
  EXPECT_EQ(got[0].data, 4);
}

TEST(Bus, TopicInfoListsEndpointsWithQos) {
  Bus bus;
  Node node(bus, "/n"), part(bus, "/n"), other(bus, "/m");
  node.advertise<Float64>("x", {.depth = 3, .best_effort = true});
  part.advertise<Float64>("x", {.depth = 7});
  other.subscribe<Float64>(
      "x", [](const Float64&) {}, Qos::sensor_data());
  const auto edge = bus.attach("edge");
  edge->subscribe(topic(bus, "/x").id);
  ASSERT_TRUE(edge->publish("/cli", "/x", "std_msgs/msg/Float64", to_cdr(Float64{1})));
  bus.spin();
  const TopicInfo x = topic(bus, "/x");
  ASSERT_THAT(names(x.publishers), ElementsAre("/n", "/cli"))
      << "expected a node of several parts to be listed once";
  EXPECT_EQ(x.publishers[0].qos, (Qos{.depth = 3, .best_effort = true}));
  EXPECT_EQ(x.publishers[0].edge, "");
  EXPECT_EQ(x.publishers[1].edge, "edge");
  ASSERT_THAT(names(x.subscribers), ElementsAre("/m", "edge"));
  EXPECT_EQ(x.subscribers[0].qos, (Qos{.depth = 5, .best_effort = true}));
  EXPECT_EQ(x.subscribers[1].edge, "edge");
}

TEST(Bus, SecondPublisherIsReported) {
  Bus bus;
  Node one(bus, "/one");
  std::optional<Node> two(std::in_place, bus, "/two");
  one.advertise<Float64>("/x");
  std::uint64_t version = bus.graph_version();
  const auto has_grown = [&] { return std::exchange(version, bus.graph_version()) < version; };
  two->subscribe<Float64>("/x", [](const Float64&) {});
  EXPECT_TRUE(has_grown());
  one.subscribe<Float64>("/x", [](const Float64&) {});
  EXPECT_TRUE(has_grown());
  two.reset();
  EXPECT_TRUE(has_grown());
}

TEST(Edge, WithoutOwnMessagesReceivesAllOthers) {
  Bus bus;
  Node node(bus, "/n");
  const auto publisher = node.advertise<Float64>("x", {.depth = 1, .latched = true});
  const auto net = bus.attach("net", {.receives_own = false}), page = bus.attach("page");
  const TopicId id = topic(bus, "/x").id;
  for (const auto* edge : {&net, &page}) (*edge)->subscribe(id);
  bus.spin();
  ASSERT_TRUE(net->publish("/remote", "/x", "std_msgs/msg/Float64", to_cdr(Float64{1})));
  ASSERT_TRUE(page->publish("/page", "/x", "std_msgs/msg/Float64", to_cdr(Float64{2})));
  bus.spin();
  publisher.publish({3}, {});
  EXPECT_THAT(take_all<Float64>(*net, id), ElementsAre(Field(&Float64::data, 2), Field(&Float64::data, 3)));
  EXPECT_EQ(take_all<Float64>(*page, id).size(), 3U);

  ASSERT_TRUE(net->publish("/remote", "/x", "std_msgs/msg/Float64", to_cdr(Float64{4})));
  bus.spin();
  net->unsubscribe(id);
  net->subscribe(id);
  bus.spin();
  EXPECT_THAT(take_all<Float64>(*net, id), ElementsAre(Field(&Float64::data, 3)))
      << "expected the node's latched message, and not the edge's own";
}

TEST(Edge, WithoutOwnMessagesOnEdgeTopicReceivesNoOwn) {
  Bus bus;
  const auto net = bus.attach("net", {.receives_own = false}), page = bus.attach("page");
  ASSERT_TRUE(net->publish("/remote", "/x", "std_msgs/msg/Float64", to_cdr(Float64{1})));
  bus.spin();
  const TopicId id = topic(bus, "/x").id;
  net->subscribe(id);
  page->subscribe(id);
  ASSERT_TRUE(net->publish("/remote", "/x", "std_msgs/msg/Float64", to_cdr(Float64{2})));
  bus.spin();
  EXPECT_THAT(take_all<Float64>(*net, id), IsEmpty());
  EXPECT_EQ(take_all<Float64>(*page, id).size(), 1U);
}

TEST(Edge, PublishCreatesTopic) {
  Bus bus;
  auto one = bus.attach("one");
  const auto two = bus.attach("two");
  ASSERT_TRUE(one->publish("/cli", "x", "std_msgs/msg/Int32", to_cdr(Int32{1})));
  bus.spin();
  EXPECT_EQ(topic(bus, "/x").received, 1U);
  two->subscribe(topic(bus, "/x").id);
  ASSERT_TRUE(one->publish("/cli", "x", "std_msgs/msg/Int32", to_cdr(Int32{2})));
  bus.spin();
  EXPECT_EQ(take_all<Int32>(*two, topic(bus, "/x").id).size(), 1U);
  EXPECT_FALSE(one->publish("/cli", "x", "std_msgs/msg/String", to_cdr(String{"a"})));
  Node node(bus, "/n");
  EXPECT_NO_THROW(node.advertise<String>("x"))
      << "expected a topic of another type from outside not to stop a node";
  ASSERT_TRUE(one->publish("/cli", "x", "std_msgs/msg/String", to_cdr(String{"a"})));
  one.reset();
  bus.spin();
  EXPECT_THAT(names(topic(bus, "/x").publishers), ElementsAre("/n"));
}

TEST(Edge, UnpublishableMessageIsRefused) {
  Bus bus;
  Node node(bus, "/n");
  node.subscribe<Float64>("x", [](const Float64&) {});
  const auto edge = bus.attach("edge");
  EXPECT_THAT(edge->publish("/c", "/x", "std_msgs/msg/Int32", to_cdr(Int32{1})).why(),
              HasSubstr("topic /x has type std_msgs/msg/Float64, not std_msgs/msg/Int32"));
  EXPECT_THAT(edge->publish("/c", "/x", "std_msgs/msg/Flaot64", to_cdr(Float64{1})).why(),
              HasSubstr("did you mean 'std_msgs/msg/Float64'?"));
  EXPECT_FALSE(edge->publish("/c", "/x", "std_msgs/msg/Float64", to_cdr(Int32{1})));
  EXPECT_FALSE(edge->publish("/c", "/new", "std_msgs/msg/Float64", to_cdr(Int32{1})));
  EXPECT_THAT(edge->publish("/c", "/my-topic", "std_msgs/msg/Float64", to_cdr(Float64{1})).why(),
              HasSubstr("letters, digits and _"));
}

TEST(Service, ResponseCanBeImmediateOrDeferredOnce) {
  Bus bus;
  Node node(bus, "/n");
  Responder<SetBool::Response> later;
  node.serve<SetBool>("~/set", [&](const SetBool::Request& request, Responder<SetBool::Response> respond) {
    if (request.data) {
      respond({true, "now"});
      respond({true, "twice"});
    } else {
      later = respond;
    }
  });
  const auto edge = bus.attach("edge");
  Answer now, late;
  edge->call("/n/set", to_cdr(SetBool::Request{true}), now.receiver());
  edge->call("/n/set", to_cdr(SetBool::Request{false}), late.receiver());
  EXPECT_EQ(now.count, 0);
  bus.spin();
  ASSERT_EQ(now.count, 1);
  SetBool::Response response;
  ASSERT_TRUE(from_cdr(now.bytes, response));
  EXPECT_EQ(response.message, "now");
  EXPECT_EQ(late.count, 0);
  later({true, "later"});
  EXPECT_EQ(late.count, 1);
}

TEST(Service, FailureHasReason) {
  Bus bus;
  auto node = std::make_unique<Node>(bus, "/n");
  Responder<Trigger::Response> kept;
  node->serve<Trigger>("~/keep", [&](const auto&, const auto& respond) { kept = respond; });
  node->serve<Trigger>("~/drop", [](const auto&, const auto&) {});
  node->serve<Trigger>("~/throw", [](const auto&, const auto&) { throw std::runtime_error("no power"); });
  const auto edge = bus.attach("edge");
  const Bytes request = to_cdr(Trigger::Request{});
  Answer unknown, malformed, dropped, thrown, gone;
  edge->call("/n/kep", request, unknown.receiver());
  edge->call("/n/keep", {}, malformed.receiver());
  edge->call("/n/drop", request, dropped.receiver());
  edge->call("/n/throw", request, thrown.receiver());
  bus.spin();
  EXPECT_THAT(unknown.status.why(), HasSubstr("no service /n/kep; did you mean '/n/keep'?"));
  EXPECT_THAT(malformed.status.why(), HasSubstr("request for /n/keep rejected"));
  EXPECT_THAT(dropped.status.why(), HasSubstr("was removed"));
  EXPECT_THAT(thrown.status.why(), HasSubstr("no power"));
  edge->call("/n/keep", request, gone.receiver());
  node.reset();
  bus.spin();
  EXPECT_THAT(gone.status.why(), HasSubstr("was removed"))
      << "expected an error: the node was removed before the request arrived";
}

TEST(Service, NodeAndEdgeCanBeDestroyedDuringRequest) {
  Bus bus;
  auto node = std::make_unique<Node>(bus, "/n");
  Responder<Trigger::Response> kept;
  node->serve<Trigger>("~/keep", [&](const auto&, const auto& respond) { kept = respond; });
  auto edge = bus.attach("edge");
  Answer answer;
  edge->call("/n/keep", to_cdr(Trigger::Request{}), answer.receiver());
  bus.spin();
  node.reset();
  edge.reset();
  kept({true, ""});
  bus.spin();
  EXPECT_EQ(answer.count, 0) << "expected no answer: the edge was removed";
}

TEST(Service, SecondServerOfAnotherNodeIsRefused) {
  Bus bus;
  Node a(bus, "/a"), b(bus, "/b");
  int called = 0;
  a.serve<Trigger>("/go", [&](const auto&, const auto& respond) { respond({}); });
  a.serve<Trigger>("/go", [&](const auto&, const auto& respond) { respond({}), ++called; });
  EXPECT_THROW(b.serve<Trigger>("/go", [](const auto&, const auto&) {}), std::logic_error);
  const auto edge = bus.attach("edge");
  Answer answer;
  edge->call("/go", to_cdr(Trigger::Request{}), answer.receiver());
  bus.spin();
  EXPECT_EQ(called, 1);
}

}  // namespace
}  // namespace doppel
