#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

#include "doppel/ros/foxglove/foxglove_protocol.h"
#include "doppel/ros/server/send_queue.h"

namespace doppel::foxglove {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

FrameBytes bytes(std::initializer_list<int> values) {
  FrameBytes out;
  for (const int value : values) out.push_back(static_cast<std::byte>(value));
  return out;
}

template <class T>
T read_text(const std::string& frame) {
  ClientMessage message;
  const Status status = read_client_text(frame, message);
  EXPECT_TRUE(status.ok()) << status.why() << " in " << frame;
  return std::get<T>(message);
}

TEST(FoxgloveProtocol, DataHeaderMatchesSpecification) {
  const auto head = data_head(0x04030201, time_from_nanoseconds(0x0102030405060708));
  EXPECT_EQ(FrameBytes(head.begin(), head.end()), bytes({1, 1, 2, 3, 4, 8, 7, 6, 5, 4, 3, 2, 1}));
}

// The bytes are those of the tests of foxglove-sdk, protocol v1.
TEST(FoxgloveProtocol, PlaybackFramesAreThoseOfFoxglovesSdk) {
  PlaybackState state{PlaybackState::Status::playing, time_from_nanoseconds(12345), 1, true, ""};
  EXPECT_EQ(to_frame(state), bytes({5, 0, 0x39, 0x30, 0, 0, 0, 0, 0, 0, 0, 0, 0x80, 0x3f, 1, 0, 0, 0, 0}));
  state.did_seek = false;
  state.request = "i-am-a-request";
  EXPECT_EQ(to_frame(state),
            bytes({5, 0, 0x39, 0x30, 0,   0,   0,   0,   0,   0,   0,   0,   0x80, 0x3f, 0,   14, 0,
                   0, 0, 'i',  '-',  'a', 'm', '-', 'a', '-', 'r', 'e', 'q', 'u',  'e',  's', 't'}));
  PlaybackRequest request;
  ASSERT_TRUE(read_playback_request(bytes({3, 0, 0, 0, 0x80, 0x3f, 1,   0x15, 0xcd, 0x5b, 7,   0,   0,
                                           0, 0, 7, 0, 0,    0,    's', 'o',  'm',  'e',  '-', 'i', 'd'}),
                                    request));
  EXPECT_TRUE(request.play);
  EXPECT_EQ(request.speed, 1);
  EXPECT_EQ(request.seek, time_from_nanoseconds(123'456'789));
  EXPECT_EQ(request.id, "some-id");
  ASSERT_TRUE(read_playback_request(bytes({3, 1, 0, 0, 0x80, 0x3f, 0,   0,   0,   0,   0,   0,   0,
                                           0, 0, 7, 0, 0,    0,    's', 'o', 'm', 'e', '-', 'i', 'd'}),
                                    request));
  EXPECT_FALSE(request.play);
  EXPECT_FALSE(request.seek);
  EXPECT_FALSE(read_playback_request(bytes({3, 1, 0, 0}), request));
  EXPECT_FALSE(read_playback_request(bytes({2, 1, 0, 0}), request));
}

TEST(FoxgloveProtocol, TimeAndServiceResponseFramesMatchSpecification) {
  EXPECT_EQ(to_frame(TimeMessage{time_from_nanoseconds(5)}), bytes({2, 5, 0, 0, 0, 0, 0, 0, 0}));
  const FrameBytes payload = bytes({7, 8});
  EXPECT_EQ(to_frame(ServiceResponse{1, 2, "cdr", payload}),
            bytes({3, 1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0, 'c', 'd', 'r', 7, 8}));
}

TEST(FoxgloveProtocol, AdvertiseHasSchemaAndEncoding) {
  const auto frame = nlohmann::json::parse(to_frame(
      Channels{{{.id = 3, .topic = "/a", .schema_name = "std_msgs/msg/Bool", .schema = "bool data\n"}}}));
  EXPECT_EQ(frame["op"], "advertise");
  const auto& channel = frame["channels"][0];
  EXPECT_EQ(channel["id"], 3);
  EXPECT_EQ(channel["encoding"], "cdr");
  EXPECT_EQ(channel["schemaEncoding"], "ros2msg");
  EXPECT_EQ(channel["schemaName"], "std_msgs/msg/Bool");
  EXPECT_EQ(channel["schema"], "bool data\n");
}

TEST(FoxgloveProtocol, SpecificationExamplesAreRead) {
  const auto subscribe = read_text<Subscribe>(
      R"({"op":"subscribe","subscriptions":[{"id":0,"channelId":3},{"id":1,"channelId":5}]})");
  ASSERT_EQ(subscribe.items.size(), 2u);
  EXPECT_EQ(subscribe.items[1].id, 1u);
  EXPECT_EQ(subscribe.items[1].channel, 5u);
  EXPECT_THAT(read_text<Unsubscribe>(R"({"op":"unsubscribe","subscriptionIds":[0,1]})").ids,
              ElementsAre(0u, 1u));
  const auto advertise = read_text<Advertise>(
      R"({"op":"advertise","channels":[{"id":1,"topic":"foo","encoding":"json","schemaName":"x/msg/Y"}]})");
  EXPECT_EQ(advertise.channels.at(0).schema_name, "x/msg/Y");
  EXPECT_THAT(read_text<GetParameters>(R"({"op":"getParameters","parameterNames":[],"id":"r"})").names,
              ElementsAre());
  EXPECT_FALSE(read_text<WatchGraph>(R"({"op":"unsubscribeConnectionGraph"})").on);
}

TEST(FoxgloveProtocol, ParametersKeepTypesThroughJson) {
  const std::vector<ParameterValue> values{true,
                                           std::int64_t{3},
                                           3.0,
                                           0.1,
                                           std::string("text \xff"),
                                           std::vector<bool>{true, false},
                                           std::vector<std::int64_t>{1, 2},
                                           std::vector<double>{1, 2.5},
                                           std::vector<double>{},
                                           std::vector<std::string>{"a", "b"}};
  SetParameters set;
  for (const ParameterValue& value : values) set.parameters.push_back({"/node.p", value});
  const auto back = read_text<SetParameters>(to_frame(set));
  ASSERT_EQ(back.parameters.size(), values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (i == 4) {
      EXPECT_EQ(std::get<std::string>(back.parameters[i].value),
                "text \xEF\xBF\xBD");  // invalid UTF-8 replaced
    } else {
      EXPECT_EQ(back.parameters[i].value, values[i]) << i;
    }
  }
}

TEST(FoxgloveProtocol, InvalidFrameIsRefusedWithReason) {
  const std::pair<const char*, const char*> cases[] = {
      {"", "not valid JSON"},
      {"{", "not valid JSON"},
      {"[1]", "not a JSON object"},
      {"{}", "'op' is missing"},
      {R"({"op":3})", "'op' is not a string"},
      {R"({"op":"subscribe"})", "'subscriptions' is missing"},
      {R"({"op":"subscribe","subscriptions":[1]})", "'id' was expected"},
      {R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":3}]})", "'id' must be an integer"},
      {R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":4294967296}]})", "'channelId' must be"},
      {R"({"op":"advertise","channels":{}})", "'channels' is not a list"},
      {R"({"op":"setParameters","parameters":[{"name":"/a.b","value":[1,"x"]}]})", "not all of one type"},
      {R"({"op":"setParameters","parameters":[{"name":"/a.b","value":{"x":1}}]})",
       "does not have a parameter type"}};
  for (const auto& [frame, reason] : cases) {
    ClientMessage message;
    const Status status = read_client_text(frame, message);
    EXPECT_FALSE(status.ok()) << frame;
    EXPECT_THAT(status.why(), HasSubstr(reason)) << frame;
  }
  for (const FrameBytes& frame : {bytes({}), bytes({1}), bytes({1, 0, 0}), bytes({2, 0, 0, 0, 0, 1, 0, 0, 0}),
                                  bytes({2, 0, 0, 0, 0, 1, 0, 0, 0, 255, 255, 255, 255, 'c'})}) {
    ClientMessage message;
    EXPECT_FALSE(read_client_binary(frame, message).ok());
  }
  EXPECT_EQ(read_text<UnknownOperation>(R"({"op":"dance"})").op, "dance");
}

TEST(FoxgloveProtocol, FramesRoundTripBetweenClientAndServer) {
  ServerMessage received;
  ASSERT_TRUE(read_server_text(to_frame(Services{{{.id = 1,
                                                   .name = "/s",
                                                   .type = "a/srv/B",
                                                   .request_schema = "bool x",
                                                   .response_schema = "bool y"}}}),
                               received));
  EXPECT_EQ(std::get<Services>(received).services.at(0).response_schema, "bool y");
  GraphUpdate graph;
  graph.published = {{"/a", {"/n", "/m"}}};
  graph.removed_services = {"/gone"};
  ASSERT_TRUE(read_server_text(to_frame(graph), received));
  EXPECT_THAT(std::get<GraphUpdate>(received).published.at(0).ids, ElementsAre("/n", "/m"));
  EXPECT_THAT(std::get<GraphUpdate>(received).removed_services, ElementsAre("/gone"));
  ClientMessage said;
  const FrameBytes payload = bytes({9, 9});
  const FrameBytes frame = to_frame(ServiceCall{4, 5, "json", payload});
  ASSERT_TRUE(read_client_binary(frame, said));
  const auto& call = std::get<ServiceCall>(said);
  EXPECT_EQ(call.encoding, "json");
  EXPECT_EQ(FrameBytes(call.payload.begin(), call.payload.end()), payload);
}

TEST(FoxgloveProtocol, DamagedFramesAreRefused) {
  const unsigned seed = 31;
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  const std::string text =
      to_frame(SetParameters{{{"/a.b", std::vector<double>{1, 2}}, {"/a.c", "x"}}, "id"});
  const FrameBytes payload(20, std::byte{1});
  const FrameBytes binary = to_frame(ServiceCall{4, 5, "json", payload});
  for (int i = 0; i < 20000; ++i) {
    std::string damaged_text = text;
    FrameBytes damaged = binary;
    for (int n = 0; n < 3; ++n) {
      damaged_text[random() % damaged_text.size()] = static_cast<char>(random());
      damaged[random() % damaged.size()] = static_cast<std::byte>(random());
    }
    damaged.resize(random() % (damaged.size() + 1));
    ClientMessage message;
    ServerMessage answer;
    static_cast<void>(read_client_text(damaged_text, message));
    static_cast<void>(read_client_binary(damaged, message));
    static_cast<void>(read_server_text(damaged_text, answer));
    static_cast<void>(read_server_binary(damaged, answer));
  }
}

TEST(FoxgloveProtocol, AssetRequestIsTextAndResponseIsBinary) {
  ClientMessage asked;
  ASSERT_TRUE(read_client_text(to_frame(FetchAsset{7, "package://arm/a b.stl"}), asked).ok());
  EXPECT_EQ(std::get<FetchAsset>(asked).request, 7u);
  EXPECT_EQ(std::get<FetchAsset>(asked).uri, "package://arm/a b.stl");
  for (const char* frame : {R"({"op":"fetchAsset","uri":"x"})", R"({"op":"fetchAsset","requestId":1})",
                            R"({"op":"fetchAsset","uri":"x","requestId":-1})"}) {
    EXPECT_FALSE(read_client_text(frame, asked).ok()) << frame;
  }
  ServerMessage answer;
  ASSERT_TRUE(read_server_binary(to_frame(AssetFailure{7, "gone"}), answer).ok());
  EXPECT_EQ(std::get<AssetFailure>(answer).why, "gone");
  const auto head = asset_head(9);
  FrameBytes found(head.begin(), head.end());
  found.resize(found.size() + 3);
  ASSERT_TRUE(read_server_binary(found, answer).ok());
  EXPECT_EQ(std::get<AssetData>(answer).request, 9u);
  EXPECT_EQ(std::get<AssetData>(answer).data.size(), 3u);
}

OutgoingFrame data_frame(std::size_t size) {
  OutgoingFrame frame = make_frame(FrameBytes(size));
  frame.kind = OutgoingFrame::Kind::message;
  return frame;
}

TEST(SendQueue, FullQueueDropsOldestMessagesAndKeepsResponses) {
  SendQueue queue(10'000);
  queue.push(make_frame(std::string("first")));
  std::size_t dropped = 0;
  for (int i = 0; i < 1000; ++i) dropped += queue.push(data_frame(1000));
  queue.push(make_frame(std::string("last")));
  EXPECT_LE(queue.data_bytes(), 10'000u);
  EXPECT_EQ(queue.pop()->body.size(), 5u);
  std::size_t messages = 0;
  std::optional<OutgoingFrame> frame;
  while ((frame = queue.pop()) && frame->kind == OutgoingFrame::Kind::message) ++messages;
  ASSERT_TRUE(frame.has_value());
  EXPECT_EQ(messages + dropped, 1000u);
  EXPECT_EQ(frame->body.size(), 4u);  // the answer arrived after the messages before it
  EXPECT_TRUE(queue.empty());
  EXPECT_EQ(queue.data_bytes() + queue.answer_bytes(), 0u);
}

TEST(SendQueue, FilesAreKept) {
  SendQueue queue(100);
  OutgoingFrame file = make_frame(FrameBytes(5000));
  file.kind = OutgoingFrame::Kind::asset;
  EXPECT_EQ(queue.push(file), 0u);
  EXPECT_EQ(queue.assets(), 1u);
  EXPECT_EQ(queue.answer_bytes() + queue.data_bytes(), 0u);
  EXPECT_EQ(queue.push(data_frame(10)), 0u);
  EXPECT_EQ(queue.pop()->body.size(), 5000u);
  EXPECT_EQ(queue.assets(), 0u);
}

TEST(SendQueue, OversizedMessageIsSentAlone) {
  SendQueue queue(100);
  queue.push(data_frame(10));
  EXPECT_EQ(queue.push(data_frame(5000)), 1u);
  EXPECT_EQ(queue.pop()->body.size(), 5000u);
}

}  // namespace
}  // namespace doppel::foxglove
