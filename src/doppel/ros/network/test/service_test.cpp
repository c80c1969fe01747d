#include "doppel/ros/network/service.h"

#include "network.h"

namespace doppel::ros2::test {
namespace {

ServiceSpec trigger() {
  return {"/arm/go", "std_srvs/srv/Trigger", "RIHS01_" + std::string(64, '1'),
          "RIHS01_" + std::string(64, '2')};
}

class ServiceClientTest : public testing::Test {
 protected:
  OwnDomain domain_;
  Activity activity_;
  std::unique_ptr<Participant> here_ = make_participant(on_domain(domain_), activity_.signal());
  std::unique_ptr<Participant> there_ = make_participant(on_domain(domain_), activity_.signal());
  ServiceServer server_{*here_, trigger()};

  bool await_request(Sample& request) {
    return activity_.wait([&] { return server_.take(request); });
  }
  bool await_answer(const Sample& request, const Bytes& cdr) {
    return activity_.wait([&] { return server_.respond(request.related, cdr) == ServiceServer::Sent::yes; });
  }
};

TEST_F(ServiceClientTest, EachClientReceivesOwnResponse) {
  ServiceClient first(*there_, trigger()), second(*there_, trigger());
  ASSERT_TRUE(activity_.wait([&] { return first.is_available() && second.is_available(); }));
  ASSERT_EQ(first.send(cdr_text("first")), 1);
  ASSERT_EQ(second.send(cdr_text("second")), 1);
  for (int i = 0; i < 2; ++i) {
    Sample request;
    ASSERT_TRUE(await_request(request));
    ASSERT_TRUE(await_answer(request, request.cdr));
  }
  Sample reply;
  ASSERT_TRUE(activity_.wait([&] { return first.take(reply); }));
  EXPECT_EQ(reply.cdr, cdr_text("first"));
  EXPECT_EQ(reply.related.sequence, 1);
  ASSERT_TRUE(activity_.wait([&] { return second.take(reply); }));
  EXPECT_EQ(reply.cdr, cdr_text("second"));
  EXPECT_FALSE(first.take(reply));
}

TEST_F(ServiceClientTest, ReplyReaderIsInStepAfterAcknowledgement) {
  const ServiceClient client(*there_, trigger());
  const Gid reader = client.replies().gid();
  EXPECT_FALSE(server_.replies().is_in_step(reader));
  EXPECT_TRUE(activity_.wait([&] { return server_.replies().is_in_step(reader); }));
  EXPECT_TRUE(server_.replies().is_matched(reader));
}

// Otherwise each of forty clients receives the responses of all, and its own is lost among them.
TEST_F(ServiceClientTest, ResponseIsSentToClientParticipantOnly) {
  const auto elsewhere = make_participant(on_domain(domain_), activity_.signal());
  const ServiceClient other(*elsewhere, trigger());
  ServiceClient client(*there_, trigger());
  const auto are_in_step = [&] {
    return server_.replies().is_in_step(other.replies().gid()) &&
           server_.replies().is_in_step(client.replies().gid());
  };
  ASSERT_TRUE(activity_.wait([&] { return client.is_available() && other.is_available() && are_in_step(); }));
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(client.send(cdr_text("x")));
    Sample request, reply;
    ASSERT_TRUE(await_request(request));
    ASSERT_TRUE(await_answer(request, request.cdr));
    ASSERT_TRUE(activity_.wait([&] { return client.take(reply); }));
    EXPECT_EQ(reply.related.sequence, i + 1);
  }
  EXPECT_FALSE(other.replies().is_ready());
}

TEST_F(ServiceClientTest, RequestBurstWaitsForServer) {
  ServiceClient client(*there_, trigger());
  // The server must have discovered the client, too: until then responses are kept with depth ten only.
  ASSERT_TRUE(activity_.wait([&] { return client.is_available() && server_.requests().matched() == 1; }));
  constexpr int kRequests = 50;
  for (int i = 0; i < kRequests; ++i) ASSERT_TRUE(client.send(cdr_text("x")));
  int taken = 0;
  Sample request;
  EXPECT_TRUE(activity_.wait([&] {
    while (server_.take(request)) ++taken;
    return taken == kRequests;
  })) << taken;
}

TEST_F(ServiceClientTest, DestroyedServerIsUnavailable) {
  ServiceClient client(*here_, trigger());
  {
    const ServiceServer other(*there_, trigger());
    ASSERT_TRUE(activity_.wait([&] { return client.is_available(); }));
  }
  EXPECT_TRUE(activity_.wait([&] { return !client.is_available(); }));
}

TEST_F(ServiceClientTest, DestroyedClientIsReported) {
  Sample request;
  {
    ServiceClient client(*there_, trigger());
    ASSERT_TRUE(activity_.wait([&] { return client.is_available(); }));
    client.send(cdr_text("x"));
    ASSERT_TRUE(await_request(request));
  }
  EXPECT_TRUE(activity_.wait(
      [&] { return server_.respond(request.related, request.cdr) == ServiceServer::Sent::client_gone; }));
}

// Otherwise a peer that names another reader with every request would exhaust the memory.
TEST_F(ServiceClientTest, OneReaderPerClientIsKept) {
  const auto writer =
      there_->make_writer({"rq/arm/goRequest", "std_srvs::srv::dds_::Trigger_Request_", "", services_qos()});
  ASSERT_TRUE(
      activity_.wait([&] { return writer->matched() == 1 && server_.requests().is_matched(writer->gid()); }));
  const auto ask_for_answer_at = [&](std::uint8_t reader) {
    SampleIdentity answer_to{writer->gid(), 0};
    answer_to.writer.bytes[14] = reader;
    answer_to.writer.bytes[15] = 0x04;  // a reader without key
    writer->write(cdr_text("x"), &answer_to);
    Sample request;
    EXPECT_TRUE(await_request(request));
    return request.related;
  };
  const SampleIdentity first = ask_for_answer_at(1), second = ask_for_answer_at(2);
  EXPECT_EQ(server_.respond(second, cdr_text("x")), ServiceServer::Sent::not_yet_matched);
  EXPECT_EQ(server_.respond(first, cdr_text("x")), ServiceServer::Sent::client_gone);
}

TEST_F(ServiceClientTest, RequestWithoutReaderIsAnsweredToWriter) {
  const EndpointSpec requests{"rq/arm/goRequest", "std_srvs::srv::dds_::Trigger_Request_", "",
                              services_qos()};
  const EndpointSpec replies{"rr/arm/goReply", "std_srvs::srv::dds_::Trigger_Response_", "", services_qos()};
  const auto writer = there_->make_writer(requests);
  const auto reader = there_->make_reader(replies);
  ASSERT_TRUE(activity_.wait([&] { return writer->matched() == 1 && reader->matched() == 1; }));
  ASSERT_TRUE(activity_.wait([&] { return server_.replies().matched() == 1; }));
  const auto sent = writer->write(cdr_text("x"));
  Sample request, reply;
  ASSERT_TRUE(await_request(request));
  ASSERT_TRUE(await_answer(request, request.cdr));
  ASSERT_TRUE(activity_.wait([&] { return reader->take(reply); }));
  EXPECT_EQ(reply.related, *sent);
}

TEST_F(ServiceClientTest, EndpointsCarryTypeHashes) {
  for (const EndpointInfo& e : here_->endpoints())
    EXPECT_EQ(e.type_hash, e.is_writer ? trigger().response_hash : trigger().request_hash);
}

}  // namespace
}  // namespace doppel::ros2::test
