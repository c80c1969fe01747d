// The bridge between a bus and a network in memory; what another participant sees of it and does to it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <optional>
#include <thread>

#include "doppel/ros/messages/control_msgs.h"
#include "doppel/ros/messages/diagnostic_msgs.h"
#include "doppel/ros/messages/rosgraph_msgs.h"
#include "doppel/ros/messages/std_srvs.h"
#include "doppel/ros/network/test/bridge_testing.h"

namespace doppel::ros2 {
namespace {

using std_msgs::msg::String;
using std_srvs::srv::SetBool;
using std_srvs::srv::Trigger;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

TEST_F(BridgeTest, PublishedMessageReachesNetworkWhileSubscribed) {
  const auto publisher = node.advertise<Float64>("~/x", {.depth = 3, .best_effort = true});
  start();
  ASSERT_TRUE(comes_true([&] { return endpoints("/arm/x").size() == 1; }));
  const EndpointInfo writer = endpoints("/arm/x")[0];
  EXPECT_TRUE(writer.is_writer);
  EXPECT_EQ(writer.type, "std_msgs::msg::dds_::Float64_");
  EXPECT_EQ(writer.qos.reliability, Reliability::best_effort);
  EXPECT_EQ(writer.qos.depth, 3U);
  EXPECT_FALSE(publisher.has_listeners()) << "expected no cost in the loop for a topic without subscribers";

  auto reader = peer->make_reader(topic_spec("/arm/x", kFloat, sensor_data_qos()));
  ASSERT_TRUE(comes_true([&] { return bridge->matches("/arm/x").readers == 1; }));
  EXPECT_TRUE(publisher.has_listeners());
  publisher.publish({7}, {});
  ASSERT_TRUE(comes_true([&] { return reader->is_ready(); }));
  EXPECT_THAT(take_all(*reader), ElementsAre(7));

  reader.reset();
  EXPECT_TRUE(comes_true([&] { return !publisher.has_listeners(); }));
  EXPECT_TRUE(comes_true([&] { return bridge->status().sent == 1; }));
}

TEST_F(BridgeTest, LatchedTopicReachesLateReader) {
  const auto publisher = node.advertise<Float64>("/x", {.depth = 1, .latched = true});
  publisher.publish({1}, {});
  start();
  ASSERT_TRUE(comes_true([&] { return is_heard("/x"); }));
  const auto first_value = [&] {
    const auto reader = peer->make_reader(topic_spec("/x", kFloat, latched_qos()));
    std::vector<double> values;
    EXPECT_TRUE(comes_true([&] { return !(values = take_all(*reader)).empty(); }));
    return values;
  };
  EXPECT_TRUE(comes_true([&] { return bridge->status().sent == 1; }));
  EXPECT_THAT(first_value(), ElementsAre(1));
  publisher.publish({2}, {});  // without a reader
  EXPECT_TRUE(comes_true([&] { return bridge->status().sent == 2; }));
  EXPECT_THAT(first_value(), ElementsAre(2));
}

TEST_F(BridgeTest, LatchedHistoryIsNewest) {
  const auto publisher = node.advertise<Float64>("/x", {.depth = 1, .latched_on_network = true});
  start();
  auto reader = peer->make_reader(topic_spec("/x", kFloat, latched_qos()));
  ASSERT_TRUE(comes_true([&] { return bridge->matches("/x").readers == 1; }));
  publisher.publish({1}, {});
  ASSERT_TRUE(comes_true([&] { return reader->is_ready(); }));
  reader.reset();
  ASSERT_TRUE(comes_true([&] { return !publisher.has_listeners(); }));
  publisher.publish({2}, {});
  reader = peer->make_reader(topic_spec("/x", kFloat, latched_qos()));
  ASSERT_TRUE(comes_true([&] { return publisher.has_listeners(); }));
  publisher.publish({3}, {});
  ASSERT_TRUE(comes_true([&] { return reader->is_ready(); }));
  EXPECT_THAT(take_all(*reader), ElementsAre(3));
}

TEST_F(BridgeTest, HistoryReachesLateReader) {
  const auto publisher = node.advertise<Float64>("/log", Qos::rosout());
  start();
  ASSERT_TRUE(comes_true([&] { return endpoints("/log").size() == 1; }));
  EXPECT_EQ(endpoints("/log")[0].qos.lifespan, std::chrono::seconds(10))
      << "expected the QoS with which rcl offers /rosout";
  ASSERT_TRUE(comes_true([&] { return publisher.has_listeners(); }));
  for (const double value : {1, 2, 3}) publisher.publish({value}, {});
  ASSERT_TRUE(comes_true([&] { return bridge->status().sent == 3; }));
  const auto reader = peer->make_reader(topic_spec("/log", kFloat, latched_qos(10)));
  EXPECT_THAT(take_all(*reader), ElementsAre(1, 2, 3));
}

TEST_F(BridgeTest, NetworkMessageReachesNodesOnce) {
  std::vector<double> received;
  node.subscribe<Float64>("/in", [&](const Float64& message) { received.push_back(message.data); });
  doppel::Node other(bus, "/other");
  int others = 0;
  other.subscribe<Float64>("/in", [&](const Float64&) { ++others; });
  node.advertise<Float64>("/in");  // and its own writer: nothing may be received from it
  const auto page = bus.attach("/_page");
  start();
  auto writer = peer->make_writer(topic_spec("/in"));
  auto listener = peer->make_reader(topic_spec("/in"));
  ASSERT_TRUE(comes_true([&] { return writer->matched() == 2 && bridge->matches("/in").readers == 1; }));
  EXPECT_EQ(bridge->matches("/in").writers, 1U);
  for (const double value : {1, 2, 3}) writer->write(to_cdr(Float64{value}));
  ASSERT_TRUE(comes_true([&] { return received.size() >= 3; }));
  ASSERT_TRUE(page->publish("/_page", "/in", kFloat, to_cdr(Float64{4})));
  ASSERT_TRUE(comes_true([&] { return listener->is_ready(); }));
  EXPECT_THAT(take_all(*listener), ElementsAre(4))
      << "expected the page's message to be published to the network, too";
  EXPECT_THAT(received, ElementsAre(1, 2, 3, 4));
  EXPECT_EQ(others, 4);
  EXPECT_TRUE(comes_true([&] { return bridge->status().received == 3; }));
}

TEST_F(BridgeTest, PublishingEdgeIsNetworkPublisher) {
  node.subscribe<Float64>("/in", [](const Float64&) {});
  const auto page = bus.attach("/_page");
  ASSERT_TRUE(page->publish("/_page", "/in", kFloat, to_cdr(Float64{4})));
  bus.spin();
  start();
  auto listener = peer->make_reader(topic_spec("/in"));
  ASSERT_TRUE(comes_true([&] { return bridge->matches("/in").readers == 1; }));
  ASSERT_TRUE(page->publish("/_page", "/in", kFloat, to_cdr(Float64{5})));
  ASSERT_TRUE(comes_true([&] { return listener->is_ready(); }));
  EXPECT_THAT(take_all(*listener), ElementsAre(5));
}

TEST_F(BridgeTest, MalformedMessagesAreCountedAndReportedOnce) {
  int received = 0;
  node.subscribe<Float64>("/in", [&](const Float64&) { ++received; });
  start();
  auto writer = peer->make_writer(topic_spec("/in", kFloat, {.depth = 1000}));
  ASSERT_TRUE(comes_true([&] { return writer->matched() == 1; }));
  const Bytes bad(3);
  for (int i = 0; i < 5; ++i) {
    writer->write(bad);
    ASSERT_TRUE(comes_true([&] { return bridge->status().refused == static_cast<std::uint64_t>(i) + 1; }));
  }
  writer->write(to_cdr(Float64{1}));
  EXPECT_TRUE(comes_true([&] { return received == 1; }));
  const NetworkStatus status = bridge->status();
  ASSERT_TRUE(status.rejections.contains("/in"));
  EXPECT_EQ(status.rejections.at("/in").count, 5U);
  EXPECT_THAT(status.rejections.at("/in").reason, Not(IsEmpty()));
  const std::lock_guard lock(mutex);
  EXPECT_THAT(said, ElementsAre(HasSubstr("/in")));
}

TEST_F(BridgeTest, EndpointsBelongToTheirNodes) {
  node.advertise<Float64>("/x");
  doppel::Node other(bus, "/ns/other");
  other.advertise<Float64>("/x", {.depth = 4});
  other.subscribe<Float64>("/y", [](const Float64&) {});
  node.serve<Trigger>("~/go", [](const auto&, const auto&) {});
  start();
  Graph graph(*peer);
  const auto find = [&](std::string_view name) -> const GraphNode* {
    const auto found = std::ranges::find(graph.nodes(), name, &GraphNode::name);
    return found == graph.nodes().end() ? nullptr : &*found;
  };
  ASSERT_TRUE(comes_true([&] {
    graph.update();
    return find("/arm") != nullptr && find("/arm")->writers.size() == 2 && find("/ns/other") != nullptr &&
           find("/ns/other")->readers.size() == 1;
  }));
  EXPECT_EQ(find("/arm")->readers.size(), 1U) << "expected one reader, of the service's requests";
  EXPECT_EQ(find("/ns/other")->writers.size(), 1U);
  EXPECT_EQ(endpoints("/x").size(), 2U) << "expected each node to have its own writer";
}

TEST_F(BridgeTest, RecreatedNodeKeepsEndpoints) {
  start();
  std::optional<doppel::Node> controller(std::in_place, bus, "/controller");
  controller->advertise<Float64>("~/state");
  ASSERT_TRUE(comes_true([&] { return endpoints("/controller/state").size() == 1; }));
  const Gid before = endpoints("/controller/state")[0].gid;
  controller.reset();
  run_for(milliseconds(60));  // the bridge has removed its endpoints
  controller.emplace(bus, "/controller");
  controller->advertise<Float64>("~/state");
  run_for(milliseconds(400));
  ASSERT_EQ(endpoints("/controller/state").size(), 1U);
  EXPECT_EQ(endpoints("/controller/state")[0].gid, before);
  controller.reset();
  EXPECT_TRUE(comes_true([&] { return endpoints("/controller/state").empty(); }));
}

TEST_F(BridgeTest, NextNodeTakesOverLatchedTopic) {
  std::optional<doppel::Node> first(std::in_place, bus, "/a_first");
  first->advertise<Float64>("/x", {.depth = 1, .latched = true}).publish({1}, {});
  const auto publisher = node.advertise<Float64>("/x", {.depth = 1, .latched = true});
  start();
  ASSERT_TRUE(comes_true([&] { return endpoints("/x").size() == 2; }));
  publisher.publish({2}, {});
  ASSERT_TRUE(comes_true([&] { return bridge->status().sent >= 1; }));
  first.reset();
  ASSERT_TRUE(comes_true([&] { return endpoints("/x").size() == 1; }));
  auto reader = peer->make_reader(topic_spec("/x", kFloat, latched_qos()));
  ASSERT_TRUE(comes_true([&] { return reader->is_ready(); }));
  EXPECT_THAT(take_all(*reader), ElementsAre(2));
}

TEST_F(BridgeTest, StrongestQosCarriesTopic) {
  const auto weak = node.advertise<Float64>("/x", {.depth = 50, .best_effort = true});
  start();
  ASSERT_TRUE(comes_true([&] { return endpoints("/x").size() == 1; }));
  doppel::Node other(bus, "/other");
  const auto strong = other.advertise<Float64>("/x", {.depth = 2});
  const auto any = peer->make_reader(topic_spec("/x", kFloat, sensor_data_qos()));
  const auto reliable = peer->make_reader(topic_spec("/x"));
  ASSERT_TRUE(comes_true([&] { return bridge->matches("/x").readers == 2; }));
  weak.publish({1}, {});
  strong.publish({2}, {});
  ASSERT_TRUE(comes_true([&] { return bridge->status().sent == 2; }));
  EXPECT_THAT(take_all(*reliable), ElementsAre(1, 2));
  EXPECT_THAT(take_all(*any), ElementsAre(1, 2)) << "expected each message once";
}

TEST_F(BridgeTest, RetypedTopicIsOfferedImmediately) {
  std::optional<doppel::Node> first(std::in_place, bus, "/first");
  first->advertise<String>("/x");
  first->subscribe<String>("/x", [](const String&) {});
  start();
  ASSERT_TRUE(comes_true([&] { return endpoints("/x").size() == 2; }));
  first.reset();
  node.advertise<Float64>("/x");
  ASSERT_TRUE(comes_true([&] {
    const auto all = endpoints("/x");
    return all.size() == 1 && all[0].type == dds_type(kFloat);
  }));
  const std::lock_guard lock(mutex);
  EXPECT_THAT(said, IsEmpty());
}

ServiceSpec trigger_spec(const std::string& name) {
  return {.name = name, .type = "std_srvs/srv/Trigger", .request_hash = "", .response_hash = ""};
}

TEST_F(BridgeTest, MalformedRequestGetsNoResponse) {
  node.serve<Trigger>("~/go", [](const auto&, const Responder<Trigger::Response>& respond) {
    respond({.success = true, .message = "gone"});
  });
  start();
  ServiceClient one(*peer, trigger_spec("/arm/go")), two(*peer, trigger_spec("/arm/go"));
  ASSERT_TRUE(comes_true([&] { return one.is_available() && two.is_available(); }));
  one.send(Bytes(1));  // malformed
  const auto number = one.send(to_cdr(Trigger::Request{}));
  Sample reply;
  ASSERT_TRUE(comes_true([&] { return one.take(reply); }));
  EXPECT_EQ(reply.related.sequence, number);
  Trigger::Response response;
  ASSERT_TRUE(from_cdr(reply.cdr, response));
  EXPECT_EQ(response.message, "gone");
  run_for(milliseconds(50));
  EXPECT_FALSE(one.take(reply)) << "expected no answer to a malformed request";
  EXPECT_FALSE(two.take(reply)) << "expected no answer to a request that another client sent";
  EXPECT_EQ(bridge->status().refused, 1U);
  EXPECT_EQ(bridge->status().requests, 2U);
}

// A response that reaches a reader before the writer is discovered is kept in a history of depth ten, where
// responses to other clients displace it.
TEST_F(BridgeTest, ResponseWaitsForReaderWithTimeout) {
  node.serve<Trigger>("~/go", [](const auto&, const Responder<Trigger::Response>& respond) { respond({}); });
  start();
  ServiceClient client(*peer, trigger_spec("/arm/go"));
  ASSERT_TRUE(comes_true([&] { return client.is_available(); }));
  network.acknowledges = false;
  const auto begin = steady_clock::now();
  client.send(to_cdr(Trigger::Request{}));
  Sample reply;
  EXPECT_TRUE(comes_true([&] { return client.take(reply); }));
  EXPECT_GE(steady_clock::now() - begin, milliseconds(20));
}

TEST_F(BridgeTest, ResponseToVanishedClientIsDropped) {
  std::vector<Responder<Trigger::Response>> waiting;
  node.serve<Trigger>("~/go", [&](const auto&, const auto& respond) { waiting.push_back(respond); });
  start();
  std::optional<ServiceClient> client(std::in_place, *peer, trigger_spec("/arm/go"));
  ASSERT_TRUE(comes_true([&] { return client->is_available(); }));
  for (int i = 0; i < 3; ++i) client->send(to_cdr(Trigger::Request{}));
  ASSERT_TRUE(comes_true([&] { return waiting.size() == 3; }));
  client.reset();
  for (const auto& respond : waiting) respond({});
  EXPECT_TRUE(comes_true([&] { return bridge->status().unanswered == 3; }));
  ServiceClient next(*peer, trigger_spec("/arm/go"));
  ASSERT_TRUE(comes_true([&] { return next.is_available(); }));
  next.send(to_cdr(Trigger::Request{}));
  EXPECT_TRUE(comes_true([&] { return waiting.size() == 4; }));
}

TEST_F(BridgeTest, PeerOfOtherDistroIsReportedOnceWithWhatToType) {
  using control_msgs::msg::PidState;
  node.advertise<PidState>("/pid");
  node.advertise<PidState>("/other_pid");
  start();
  const auto count = [this](const std::string& part) {
    const std::lock_guard lock(mutex);
    return std::ranges::count_if(
        said, [&](const std::string& line) { return line.find(part) != std::string::npos; });
  };
  EndpointSpec foreign = topic_spec("/pid", PidState::kType);
  foreign.type_hash = type_support<PidState>().hash(Distro::lyrical);
  const auto reader = peer->make_reader(foreign);
  foreign.topic = topic_spec("/other_pid").topic;
  const auto other_reader = peer->make_reader(foreign);
  EXPECT_TRUE(
      comes_true([&] { return count("has control_msgs/msg/PidState of ROS 2 Kilted or Lyrical") == 1; }));
  ASSERT_TRUE(comes_true(
      [&] { return bridge->matches("/pid").readers == 1 && bridge->matches("/other_pid").readers == 1; }));
  EXPECT_EQ(count("Start the twin with --distro lyrical, or set ROS_DISTRO"), 1);
}

TEST_F(BridgeTest, IncompatibleQosIsReportedOncePerPair) {
  node.advertise<Float64>("/out");
  node.subscribe<Float64>("/in", [](const auto&) {});
  start();
  const auto count = [this](const std::string& text) {
    const std::lock_guard lock(mutex);
    return std::ranges::count(said, text);
  };
  const auto reader = peer->make_reader(topic_spec("/out", kFloat, latched_qos()));
  const auto writer = peer->make_writer(topic_spec("/in", kFloat, sensor_data_qos()));
  const std::string of_reader =
      "New subscription discovered on topic '/out', requesting incompatible QoS. No messages will be sent to "
      "it. Last incompatible policy: DURABILITY_QOS_POLICY";
  const std::string of_writer =
      "New publisher discovered on topic '/in', offering incompatible QoS. No messages will be sent to it. "
      "Last incompatible policy: RELIABILITY_QOS_POLICY";
  EXPECT_TRUE(comes_true([&] { return count(of_reader) == 1 && count(of_writer) == 1; }));
  const auto fits = peer->make_reader(topic_spec("/out"));
  const auto another = peer->make_reader(topic_spec("/out", kFloat, latched_qos()));
  EXPECT_TRUE(comes_true([&] { return count(of_reader) == 2; }));
  run_for(milliseconds(50));
  EXPECT_EQ(count(of_reader), 2);
  EXPECT_EQ(count(of_writer), 1);
}

TEST_F(BridgeTest, SecondClockPublisherIsReported) {
  node.advertise<rosgraph_msgs::msg::Clock>("/clock");
  start();
  const auto writer = peer->make_writer(topic_spec("/clock", rosgraph_msgs::msg::Clock::kType));
  Graph graph(*peer);
  run_for(milliseconds(50));
  graph.set_own_nodes({{.name = "/gazebo", .writers = {writer->gid()}}});
  EXPECT_TRUE(comes_true([this] {
    const std::lock_guard lock(mutex);
    return !said.empty();
  }));
  const std::lock_guard lock(mutex);
  EXPECT_THAT(said, ElementsAre(HasSubstr("/clock is also published by node /gazebo in ")));
}

TEST_F(BridgeTest, NodeClientCallsRemoteService) {
  start();
  auto client = bridge->make_client("/arm", "/far/set", "std_srvs/srv/SetBool");
  EXPECT_FALSE(client->is_available());
  ServiceServer server(
      *peer, {.name = "/far/set", .type = "std_srvs/srv/SetBool", .request_hash = "", .response_hash = ""});
  ASSERT_TRUE(comes_true([&] { return client->is_available(); }));
  std::string answer;
  const auto remember = [&](const Bytes& bytes) {
    SetBool::Response response;
    if (from_cdr(bytes, response)) answer += response.message;
  };
  client->forget(client->call(to_cdr(SetBool::Request{.data = false}), remember));
  client->call(to_cdr(SetBool::Request{.data = true}), remember);
  int answered = 0;
  ASSERT_TRUE(comes_true([&] {
    Sample request;
    while (server.take(request)) {
      SetBool::Request asked;
      EXPECT_TRUE(from_cdr(request.cdr, asked));
      server.respond(request.related,
                     to_cdr(SetBool::Response{.success = true, .message = asked.data ? "on" : "off"}));
      ++answered;
    }
    return answered == 2 && !answer.empty();
  }));
  run_for(milliseconds(30));
  EXPECT_EQ(answer, "on") << "expected no response to a forgotten request";

  Graph graph(*peer);
  ASSERT_TRUE(comes_true([&] {
    graph.update();
    const auto service = std::ranges::find(graph.services(), "/far/set", &GraphService::name);
    return service != graph.services().end() && service->clients.size() == 1 &&
           service->clients[0].node == "/arm";
  }));
  client.reset();
  ASSERT_TRUE(comes_true([&] {
    graph.update();
    const auto service = std::ranges::find(graph.services(), "/far/set", &GraphService::name);
    return service == graph.services().end() || service->clients.empty();
  }));
}

TEST_F(BridgeTest, NodeClientFindsLocalService) {
  node.serve<Trigger>("~/go", [](const auto&, const Responder<Trigger::Response>& respond) {
    respond({.success = true, .message = "here"});
  });
  start();
  const auto client = bridge->make_client("/arm", "/arm/go", "std_srvs/srv/Trigger");
  ASSERT_TRUE(comes_true([&] { return client->is_available(); }));
  std::string answer;
  client->call(to_cdr(Trigger::Request{}), [&](const Bytes& bytes) {
    Trigger::Response response;
    if (from_cdr(bytes, response)) answer = response.message;
  });
  EXPECT_TRUE(comes_true([&] { return answer == "here"; }));
}

TEST_F(BridgeTest, RemoteServiceCanOutliveBridge) {
  start();
  const auto client = bridge->make_client("/arm", "/far/go", "std_srvs/srv/Trigger");
  bridge.reset();
  EXPECT_FALSE(client->is_available());
  client->call({}, [](const Bytes&) { FAIL() << "expected no response after the bridge is gone"; });
}

TEST_F(BridgeTest, GraphListsOwnAndRemoteNodes) {
  node.advertise<Float64>("/x");
  start();
  auto reader = peer->make_reader(topic_spec("/x"));
  Graph graph(*peer);
  graph.set_own_nodes({{.name = "/rviz", .readers = {reader->gid()}, .writers = {}}});
  std::shared_ptr<const GraphSnapshot> seen;
  ASSERT_TRUE(comes_true([&] {
    seen = bridge->graph();
    const auto topic = std::ranges::find(seen->topics, "/x", &GraphTopic::name);
    return topic != seen->topics.end() && topic->publishers.size() == 1 && topic->subscriptions.size() == 1 &&
           topic->publishers[0].node == "/arm" && topic->subscriptions[0].node == "/rviz";
  }));
  EXPECT_TRUE(comes_true([&] { return bridge->status().participants == 1 && bridge->status().nodes == 1; }));
  EXPECT_EQ(bridge->status().state, NetworkStatus::State::joined);
}

TEST_F(BridgeTest, ShortLivedNodeIsNotListed) {
  Graph graph(*peer);
  {
    const auto visitor = network.join([] {});
    Graph theirs(*visitor);
    theirs.set_own_nodes({{.name = "/ghost", .readers = {}, .writers = {}}});
  }
  graph.update();
  EXPECT_TRUE(graph.nodes().empty());
}

TEST_F(BridgeTest, MissingNetworkIsReportedOnce) {
  bridge.emplace(bus, BridgeOptions{.network = {}, .diagnostics_node = "/doppel"}, log,
                 [](const auto&, const auto&) -> std::unique_ptr<Participant> {
                   throw NetworkError("there is no interface");
                 });
  diagnostic_msgs::msg::DiagnosticStatus received;
  node.subscribe<diagnostic_msgs::msg::DiagnosticArray>(
      "/diagnostics", [&](const auto& message) { received = message.status.at(0); });
  ASSERT_TRUE(comes_true([&] { return received.level == received.ERROR; }));
  EXPECT_EQ(received.name, "doppel: ros2 network");
  EXPECT_EQ(received.message, "there is no interface");
  EXPECT_EQ(bridge->status().state, NetworkStatus::State::absent);
  EXPECT_THAT(said, ElementsAre("no ROS 2 network: there is no interface"));
}

TEST_F(BridgeTest, ParticipantExceptionDisablesNetworkOnly) {
  bridge.emplace(bus, BridgeOptions{}, log,
                 [](const auto&, auto) -> std::unique_ptr<Participant> { throw 42; });
  EXPECT_TRUE(comes_true([this] { return bridge->status().state == NetworkStatus::State::absent; }));
  EXPECT_EQ(bridge->status().problem, "it threw something other than a std::exception");
}

TEST_F(BridgeTest, DestructionDuringPeerLookupIsSafe) {
  std::promise<void> begun;
  bridge.emplace(bus, BridgeOptions{}, log, [&](const ParticipantOptions& with, const auto&) {
    begun.set_value();
    while (!with.is_cancelled()) std::this_thread::yield();
    throw NetworkError("given up");
    return std::unique_ptr<Participant>();
  });
  begun.get_future().wait();
  bridge.reset();
  EXPECT_THAT(said, IsEmpty());
}

TEST_F(BridgeTest, DiagnosticsReportNetworkStatus) {
  start({.network = {}, .diagnostics_node = "/doppel"});
  diagnostic_msgs::msg::DiagnosticStatus received;
  node.subscribe<diagnostic_msgs::msg::DiagnosticArray>(
      "/diagnostics", [&](const auto& message) { received = message.status.at(0); });
  ASSERT_TRUE(comes_true([&] { return received.message == "1 other participants"; }));
  EXPECT_EQ(received.level, received.OK);
  EXPECT_EQ(received.hardware_id, "domain 0");
}

TEST_F(BridgeTest, DestructionDuringTrafficIsSafe) {
  const auto publisher = node.advertise<Float64>("/x");
  std::vector<Responder<Trigger::Response>> waiting;
  node.serve<Trigger>("~/go", [&](const auto&, const auto& respond) { waiting.push_back(respond); });
  start();
  auto reader = peer->make_reader(topic_spec("/x"));
  ServiceClient client(*peer, trigger_spec("/arm/go"));
  ASSERT_TRUE(comes_true([&] { return client.is_available() && publisher.has_listeners(); }));
  client.send(to_cdr(Trigger::Request{}));
  ASSERT_TRUE(comes_true([&] { return waiting.size() == 1; }));
  publisher.publish({1}, {});
  bridge.reset();
  waiting.clear();
  bus.spin();
  EXPECT_THAT(endpoints("/x"), IsEmpty());
}

}  // namespace
}  // namespace doppel::ros2
