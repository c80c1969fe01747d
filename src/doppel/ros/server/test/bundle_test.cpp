#include "doppel/ros/server/detail/bundle.h"

#include <gtest/gtest.h>

#include <set>

#include "doppel/ros/server/server.h"
#include "fake_twin.h"
#include "raw_client.h"

namespace doppel {
namespace {

OutgoingFrame message_of(std::size_t size) {
  OutgoingFrame frame = make_frame(foxglove::FrameBytes(size, std::byte{7}));
  frame.kind = OutgoingFrame::Kind::message;
  return frame;
}

// The lengths of the frames in a bundle; empty: it is none.
std::vector<std::size_t> lengths_in(std::string_view bytes) {
  std::vector<std::size_t> out;
  if (bytes.empty() || bytes.front() != static_cast<char>(kBundleOpcode)) return out;
  for (std::size_t i = 1; i + 4 <= bytes.size();) {
    std::size_t length = 0;
    for (std::size_t k = 0; k < 4; ++k)
      length |= std::size_t{static_cast<unsigned char>(bytes[i + k])} << (8 * k);
    out.push_back(length);
    i += 4 + length;
  }
  return out;
}

std::string_view text_of(const OutgoingFrame& frame) {
  return {reinterpret_cast<const char*>(frame.body.data()), frame.body.size()};
}

TEST(Bundle, PeriodIsReadFromAddress) {
  EXPECT_EQ(bundle_period("/?bundle=16").count(), 16);
  EXPECT_EQ(bundle_period("/?token=abc&bundle=5").count(), 5);
  EXPECT_EQ(bundle_period("/?bundle=100000").count(), 100) << "expected the largest period";
  for (const char* target : {"/", "/?bundle=", "/?bundle=x", "/?bundle=-4", "/?bundle=4x", "/?mybundle=9"})
    EXPECT_EQ(bundle_period(target).count(), 0) << target;
}

TEST(Bundle, QueuedMessagesBecomeOneFrame) {
  SendQueue queue(1 << 20);
  for (const std::size_t size : {3u, 0u, 300u}) queue.push(message_of(size));
  const auto bundle = pop_bundle(queue);
  ASSERT_TRUE(bundle.has_value());
  EXPECT_EQ(lengths_in(text_of(*bundle)), (std::vector<std::size_t>{3, 0, 300}));
  EXPECT_TRUE(queue.empty());
  EXPECT_EQ(queue.data_bytes(), 0u);
  EXPECT_FALSE(pop_bundle(queue).has_value());
}

TEST(Bundle, OrderOfMessagesAndAnswersStays) {
  SendQueue queue(1 << 20);
  queue.push(message_of(1));
  queue.push(message_of(2));
  queue.push(make_frame(std::string("answer")));
  queue.push(message_of(3));
  EXPECT_EQ(lengths_in(text_of(*pop_bundle(queue))), (std::vector<std::size_t>{1, 2}));
  EXPECT_EQ(text_of(*pop_bundle(queue)), "answer");
  EXPECT_EQ(pop_bundle(queue)->size(), 3u) << "expected a single message without a bundle";
}

TEST(Bundle, LargeMessagesAreSentAlone) {
  SendQueue queue(1 << 24);
  queue.push(message_of(10));
  queue.push(message_of(kMaxBundleBytes));
  queue.push(message_of(kMaxBundleBytes - 20));
  queue.push(message_of(30));
  EXPECT_EQ(pop_bundle(queue)->size(), 10u);
  EXPECT_EQ(pop_bundle(queue)->size(), kMaxBundleBytes);
  EXPECT_EQ(pop_bundle(queue)->size(), kMaxBundleBytes - 20);
  EXPECT_EQ(pop_bundle(queue)->size(), 30u);
}

// Receives until there were `wanted` messages, each of which has a frame of its own or is in a bundle.
struct Received {
  std::size_t frames = 0, messages = 0;
};
Received receive_messages(test::RawClient& client, std::size_t wanted) {
  const auto channels = client.receive_op("advertise")["channels"];
  nlohmann::json items = nlohmann::json::array();
  for (const auto& channel : channels) {
    const std::string topic = channel["topic"];
    if (topic == "/joint_states" || topic == "/clock")
      items.push_back({{"id", items.size() + 1}, {"channelId", channel["id"]}});
  }
  client.send(nlohmann::json{{"op", "subscribe"}, {"subscriptions", items}}.dump());
  Received out;
  while (out.messages < wanted) {
    const std::string frame = client.receive();
    if (frame.empty() || frame.front() == '{') continue;
    const auto lengths = lengths_in(frame);
    if (lengths.empty() && frame.front() != 1) continue;
    ++out.frames;
    out.messages += lengths.empty() ? 1 : lengths.size();
  }
  return out;
}

TEST(Bundle, ClientThatAsksForBundlesReceivesFewerFrames) {
  test::FakeTwin twin;
  const Log silent;
  const Server server(twin.bus(), {.port = 0}, silent);
  test::RawClient bundled(server.port()), plain(server.port());
  ASSERT_EQ(bundled.handshake("localhost", {}, "/?bundle=16"), "");
  ASSERT_EQ(plain.handshake(), "");
  const Received few = receive_messages(bundled, 400), many = receive_messages(plain, 400);
  EXPECT_LT(few.frames * 4, few.messages);
  EXPECT_EQ(many.frames, many.messages) << "expected a client that does not ask to get the protocol's frames";
}

TEST(Bundle, ResponsesDoNotWaitForMessages) {
  test::FakeTwin twin;
  const Log silent;
  const Server server(twin.bus(), {.port = 0}, silent);
  test::RawClient client(server.port());
  ASSERT_EQ(client.handshake("localhost", {}, "/?bundle=100"), "");
  const auto info = client.receive_op("serverInfo");
  EXPECT_EQ(info["metadata"]["ROS_DISTRO"], "jazzy");
  client.send(R"({"op":"getParameters","parameterNames":[],"id":"p"})");
  EXPECT_EQ(client.receive_op("parameterValues")["id"], "p");
}

}  // namespace
}  // namespace doppel
