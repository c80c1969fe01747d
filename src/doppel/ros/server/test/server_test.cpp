#include "doppel/ros/server/server.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "doppel/base/core/diagnostic.h"
#include "doppel/ros/client/websocket_client.h"
#include "doppel/ros/server/test/fake_twin.h"
#include "doppel/ros/server/test/raw_client.h"
#include "doppel/ros/server/test/resident_memory.h"

namespace doppel {
namespace {

using std::chrono::seconds;
using std::chrono::steady_clock;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::StartsWith;

steady_clock::time_point soon() {
  return steady_clock::now() + seconds(20);
}

template <Message M>
M decode(const Bytes& cdr) {
  M message;
  const Status status = from_cdr(cdr, message);
  EXPECT_TRUE(status.ok()) << status.why();
  return message;
}

class ServerTest : public ::testing::Test {
 protected:
  explicit ServerTest(std::size_t padding = 0) : twin_(padding) {}
  Server& start(ServerOptions options = {}) {
    options.port = 0;
    server_ = std::make_unique<Server>(twin_.bus(), options, log_);
    return *server_;
  }
  [[nodiscard]] ClientOptions client_options() const {
    ClientOptions options;
    options.port = server_->port();
    options.timeout = seconds(20);
    return options;
  }

  Log log_;
  test::FakeTwin twin_;
  std::unique_ptr<Server> server_;
};

TEST_F(ServerTest, NewClientReceivesFullState) {
  start({.name = "doppel arm"});
  const WebSocketClient client(client_options());
  EXPECT_EQ(client.server_name(), "doppel arm");
  EXPECT_EQ(client.topics().at("/joint_states").type, "sensor_msgs/msg/JointState");
  EXPECT_THAT(client.topics().at("/joint_states").schema, HasSubstr("MSG: std_msgs/Header"));
  EXPECT_THAT(client.topics().at("/joint_states").publishers, Contains("/arm"));
  EXPECT_THAT(client.topics().at("/command").subscribers, Contains("/arm"));
  EXPECT_EQ(client.services().at("/arm/enable").type, "std_srvs/srv/SetBool");
  EXPECT_THAT(client.services().at("/arm/enable").providers, Contains("/arm"));
}

TEST_F(ServerTest, PlaybackIsControlledByClients) {
  const auto playback = std::make_shared<PlaybackControl>(time_from_seconds(1.5), time_from_seconds(9));
  const Server& server = start({.playback = playback});
  test::RawClient client(server.port());
  ASSERT_EQ(client.handshake(), "");
  const auto info = client.receive_op("serverInfo");
  EXPECT_THAT(info["capabilities"], Contains("playbackControl"));
  EXPECT_EQ(info["dataStartTime"], (nlohmann::json{{"sec", 1}, {"nsec", 500'000'000}}));
  EXPECT_EQ(info["dataEndTime"]["sec"], 9);
  client.send_binary(std::string("\x03\x01\0\0\x80\x3f\0\0\0\0\0\0\0\0\0\x01\0\0\0x", 20));
  std::vector<foxglove::PlaybackRequest> requests;
  while (requests.empty() && steady_clock::now() < soon()) requests = playback->take();
  ASSERT_EQ(requests.size(), 1U);
  EXPECT_FALSE(requests[0].play);
  EXPECT_EQ(requests[0].id, "x");
  foxglove::PlaybackState state;
  state.now = time_from_seconds(2);
  state.request = "x";
  playback->report(state);
  const auto expected = foxglove::to_frame(state);
  std::string frame;
  while (!frame.starts_with('\x05')) frame = client.receive();
  EXPECT_EQ(frame, std::string(reinterpret_cast<const char*>(expected.data()), expected.size()));
}

TEST_F(ServerTest, PlaybackRequestWithoutRecordingIsRefused) {
  const Server& server = start();
  test::RawClient client(server.port());
  ASSERT_EQ(client.handshake(), "");
  EXPECT_THAT(client.receive_op("serverInfo")["capabilities"], testing::Not(Contains("playbackControl")));
  client.send_binary(std::string("\x03\x01\0\0\x80\x3f\0\0\0\0\0\0\0\0\0\x01\0\0\0x", 20));
  EXPECT_THAT(std::string(client.receive_op("status")["message"]), HasSubstr("no recording is played"));
}

TEST_F(ServerTest, SubscribedTopicsAreStreamed) {
  start();
  WebSocketClient client(client_options());
  client.subscribe("/joint_states");
  Client::Received received;
  Time before = time_from_nanoseconds(-1);
  for (int i = 0; i < 50; ++i) {
    ASSERT_TRUE(client.next(received, soon()));
    EXPECT_EQ(received.topic, "/joint_states");
    EXPECT_GT(received.stamp, before);
    const auto state = decode<sensor_msgs::msg::JointState>(received.cdr);
    EXPECT_EQ(from_msg(state.header.stamp), received.stamp);
    before = received.stamp;
  }
  EXPECT_THROW(client.subscribe("/joint_sates"), ClientError);
}

TEST_F(ServerTest, EveryClientReceivesLatchedMessage) {
  start();
  for (int i = 0; i < 2; ++i) {
    WebSocketClient first(client_options()), second(client_options());
    for (Client* client : {&first, &second}) {
      client->subscribe("/robot_description");
      Client::Received received;
      ASSERT_TRUE(client->next(received, soon()));
      EXPECT_EQ(decode<std_msgs::msg::String>(received.cdr).data, "<robot/>");
    }
  }
}

TEST_F(ServerTest, LateClientReceivesLatchedMessagesOfRemainingPublishers) {
  start();
  constexpr Qos kLatched{.depth = 1, .latched = true};
  std::optional<Node> first, second;
  twin_.on_loop([&] {
    for (auto* node : {&first, &second}) {
      node->emplace(twin_.bus(), node == &first ? "/first" : "/second");
      (*node)->advertise<std_msgs::msg::String>("/shared", kLatched).publish({(*node)->name()}, {});
    }
  });
  WebSocketClient early(client_options());
  early.subscribe("/shared");
  const auto next = [&](Client& client) {
    Client::Received received;
    return client.next(received, soon()) ? decode<std_msgs::msg::String>(received.cdr).data : "nothing";
  };
  EXPECT_EQ(next(early), "/first");
  EXPECT_EQ(next(early), "/second");
  twin_.on_loop([&] { first.reset(); });
  for (int i = 0; i < 3; ++i) {
    WebSocketClient late(client_options());
    late.subscribe("/shared");
    EXPECT_EQ(next(late), "/second");
  }
  twin_.on_loop([&] { second->advertise<std_msgs::msg::String>("/shared", kLatched).publish({"end"}, {}); });
  EXPECT_EQ(next(early), "end") << "expected no latched message again for a client that has it";
  twin_.on_loop([&] { second.reset(); });
}

TEST_F(ServerTest, ClientPublishReachesTwin) {
  start();
  WebSocketClient client(client_options());
  client.publish("/command", "std_msgs/msg/Float64", to_cdr(std_msgs::msg::Float64{.data = 2.5}));
  client.sync();
  EXPECT_EQ(twin_.received(), 1);
  EXPECT_EQ(twin_.last_value(), 2.5);
  client.publish("/command", "std_msgs/msg/Float64", Bytes(3));
  EXPECT_THROW(client.sync(), ClientError);
  client.publish("/command", "std_msgs/msg/String", to_cdr(std_msgs::msg::String{}));
  EXPECT_THROW(client.sync(), ClientError);
  EXPECT_EQ(twin_.received(), 1);
}

// A plugin's type, whose code throws in the server's thread.
class ThrowingType : public TypeSupport {
 public:
  ThrowingType() : TypeSupport("test_msgs/msg/Throwing") {}
  [[nodiscard]] const TypeDescription* description_in(Distro distro) const override {
    if (std::this_thread::get_id() != client && throws) throw 42;
    return type_support<std_msgs::msg::Float64>().description_in(distro);
  }
  const std::thread::id client = std::this_thread::get_id();
  mutable std::atomic<bool> throws{true};
};

TEST_F(ServerTest, TypeExceptionIsReportedAndServerContinues) {
  static const ThrowingType type;
  register_type(type);
  std::mutex mutex;
  std::string said;
  log_.add_sink([&](const LogLine& line) {
    const std::lock_guard lock(mutex);
    said = line.text;
  });
  start();
  WebSocketClient client(client_options());
  client.publish("/thrown", type.name, to_cdr(std_msgs::msg::Float64{}));
  for (const auto end = soon(); steady_clock::now() < end; std::this_thread::yield()) {
    const std::lock_guard lock(mutex);
    if (!said.empty()) break;
  }
  {
    const std::lock_guard lock(mutex);
    EXPECT_THAT(said,
                HasSubstr("the server continues after: it threw something other than a std::exception"));
  }
  WebSocketClient other(client_options());
  other.subscribe("/joint_states");
  Client::Received received;
  EXPECT_TRUE(other.next(received, soon()));
  EXPECT_FALSE(other.topics().contains("/thrown"))
      << "expected the topic of a disconnected client to be removed";
  type.throws = false;  // it stays registered
}

TEST_F(ServerTest, PublisherAndSubscriberClientsSeeEachOther) {
  start();
  WebSocketClient listener(client_options()), speaker(client_options());
  speaker.publish("/talk", "std_msgs/msg/Bool", to_cdr(std_msgs::msg::Bool{}));
  speaker.sync();
  ASSERT_TRUE(listener.wait_until(
      [&] { return listener.topics().contains("/talk") && !listener.topics().at("/talk").type.empty(); },
      soon()));
  listener.subscribe("/talk");
  ASSERT_TRUE(speaker.wait_until(
      [&] { return speaker.topics().contains("/talk") && !speaker.topics().at("/talk").subscribers.empty(); },
      soon()));
  speaker.publish("/talk", "std_msgs/msg/Bool", to_cdr(std_msgs::msg::Bool{.data = true}));
  Client::Received received;
  ASSERT_TRUE(listener.next(received, soon()));
  EXPECT_TRUE(decode<std_msgs::msg::Bool>(received.cdr).data);
}

TEST_F(ServerTest, CallsServices) {
  start();
  WebSocketClient client(client_options());
  const auto answer = client.call("/arm/enable", to_cdr(std_srvs::srv::SetBool::Request{.data = true}));
  ASSERT_TRUE(answer.ok) << answer.why;
  EXPECT_EQ(decode<std_srvs::srv::SetBool::Response>(answer.response).message, "on");
  const auto refused = client.call("/arm/enable", Bytes(2));
  EXPECT_FALSE(refused.ok);
  EXPECT_THAT(refused.why, HasSubstr("/arm/enable"));
  EXPECT_FALSE(client.call("/arm/never", to_cdr(std_srvs::srv::Trigger::Request{})).ok)
      << "expected a failure: the responder was dropped";
  EXPECT_THROW(client.call("/arm/enabel", {}), ClientError);
}

TEST_F(ServerTest, ReadsAndSetsParameters) {
  start();
  WebSocketClient client(client_options());
  const auto value_of = [&client](const std::string& name) {
    for (const NamedParameter& parameter : client.parameters()) {
      if (parameter.node == "/arm" && parameter.name == name) return parameter.value;
    }
    return ParameterValue{};
  };
  EXPECT_EQ(value_of("rate"), ParameterValue(std::int64_t{100}));
  EXPECT_EQ(value_of("gains.p"), ParameterValue(1.0));
  EXPECT_TRUE(client.set_parameter("/arm", "gains.p", 2.0));
  EXPECT_EQ(value_of("gains.p"), ParameterValue(2.0));
  EXPECT_THAT(client.set_parameter("/arm", "rate", std::string("fast")).why(), HasSubstr("rate"));
  EXPECT_FALSE(client.set_parameter("/arm", "name", std::string("leg")).ok());
  EXPECT_FALSE(client.set_parameter("/leg", "rate", std::int64_t{1}).ok());
  EXPECT_EQ(value_of("rate"), ParameterValue(std::int64_t{100}));
}

TEST_F(ServerTest, ParameterChangesAreSentToSubscribers) {
  test::RawClient raw(start().port());
  ASSERT_EQ(raw.handshake(), "");
  raw.send(R"({"op":"subscribeParameterUpdates","parameterNames":["/arm.gains.p"]})");
  raw.send(R"({"op":"getParameters","parameterNames":["/arm.gains.p"],"id":"first"})");
  EXPECT_EQ(raw.receive_op("parameterValues")["id"], "first");
  WebSocketClient client(client_options());
  EXPECT_TRUE(client.set_parameter("/arm", "rate", std::int64_t{7}));
  EXPECT_TRUE(client.set_parameter("/arm", "gains.p", 7.5));
  const auto update = raw.receive_op("parameterValues");
  ASSERT_EQ(update["parameters"].size(), 1u);
  EXPECT_EQ(update["parameters"][0]["name"], "/arm.gains.p");
  EXPECT_EQ(update["parameters"][0]["value"], 7.5);
}

TEST_F(ServerTest, GraphUpdatesAreSent) {
  start();
  WebSocketClient client(client_options());
  std::unique_ptr<Node> node;
  twin_.on_loop([&] {
    node = std::make_unique<Node>(twin_.bus(), "/late");
    static_cast<void>(node->advertise<std_msgs::msg::Bool>("/late_topic"));
    node->serve<std_srvs::srv::Trigger>("/late_service", [](const auto&, const auto& respond) {
      respond({true, ""});
    });
  });
  ASSERT_TRUE(client.wait_until(
      [&] { return client.topics().contains("/late_topic") && client.services().contains("/late_service"); },
      soon()));
  ASSERT_TRUE(client.call("/late_service", to_cdr(std_srvs::srv::Trigger::Request{})).ok);
  twin_.on_loop([&] { node.reset(); });
  EXPECT_TRUE(client.wait_until(
      [&] {
        return !client.topics().contains("/late_topic") && !client.services().contains("/late_service");
      },
      soon()));
}

TEST_F(ServerTest, JsonEncodingIsAccepted) {
  test::RawClient raw(start().port());
  ASSERT_EQ(raw.handshake(), "");
  EXPECT_EQ(raw.header("Sec-WebSocket-Protocol"), "foxglove.websocket.v1");
  const auto info = raw.receive_op("serverInfo");
  for (const char* capability :
       {"clientPublish", "services", "parameters", "parametersSubscribe", "connectionGraph", "time"}) {
    EXPECT_THAT(info["capabilities"], Contains(capability));
  }
  raw.send(
      R"({"op":"advertise","channels":[{"id":1,"topic":"/command","encoding":"json","schemaName":"std_msgs/msg/Float64"}]})");
  raw.send_binary(std::string("\x01\x01\0\0\0", 5) + R"({"data": 0.75})");
  raw.send_binary(std::string("\x01\x01\0\0\0", 5) + R"({"date": 0.75})");
  EXPECT_THAT(raw.receive_op("status")["message"].get<std::string>(), HasSubstr("did you mean 'data'"));
  raw.send_binary(std::string("\x01\x01\0\0\0", 5) + "{data: 0.75}");
  EXPECT_THAT(raw.receive_op("status")["message"].get<std::string>(), HasSubstr("1:2: not JSON: "));
  std::uint32_t id = 0;
  test::RawClient again(server_->port());
  ASSERT_EQ(again.handshake(), "");
  const auto offers = again.receive_op("advertiseServices");
  for (const auto& service : offers["services"]) {
    if (service["name"] != "/arm/enable") continue;
    id = service["id"];
    EXPECT_THAT(service["request"]["schema"].get<std::string>(), HasSubstr("bool data"));
  }
  again.send_binary(std::string("\x02", 1) + std::string(reinterpret_cast<const char*>(&id), 4) +
                    std::string("\x09\0\0\0\x04\0\0\0json", 12) + R"({"data": true})");
  const std::string response = again.receive();
  EXPECT_EQ(response.substr(9), std::string("\x04\0\0\0json", 8) + R"({"success":true,"message":"on"})");
  EXPECT_EQ(twin_.last_value(), 0.75);
}

TEST_F(ServerTest, TimeIsSentToClients) {
  test::RawClient raw(start().port());
  ASSERT_EQ(raw.handshake(), "");
  const auto channels = raw.receive_op("advertise")["channels"];
  int id = -1;
  for (const auto& channel : channels) {
    if (channel["topic"] == "/robot_description") id = channel["id"];
  }
  raw.send(R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":)" + std::to_string(id) + "}]}");
  std::string frame;
  do {
    frame = raw.receive();
  } while (frame.size() != 9 || frame[0] != 2);
  std::uint64_t now = 0;
  std::memcpy(&now, frame.data() + 1, 8);
  EXPECT_GT(now, 0u);
}

TEST_F(ServerTest, ForeignOriginIsRefused) {
  const std::uint16_t port = start({.max_clients = 2}).port();
  EXPECT_THAT(test::RawClient(port).handshake("evil.example.org"), StartsWith("403"));
  EXPECT_THAT(test::RawClient(port).handshake("localhost", {{"Origin", "https://evil.example.org"}}),
              StartsWith("403"));
  EXPECT_THAT(test::RawClient(port).handshake("localhost", {{"Sec-WebSocket-Protocol", "chat"}}),
              StartsWith("400"));
  test::RawClient page(port), other(port), third(port);
  EXPECT_EQ(page.handshake("localhost:1", {{"Origin", "http://localhost:5173"}}), "");
  EXPECT_EQ(other.handshake("127.0.0.1", {{"Sec-WebSocket-Protocol", "x, foxglove.sdk.v1"}}), "");
  EXPECT_EQ(other.header("Sec-WebSocket-Protocol"), "foxglove.sdk.v1");
  EXPECT_THAT(third.handshake(), StartsWith("503"));
}

TEST_F(ServerTest, InvalidFrameClosesThatClientOnly) {
  start({.max_message = 10'000});
  WebSocketClient bystander(client_options());
  const std::string bad_text[] = {"no json",
                                  "[]",
                                  R"({"op":1})",
                                  R"({"op":"subscribe"})",
                                  std::string(5000, '['),
                                  std::string(20'000, 'x')};
  for (const std::string& frame : bad_text) {
    test::RawClient raw(server_->port());
    ASSERT_EQ(raw.handshake(), "");
    raw.send(frame);
    if (frame.size() < 10'000) {
      EXPECT_THAT(raw.receive_op("status")["message"].get<std::string>(), HasSubstr("frame rejected: "));
      raw.send(R"({"op":"getParameters","parameterNames":["/arm.rate"],"id":"x"})");
      EXPECT_EQ(raw.receive_op("parameterValues")["id"], "x") << "expected the connection to stay open";
    } else {
      raw.closing_reason();
    }
  }
  for (const std::string& frame : {std::string("\x01", 1), std::string("\x02\0\0", 3)}) {
    test::RawClient raw(server_->port());
    ASSERT_EQ(raw.handshake(), "");
    raw.send_binary(frame);
    EXPECT_THAT(raw.receive_op("status")["message"].get<std::string>(), HasSubstr("truncated"));
  }
  test::RawClient abrupt(server_->port());
  ASSERT_EQ(abrupt.handshake(), "");
  boost::asio::write(abrupt.tcp(), boost::asio::buffer(std::string(20, '\xff')));
  abrupt.closing_reason();
  EXPECT_TRUE(bystander.call("/arm/enable", to_cdr(std_srvs::srv::SetBool::Request{})).ok);
}

TEST_F(ServerTest, OddParameterValueIsAnsweredWithStatus) {
  start();
  test::RawClient raw(server_->port());
  ASSERT_EQ(raw.handshake(), "");
  const std::pair<const char*, const char*> cases[] = {
      {"null", "parameters cannot be removed"},
      {R"({"x":1})", "does not have a parameter type"},
      {R"([1,"x"])", "not all of one type"},
      {R"([[1]])", "not all of one type"},
  };
  for (const auto& [value, reason] : cases) {
    raw.send(
        fmt::format(R"({{"op":"setParameters","parameters":[{{"name":"/arm.rate","value":{}}}]}})", value));
    EXPECT_THAT(raw.receive_op("status")["message"].get<std::string>(), HasSubstr(reason)) << value;
  }
  raw.send(R"({"op":"getParameters","parameterNames":["/arm.rate"],"id":"x"})");
  EXPECT_EQ(raw.receive_op("parameterValues")["parameters"][0]["value"], 100);
}

TEST_F(ServerTest, InvalidOperationIsAnsweredWithStatus) {
  test::RawClient raw(start().port());
  ASSERT_EQ(raw.handshake(), "");
  const std::pair<std::string, std::string> cases[] = {
      {R"({"op":"dance"})", "unknown operation 'dance'"},
      {R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":99999}]})", "no channel 99999"},
      {R"({"op":"unsubscribe","subscriptionIds":[5]})", "no subscription 5"},
      {R"({"op":"unadvertise","channelIds":[5]})", "no client channel 5"},
      {R"({"op":"advertise","channels":[{"id":1,"topic":"/x","encoding":"protobuf","schemaName":"std_msgs/msg/Bool"}]})",
       "'protobuf' is not supported"},
      {R"({"op":"advertise","channels":[{"id":1,"topic":"/x y","encoding":"cdr","schemaName":"std_msgs/msg/Bool"}]})",
       "not a valid topic name"},
      {R"({"op":"advertise","channels":[{"id":1,"topic":"/x","encoding":"cdr","schemaName":"my/msg/Own"}]})",
       "unknown type 'my/msg/Own'"},
      {R"({"op":"advertise","channels":[{"id":1,"topic":"/command","encoding":"cdr","schemaName":"std_msgs/msg/Bool"}]})",
       "has type std_msgs/msg/Float64"},
      {R"({"op":"setParameters","parameters":[{"name":"x","value":1}]})", "'x' is not a parameter"},
      {R"({"op":"setParameters","parameters":[{"name":"/arm.rate"}]})", "cannot be removed"}};
  for (const auto& [frame, text] : cases) {
    raw.send(frame);
    EXPECT_THAT(raw.receive_op("status")["message"].get<std::string>(), HasSubstr(text));
  }
  raw.send_binary(std::string("\x01\x09\0\0\0", 5));
  EXPECT_THAT(raw.receive_op("status")["message"].get<std::string>(), HasSubstr("no client channel 9"));
  raw.send_binary(std::string("\x02\xff\xff\0\0\x01\0\0\0\x03\0\0\0cdr", 16));
  EXPECT_EQ(raw.receive_op("serviceCallFailure")["callId"], 1);
}

TEST_F(ServerTest, ServesFiftyClients) {
  start({.max_clients = 64});
  std::vector<std::unique_ptr<WebSocketClient>> clients;
  for (int i = 0; i < 50; ++i) clients.push_back(std::make_unique<WebSocketClient>(client_options()));
  for (const auto& client : clients) client->subscribe("/joint_states");
  Client::Received received;
  for (const auto& client : clients) {
    for (int i = 0; i < 5; ++i) ASSERT_TRUE(client->next(received, soon()));
  }
  for (std::size_t i = 0; i < clients.size(); i += 2) clients[i].reset();
  for (const auto& client : clients) {
    if (client) {
      ASSERT_TRUE(client->next(received, soon()));
    }
  }
}

TEST_F(ServerTest, ClientsCanDisconnectAtAnyTime) {
  start();
  for (int i = 0; i < 30; ++i) {
    test::RawClient raw(server_->port());
    ASSERT_EQ(raw.handshake(), "");
    raw.send(R"({"op":"getParameters","parameterNames":[],"id":"x"})");
    raw.send(R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":1},{"id":2,"channelId":2}]})");
    raw.send(R"({"op":"subscribeParameterUpdates"})");
    if (i % 2 == 0) raw.tcp().close();
  }
  EXPECT_TRUE(
      WebSocketClient(client_options()).call("/arm/enable", to_cdr(std_srvs::srv::SetBool::Request{})).ok);
}

TEST_F(ServerTest, ShutdownClosesClients) {
  start();
  WebSocketClient client(client_options());
  server_.reset();
  try {
    static_cast<void>(client.wait_until([] { return false; }, soon()));
    FAIL() << "expected a ClientError: the server is gone";
  } catch (const ClientError& error) {
    EXPECT_STREQ(error.what(), "the twin has ended");
  }
  ClientOptions options;
  options.port = 1;
  EXPECT_THROW(WebSocketClient{options}, ClientError);
}

TEST_F(ServerTest, TakenPortIsSkippedOrReported) {
  const std::uint16_t taken = start().port();
  const Server next(twin_.bus(), {.port = taken}, log_);
  EXPECT_NE(next.port(), taken);
  EXPECT_LE(next.port(), taken + 20);
  try {
    const Server none(twin_.bus(), {.port = taken, .any_free_port = false}, log_);
    FAIL() << "expected an InputError: the port is in use";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr(std::to_string(taken)));
    EXPECT_THAT(error.what(), HasSubstr("--port"));
  }
  EXPECT_THROW(Server(twin_.bus(), {.host = "nowhere"}, log_), InputError);
}

TEST_F(ServerTest, HttpRequestIsAnswered) {
  namespace http = boost::beast::http;
  const std::uint16_t port = start({.name = "doppel arm"}).port();
  const auto get = [port](const std::string& target, const std::string& host) {
    boost::asio::io_context io;
    boost::asio::ip::tcp::socket socket(io);
    socket.connect({boost::asio::ip::address_v4::loopback(), port});
    http::request<http::empty_body> request(http::verb::get, target, 11);
    request.set(http::field::host, host);
    http::write(socket, request);
    boost::beast::flat_buffer buffer;
    http::response<http::string_body> response;
    http::read(socket, buffer, response);
    return response;
  };
  EXPECT_THAT(get("/", "localhost").body(), HasSubstr("doppel arm"));
  EXPECT_EQ(nlohmann::json::parse(get("/health", "localhost").body())["status"], "ok");
  EXPECT_GT(nlohmann::json::parse(get("/health", "localhost").body())["topics"], 0)
      << "expected topics before any client connects";
  EXPECT_EQ(get("/nothing", "localhost").result_int(), 404u);
  EXPECT_EQ(get("/", "evil.example.org").result_int(), 403u);
}

constexpr long kMaxSleeperGrowth = growth_bound(60'000);

class LargeMessagesTest : public ServerTest {
 protected:
  LargeMessagesTest() : ServerTest(60'000) {}
};

TEST_F(LargeMessagesTest, NonReadingClientIsSkipped) {
  start({.client_queue_bytes = std::size_t{1} << 20});
  test::RawClient sleeper(server_->port());
  ASSERT_EQ(sleeper.handshake(), "");
  WebSocketClient client(client_options());
  std::string channel;
  const auto offers = sleeper.receive_op("advertise");
  for (const auto& entry : offers["channels"]) {
    if (entry["topic"] == "/joint_states") channel = entry["id"].dump();
  }
  sleeper.send(R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":)" + channel + "}]}");
  const long before = resident_kilobytes();
  client.subscribe("/joint_states");
  Client::Received received;
  for (int i = 0; i < 2000; ++i) ASSERT_TRUE(client.next(received, soon()));  // 120 MB
  EXPECT_GT(server_->skipped(), 500u);
  EXPECT_GT(twin_.bus().skipped(), 500u) << "expected the status of the loop to report skipped messages";
  EXPECT_LT(resident_kilobytes() - before, kMaxSleeperGrowth)
      << "expected the messages of a client that does not read not to be kept";
  sleeper.send(R"({"op":"getParameters","parameterNames":["/arm.rate"],"id":"awake"})");
  EXPECT_EQ(sleeper.receive_op("parameterValues")["id"], "awake") << "expected responses not to be skipped";
}

}  // namespace
}  // namespace doppel
