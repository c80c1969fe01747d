// The command line's view of a ROS 2 graph, over loopback.

#include "doppel/ros/client/graph_client.h"

#include <gmock/gmock.h>

#include "doppel/ros/messages/described_type.h"
#include "doppel/ros/messages/std_msgs.h"
#include "doppel/ros/messages/std_srvs.h"
#include "doppel/ros/messages/type_hash.h"
#include "doppel/ros/network/graph.h"
#include "doppel/ros/network/names.h"
#include "doppel/ros/network/service.h"
#include "doppel/ros/network/test/fake_network.h"
#include "doppel/ros/network/test/library_peer.h"

namespace doppel::ros2 {
namespace {

using namespace std::chrono_literals;
using std_srvs::srv::SetBool;
using std_srvs::srv::Trigger;
using test::kTimeout;
using test::Peer;
using test::quiet_context;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using Clock = std::chrono::steady_clock;
using Text = std_msgs::msg::String;

class GraphClientTest : public testing::Test {
 protected:
  GraphClientOptions options() {
    GraphClientOptions options;
    options.network = test::on_domain(domain_);
    options.on_status = [this](const std::string& text) { said_.push_back(text); };
    return options;
  }

  // A node with one of each interface.
  struct Lab {
    explicit Lab(Context& context) : node(context, "bench", "/lab") {
      node.declare_parameter("gain", 0.5);
      latched = node.create_publisher<Text>("description", {.depth = 1, .latched = true});
      latched.publish({"arm"});
      quick = node.create_publisher<Text>("quick", Qos::sensor_data());
      timer = node.create_wall_timer(5ms, [this] { quick.publish({"tick"}); });
      echo = node.create_publisher<Text>("answer", {.depth = 1, .latched = true});
      node.create_subscription<Text>("question", [this](const Text& text) { echo.publish(text); });
      node.create_service<SetBool>("~/set", [](const SetBool::Request& request, SetBool::Response& response) {
        response.success = request.data;
      });
      node.on_bus().serve<Trigger>("~/never", [this](const auto&, const auto& respond) {
        waiting.push_back(respond);  // forever
      });
    }
    Node node;
    Publisher<Text> latched, quick, echo;
    std::shared_ptr<Timer> timer;
    std::vector<Responder<Trigger::Response>> waiting;
  };
  void start_lab() {
    lab_ = std::make_unique<Peer>(quiet_context(domain_),
                                  [](Context& context) { return std::make_unique<Lab>(context); });
  }

  static std::string next_text(doppel::Client& client) {
    doppel::Client::Received message;
    Text text;
    if (!client.next(message, Clock::now() + kTimeout) || !from_cdr(std::span(message.cdr), text)) return "";
    return text.data;
  }

  template <class Call>
  static std::string failure_of(const Call& call) {
    try {
      call();
    } catch (const ClientError& error) {
      return error.what();
    }
    return "it went well";
  }

