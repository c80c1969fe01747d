// The bridge over Fast DDS on loopback, with a plain participant as its peer.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <thread>

#include "doppel/ros/messages/std_msgs.h"
#include "doppel/ros/messages/std_srvs.h"
#include "doppel/ros/network/bridge.h"
#include "doppel/ros/network/names.h"
#include "doppel/ros/network/test/network.h"

namespace doppel::ros2::test {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;
using std_msgs::msg::Float64;
using std_srvs::srv::Trigger;

class BridgeNetworkTest : public ::testing::Test {
 protected:
  template <class Condition>
  bool comes_true(const Condition& condition) {
    const auto end = steady_clock::now() + kTimeout;
    while (steady_clock::now() < end) {
      bus.spin();
      if (condition()) return true;
      std::this_thread::sleep_for(milliseconds(1));
    }
    return false;
  }
  static EndpointSpec spec(const std::string& topic, const QosProfile& qos = {}) {
    return {dds_name(NameKind::topic, topic), dds_type("std_msgs/msg/Float64"), "", qos};
  }
  static double value_of(Reader& reader) {
    Sample sample;
    Float64 message;
    EXPECT_TRUE(reader.take(sample));
    EXPECT_TRUE(from_cdr(sample.cdr, message));
    return message.data;
  }

  OwnDomain domain;
  Bus bus;
  doppel::Node node{bus, "/arm"};
  Log log;
  std::unique_ptr<Participant> peer = make_participant(on_domain(domain), [] {});
  std::optional<Bridge> bridge{std::in_place, bus,
                               BridgeOptions{.network = on_domain(domain), .diagnostics_node = ""}, log};
};

TEST_F(BridgeNetworkTest, MessagesPassBothWays) {
  const auto out = node.advertise<Float64>("/out", {.depth = 1, .latched = true});
  out.publish({1}, {});
  std::vector<double> received;
  node.subscribe<Float64>("/in", [&](const Float64& message) { received.push_back(message.data); });
  const auto reader = peer->make_reader(spec("/out", latched_qos()));
  const auto writer = peer->make_writer(spec("/in"));
  ASSERT_TRUE(comes_true([&] { return reader->is_ready() && writer->matched() == 1; }));
  EXPECT_EQ(value_of(*reader), 1);
  writer->write(to_cdr(Float64{2}));
  ASSERT_TRUE(comes_true([&] { return !received.empty(); }));
  EXPECT_THAT(received, ::testing::ElementsAre(2));
  EXPECT_TRUE(comes_true([&] { return bridge->status().participants == 1; }));
}

TEST_F(BridgeNetworkTest, ServiceCallIsAnswered) {
  node.serve<Trigger>("~/go", [](const auto&, const Responder<Trigger::Response>& respond) {
    respond({.success = true, .message = "gone"});
  });
  ServiceClient client(
      *peer, {.name = "/arm/go", .type = "std_srvs/srv/Trigger", .request_hash = "", .response_hash = ""});
  ASSERT_TRUE(comes_true([&] { return client.is_available(); }));
  client.send(to_cdr(Trigger::Request{}));
  Sample reply;
  ASSERT_TRUE(comes_true([&] { return client.take(reply); }));
  Trigger::Response response;
  ASSERT_TRUE(from_cdr(reply.cdr, response));
  EXPECT_EQ(response.message, "gone");
}

TEST_F(BridgeNetworkTest, ShutdownIsAnnounced) {
  node.advertise<Float64>("/out");
  const auto reader = peer->make_reader(spec("/out"));
  ASSERT_TRUE(comes_true([&] { return reader->matched() == 1; }));
  bridge.reset();
  ASSERT_TRUE(comes_true([&] { return reader->matched() == 0; }))
      << "expected no match long before the end of the lease";
  EXPECT_TRUE(comes_true([&] { return peer->participants().size() == 1; }));
}

TEST_F(BridgeNetworkTest, DestructionBeforeJoinIsSafe) {
  for (int i = 0; i < 3; ++i) {
    bridge.emplace(bus, BridgeOptions{.network = on_domain(domain), .diagnostics_node = ""}, log);
  }
}

}  // namespace
}  // namespace doppel::ros2::test