  test::OwnDomain domain_;
  std::unique_ptr<Peer> lab_;
  std::vector<std::string> said_;
};

TEST_F(GraphClientTest, NodesAndTopicsAreDiscovered) {
  start_lab();
  GraphClient client(options());
  EXPECT_THAT(client.nodes(), ElementsAre("/lab/bench"));
  const auto& topic = client.find_topic("/lab/description");
  EXPECT_EQ(topic.type, "std_msgs/msg/String");
  EXPECT_THAT(topic.publishers, ElementsAre("/lab/bench"));
  const auto& end = topic.publisher_ends.at(0);
  EXPECT_EQ(end.type_hash, find_type("std_msgs/msg/String")->hash());
  EXPECT_THAT(end.qos, Contains(std::pair<std::string, std::string>("Durability", "TRANSIENT_LOCAL")));
  EXPECT_THAT(end.qos,
              Contains(std::pair<std::string, std::string>("Liveliness lease duration", "Infinite")));
  EXPECT_EQ(end.gid.size(), 16 * 3 - 1);
  EXPECT_EQ(client.find_service("/lab/bench/set").type, "std_srvs/srv/SetBool");
  EXPECT_THAT(failure_of([&] { static_cast<void>(client.find_topic("/lab/descripton")); }),
              HasSubstr("did you mean '/lab/description'"));
  EXPECT_THAT(failure_of([&] { client.subscribe("/nothing"); }), HasSubstr("there is no topic /nothing"));
  EXPECT_THAT(said_, IsEmpty());
}

TEST_F(GraphClientTest, LatchedAndBestEffortTopicsAreReceived) {
  start_lab();
  GraphClient client(options());
  client.subscribe("/lab/description");
  EXPECT_EQ(next_text(client), "arm");
  client.unsubscribe("/lab/description");
  client.subscribe("/lab/quick");
  EXPECT_EQ(next_text(client), "tick");
  EXPECT_EQ(client.message_type("/lab/quick").name, "std_msgs/msg/String");
}

TEST_F(GraphClientTest, FirstMessageReachesSubscriber) {
  start_lab();
  GraphClient client(options());
  client.subscribe("/lab/answer");
  client.publish("/lab/question", "std_msgs/msg/String", to_cdr(Text{"first"}));
  EXPECT_EQ(next_text(client), "first");
}

TEST_F(GraphClientTest, CallsServices) {
  start_lab();
  GraphClient client(options());
  const auto answer = client.call("/lab/bench/set", to_cdr(SetBool::Request{true}));
  ASSERT_TRUE(answer.ok) << answer.why;
  SetBool::Response response;
  ASSERT_TRUE(from_cdr(std::span(answer.response), response));
  EXPECT_TRUE(response.success);
  EXPECT_THAT(failure_of([&] { client.call("/lab/bench/sett", {}); }), HasSubstr("did you mean"));
  EXPECT_THAT(failure_of([&] { client.call("/lab/bench/never", to_cdr(Trigger::Request()), 30ms); }),
              HasSubstr("did not answer within 0.03 s"));
}

TEST_F(GraphClientTest, VanishedServerEndsCall) {
  start_lab();
  GraphClient client(options());
  const std::uint32_t call = client.begin_call("/lab/bench/never", to_cdr(Trigger::Request()));
  lab_->stop();
  doppel::Client::Answer answer;
  bool taken = false;
  ASSERT_TRUE(client.wait_until([&] { return taken = taken || client.take_answer(call, answer); },
                                Clock::now() + kTimeout));
  EXPECT_FALSE(answer.ok);
  EXPECT_THAT(answer.why, HasSubstr("disappeared before it answered"));
  EXPECT_TRUE(client.wait_until([&] { return client.topics().empty(); }, Clock::now() + kTimeout));
}

// A server whose request reader is matched already and whose response writer is not yet.
TEST_F(GraphClientTest, NewServerKeepsCall) {
  start_lab();
  GraphClient client(options());
  const std::uint32_t call = client.begin_call("/lab/bench/never", to_cdr(Trigger::Request()));
  const auto other = make_participant(test::on_domain(domain_), [] {});
  const auto half = other->make_reader(
      {"rq/lab/bench/neverRequest", "std_srvs::srv::dds_::Trigger_Request_", "", services_qos()});
  ASSERT_TRUE(client.wait_until(
      [&] { return half->matched() == 1 && client.services().at("/lab/bench/never").providers.size() == 2; },
      Clock::now() + kTimeout));
  ASSERT_TRUE(client.call("/lab/bench/set", to_cdr(SetBool::Request{true})).ok);
  doppel::Client::Answer answer;
  EXPECT_FALSE(client.take_answer(call, answer)) << answer.why;
}

TEST_F(GraphClientTest, ReadsAndSetsParameters) {
  start_lab();
  GraphClient client(options());
  const auto gain = [&] {
    for (const NamedParameter& parameter : client.parameters()) {
      if (parameter.node == "/lab/bench" && parameter.name == "gain")
        return doppel::to_string(parameter.value);
    }
    return std::string("none");
  };
  EXPECT_EQ(gain(), "0.5");
  EXPECT_TRUE(client.set_parameter("/lab/bench", "gain", 2.0));
  EXPECT_EQ(gain(), "2.0");
  EXPECT_FALSE(client.set_parameter("/lab/bench", "gian", 2.0));
  EXPECT_THAT(failure_of([&] { client.parameters("/lab/stool"); }), HasSubstr("offers no parameters"));
}

// They come while the program waits for something else, in batches that the reader's history holds.
TEST_F(GraphClientTest, MessagesBeyondUnreadOnesAreCountedAndReported) {
  constexpr std::size_t kBatch = 100;
  test::FakeNetwork network;
  const auto peer = network.join([] {});
  const auto writer = peer->make_writer({.topic = dds_name(NameKind::topic, "/text"),
                                         .type = dds_type("std_msgs/msg/String"),
                                         .type_hash = find_type("std_msgs/msg/String")->hash(),
                                         .qos = default_qos()});
  GraphClientOptions quick = options();
  quick.spin_time = 50ms;
  GraphClient client(quick, [&network](const ParticipantOptions&, std::function<void()> on_activity) {
    return network.join(std::move(on_activity));
  });
  ASSERT_TRUE(client.wait_until([&] { return client.topics().contains("/text"); }, Clock::now() + kTimeout));
  client.subscribe("/text");
  const auto turn = [&client] {
    bool turned = false;
    return client.wait_until([&turned] { return std::exchange(turned, true); }, Clock::now() + kTimeout);
  };
  const Bytes text = to_cdr(Text{"early"});
  for (std::size_t sent = 0; sent < ReceiveBuffer::kMaxUnread + kBatch; sent += kBatch) {
    for (std::size_t i = 0; i < kBatch; ++i) writer->write(text);
    ASSERT_TRUE(turn());
  }
  EXPECT_THAT(said_, IsEmpty());
  EXPECT_EQ(next_text(client), "early");
  EXPECT_THAT(said_, ElementsAre("lost messages: 100, because 100000 earlier ones were waiting to be read"));
  doppel::Client::Received message;
  for (std::size_t i = 1; i < ReceiveBuffer::kMaxUnread; ++i) ASSERT_TRUE(client.next(message, Clock::now()));
  EXPECT_FALSE(client.next(message, Clock::now()));
  writer->write(to_cdr(Text{"late"}));
  EXPECT_EQ(next_text(client), "late");
  EXPECT_EQ(said_.size(), 1U);
}

TEST_F(GraphClientTest, EmptyNetworkIsReported) {
  GraphClient client(options());
  EXPECT_THAT(client.topics(), IsEmpty());
  EXPECT_THAT(client.nodes(), IsEmpty());
  ASSERT_EQ(said_.size(), 1U);
  EXPECT_THAT(said_[0], HasSubstr("no participant answers"));
}

TEST_F(GraphClientTest, TimeoutIsKept) {
  GraphClientOptions impatient = options();
  impatient.interrupted = [] { return true; };
  EXPECT_THROW(GraphClient{impatient}, Interrupted);
}

TEST_F(GraphClientTest, UnusableNetworkIsReported) {
  const auto fails = [](const ParticipantOptions&,
                        const std::function<void()>&) -> std::unique_ptr<Participant> {
    throw NetworkError("no usable network");
  };
  EXPECT_EQ(failure_of([&] { GraphClient client(options(), fails); }), "no usable network");
}

// A hand-made participant that publishes and subscribes a type that this program does not have, or has in
// another definition.
class RawParticipant {
 public:
  RawParticipant(const test::OwnDomain& domain, const TypeDescription& type, const std::string& node,
                 bool publishes)
      : type_(description_message(type)),
        participant_(make_participant(test::on_domain(domain), [] {})),
        graph_(*participant_) {
    writer_ = participant_->make_writer({.topic = dds_name(NameKind::topic, "/strange"),
                                         .type = dds_type(type.name),
                                         .type_hash = type_hash(type),
                                         .qos = latched_qos()});
    reader_ = participant_->make_reader({.topic = dds_name(NameKind::topic, "/strange_input"),
                                         .type = dds_type(type.name),
                                         .type_hash = type_hash(type),
                                         .qos = default_qos()});
    OwnNode own{.name = node, .readers = {reader_->gid()}, .writers = {writer_->gid()}};
    if (publishes) {
      server_.emplace(*participant_, ServiceSpec{.name = node + "/get_type_description",
                                                 .type = "type_description_interfaces/srv/GetTypeDescription",
                                                 .request_hash = "",
                                                 .response_hash = ""});
      own.readers.push_back(server_->requests().gid());
      own.writers.push_back(server_->replies().gid());
    }
    graph_.set_own_nodes({own});
    thread_ = std::thread([this] { serve(); });
  }
  ~RawParticipant() {
    done_ = true;
    thread_.join();
  }
  void publish(const Bytes& cdr) { writer_->write(cdr); }
  [[nodiscard]] Reader& reader() { return *reader_; }
  [[nodiscard]] Participant& participant() { return *participant_; }

 private:
  void serve() {
    using type_description_interfaces::srv::GetTypeDescription;
    Sample request;
    GetTypeDescription::Response response;
    response.successful = true;
    response.type_description = type_;
    while (!done_) {
      graph_.update();
      while (server_ && server_->take(request)) {
        while (server_->respond(request.related, to_cdr(response)) == ServiceServer::Sent::not_yet_matched)
          std::this_thread::sleep_for(1ms);
      }
      std::this_thread::sleep_for(1ms);
    }
  }

  TypeDescriptionMessage type_;
  std::unique_ptr<Participant> participant_;
  Graph graph_;
  std::unique_ptr<Writer> writer_;
  std::unique_ptr<Reader> reader_;
  std::optional<ServiceServer> server_;
  std::atomic<bool> done_{false};
  std::thread thread_;
};

TypeDescription one_field(std::string type, const char* field, FieldKind kind) {
  TypeDescription description{.name = std::move(type), .fields = {}, .constants = {}};
  FieldDescription only;
  only.name = field;
  only.kind = kind;
  description.add(only);
  return description;
}

TEST_F(GraphClientTest, UnknownTypeIsRequestedFromNode) {
  const TypeDescription type = one_field("my_msgs/msg/Odd", "oddness", FieldKind::int32);
  RawParticipant stranger(domain_, type, "/stranger", true);
  stranger.publish({std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0}, std::byte{7}, std::byte{0},
                    std::byte{0}, std::byte{0}});
  GraphClient client(options());
  const TypeSupport& support = client.message_type("/strange");
  client.subscribe("/strange");
  doppel::Client::Received message;
  ASSERT_TRUE(client.next(message, Clock::now() + kTimeout));
  std::string text;
  ASSERT_TRUE(support.cdr_to_yaml(message.cdr, text));
  EXPECT_EQ(text, "oddness: 7\n");
}

TEST_F(GraphClientTest, UnknownTypeCanBePublishedWhereDescribed) {
  const TypeDescription type = one_field("my_msgs/msg/Odd", "oddness", FieldKind::int32);
  RawParticipant stranger(domain_, type, "/stranger", true);
  GraphClient client(options());
  Bytes cdr;
  ASSERT_TRUE(client.message_type("/strange_input").yaml_to_cdr("{oddness: 7}", cdr));
  client.publish("/strange_input", type.name, cdr);
  Sample sample;
  ASSERT_TRUE(client.wait_until([&] { return stranger.reader().take(sample); }, Clock::now() + kTimeout));
  EXPECT_EQ(sample.cdr, cdr);
  const auto ends = stranger.participant().endpoints();
  const auto writer = std::ranges::find(ends, sample.identity.writer, &EndpointInfo::gid);
  ASSERT_NE(writer, ends.end());
  EXPECT_EQ(writer->type_hash, type_hash(type));
}

TEST_F(GraphClientTest, UndescribedTypeIsReported) {
  RawParticipant stranger(domain_, one_field("my_msgs/msg/Odd", "oddness", FieldKind::int32), "/stranger",
                          false);
  GraphClient client(options());
  EXPECT_THAT(failure_of([&] { static_cast<void>(client.message_type("/strange")); }),
              HasSubstr("my_msgs/msg/Odd, a type unknown to doppel, and /stranger"));
}

TEST_F(GraphClientTest, TypeWithOtherHashIsNotDecoded) {
  const TypeDescription type = one_field("std_msgs/msg/String", "number", FieldKind::int32);
  {
    RawParticipant stranger(domain_, type, "/stranger", false);
    GraphClient client(options());
    EXPECT_THAT(failure_of([&] { static_cast<void>(client.message_type("/strange")); }),
                HasSubstr("of another definition"));
  }
  RawParticipant stranger(domain_, type, "/teller", true);
  GraphClient client(options());
  EXPECT_EQ(client.message_type("/strange").hash(), type_hash(type));
}

}  // namespace
}  // namespace doppel::ros2
