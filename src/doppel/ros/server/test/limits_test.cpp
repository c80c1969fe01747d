#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cstring>
#include <fstream>
#include <thread>

#include "doppel/ros/server/detail/rate_limit.h"
#include "doppel/ros/server/server.h"
#include "doppel/ros/server/test/fake_twin.h"
#include "doppel/ros/server/test/raw_client.h"
#include "doppel/ros/server/test/resident_memory.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(MessageLimit, BurstThenRateIsAllowed) {
  MessageLimit limit(10, 3);
  auto now = MessageLimit::Clock::now() + seconds(1);
  EXPECT_TRUE(limit.take(1, now) && limit.take(2, now));
  EXPECT_FALSE(limit.take(1, now));
  now += milliseconds(100);
  EXPECT_TRUE(limit.take(1, now));
  EXPECT_FALSE(limit.take(0.1, now));
  now += seconds(100);
  EXPECT_TRUE(limit.take(3, now));
  EXPECT_FALSE(limit.take(0.1, now)) << "expected unused allowance not to accumulate";
}

class ClientLimitsTest : public ::testing::Test {
 protected:
  std::unique_ptr<test::RawClient> join(ServerOptions options = {}) {
    options.port = 0;
    server_ = std::make_unique<Server>(twin_.bus(), options, log_);
    return another();
  }
  std::unique_ptr<test::RawClient> another() {
    auto client = std::make_unique<test::RawClient>(server_->port());
    EXPECT_EQ(client->handshake(), "");
    return client;
  }
  bool is_served() {
    const auto client = another();
    client->send(R"({"op":"getParameters","parameterNames":["/arm.rate"],"id":"x"})");
    return client->receive_op("parameterValues")["id"] == "x";
  }
  // Sends until the server closes the connection.
  static std::string flood(test::RawClient& client, const std::function<void()>& send) {
    try {
      for (int i = 0; i < 200'000; ++i) send();
    } catch (const boost::system::system_error&) {
      // closed while sending
    }
    return client.closing_reason();
  }

  Log log_;
  test::FakeTwin twin_;
  std::unique_ptr<Server> server_;
};

TEST_F(ClientLimitsTest, TooManyMessagesCloseWithReason) {
  const auto client = join({.messages_per_second = 100, .message_burst = 200});
  const std::string reason = flood(*client, [&] { client->send(R"({"op":"unadvertise","channelIds":[]})"); });
  EXPECT_TRUE(reason.empty() || reason.find("the limit is 100 messages per second") != std::string::npos)
      << reason;
  EXPECT_TRUE(is_served());
}

TEST_F(ClientLimitsTest, MessageBurstIsAccepted) {
  const auto client = join();
  client->send(
      R"({"op":"advertise","channels":[{"id":1,"topic":"/command","encoding":"cdr","schemaName":"std_msgs/msg/Float64"}]})");
  const auto frame = std::string("\x01\x01\0\0\0\x00\x01\0\0", 9) + std::string(8, '\0');
  for (int i = 0; i < 5000; ++i) client->send_binary(frame);
  client->send(R"({"op":"getParameters","parameterNames":["/arm.rate"],"id":"x"})");
  EXPECT_EQ(client->receive_op("parameterValues")["id"], "x");
  EXPECT_EQ(twin_.received(), 5000);
}

TEST_F(ClientLimitsTest, PingsAreCounted) {
  const auto client = join({.messages_per_second = 100, .message_burst = 200});
  const std::string ping("\x89\x80\0\0\0\0", 6);
  flood(*client, [&] { boost::asio::write(client->tcp(), boost::asio::buffer(ping)); });
  EXPECT_TRUE(is_served());
}

TEST_F(ClientLimitsTest, TooManyBytesClose) {
  const auto client = join({.bytes_per_second = 1e5, .byte_burst = 2e5});
  const std::string frame = std::string("\x01\x01\0\0\0", 5) + std::string(50'000, '\0');
  flood(*client, [&] { client->send_binary(frame); });
  EXPECT_TRUE(is_served());
}

TEST_F(ClientLimitsTest, LongTextFrameCloses) {
  const auto client = join({.max_text = 1000});
  client->send(R"({"op":"getParameters","id":")" + std::string(2000, 'x') + "\"}");
  EXPECT_THAT(client->closing_reason(), HasSubstr("a text frame is larger than 1000 bytes"));
  EXPECT_TRUE(is_served());
}

TEST_F(ClientLimitsTest, GrowingJsonIsRefused) {
  const auto client = join();
  client->send(
      R"({"op":"advertise","channels":[{"id":1,"topic":"/path","encoding":"json","schemaName":"trajectory_msgs/msg/JointTrajectory"}]})");
  const std::string head("\x01\x01\0\0\0", 5);
  std::string aliases = "{joint_names: &a [" + std::string(1000, 'x') + "], points: [";
  for (int i = 0; i < 1000; ++i) aliases += "{positions: *a},";
  for (const std::string& text :
       {aliases + "]}", std::string(100'000, '['), std::string(100'000, '[') + std::string(100'000, ']'),
        std::string(2'000'000, ' '), std::string("{\"a\":\xff}")}) {
    client->send_binary(head + text);
    EXPECT_THAT(client->receive_op("status")["message"].get<std::string>(), HasSubstr("rejected"))
        << text.substr(0, 40);
  }
  EXPECT_TRUE(is_served());
}

// Each sends many requests without waiting for their answers; all are answered, in the order of each
// client, and what waits is bounded.
TEST_F(ClientLimitsTest, PipelinedParameterRequestsOfManyClientsAreAnswered) {
  constexpr int kClients = 8, kRequests = 1000;
  constexpr long kMaxGrowth = growth_bound(60'000);  // kB; 2,000 answers of 120 kB unbounded are 240 MB
  twin_.on_loop([this] { twin_.add_parameters(2000); });
  join();
  const long before = resident_kilobytes();
  std::vector<std::thread> threads;
  std::atomic<int> in_order = 0;
  for (int c = 0; c < kClients; ++c) {
    threads.emplace_back([&] {
      const auto client = another();
      std::thread sender([&] {
        for (int i = 0; i < kRequests; ++i) {
          const char* const value = i % 2 == 0 ? "1.5" : "2.5";
          client->send(i % 4 == 3
                           ? fmt::format(R"({{"op":"getParameters","parameterNames":[],"id":"{}"}})", i)
                           : fmt::format(R"({{"op":"setParameters","id":"{}","parameters":)"
                                         R"([{{"name":"/arm.gains.p","value":{}}}]}})",
                                         i, value));
          std::this_thread::sleep_for(std::chrono::microseconds(200));
        }
      });
      for (int i = 0; i < kRequests; ++i) {
        if (client->receive_op("parameterValues")["id"] == std::to_string(i)) ++in_order;
      }
      sender.join();
    });
  }
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(is_served());
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(in_order, kClients * kRequests);
  EXPECT_LT(resident_kilobytes() - before, kMaxGrowth);
}

TEST_F(ClientLimitsTest, TopicOfClientEndsWithItsLastPublisher) {
  const auto watcher = join();
  const auto publish = [](test::RawClient& client) {
    client.send(
        R"({"op":"advertise","channels":[{"id":1,"topic":"/mine","encoding":"cdr",
            "schemaName":"std_msgs/msg/Float64"}]})");
    client.send_binary(std::string("\x01\x01\0\0\0\x00\x01\0\0", 9) + std::string(8, '\0'));
    client.send(R"({"op":"getParameters","parameterNames":["/arm.rate"],"id":"x"})");
    client.receive_op("parameterValues");
  };
  const auto has_topic = [this] {
    return std::ranges::any_of(twin_.bus().topics(), [](const TopicInfo& t) { return t.name == "/mine"; });
  };
  const auto first = another();
  publish(*first);
  {
    const auto second = another();
    publish(*second);
    first->send(R"({"op":"unadvertise","channelIds":[1]})");
    publish(*second);
    EXPECT_TRUE(has_topic()) << "expected the topic of the other publisher to stay";
  }
  for (int i = 0; i < 1000 && has_topic(); ++i) std::this_thread::sleep_for(milliseconds(10));
  EXPECT_FALSE(has_topic());
}

class AssetFetchTest : public ClientLimitsTest {
 protected:
  AssetFetchTest() {
    char name[] = "/tmp/doppel_fetch_XXXXXX";
    folder_ = mkdtemp(name);
    std::ofstream(folder_ / "package.xml") << "<package><name>arm</name></package>";
    RobotFiles files;
    files.description = folder_ / "arm.urdf";
    for (int i = 0; i < 20; ++i) {
      const std::string mesh = std::to_string(i) + ".stl";
      std::ofstream(folder_ / mesh) << "mesh " << i;
      files.meshes.push_back({"package://arm/" + mesh, folder_ / mesh});
    }
    fs::resize_file(folder_ / "0.stl", kLarge);
    library_->offer(files);
  }
  ~AssetFetchTest() override {
    server_.reset();
    fs::remove_all(folder_);
  }
  static void ask(test::RawClient& client, const std::string& uri, int request) {
    client.send(R"({"op":"fetchAsset","uri":")" + uri + R"(","requestId":)" + std::to_string(request) + "}");
  }
  // The next response to a fetch: its request id, and its text.
  static std::pair<std::uint32_t, std::string> answer(test::RawClient& client) {
    std::string frame;
    while (frame.size() < 10 || frame[0] != 4) frame = client.receive();
    std::uint32_t request = 0, length = 0;
    std::memcpy(&request, frame.data() + 1, 4);
    std::memcpy(&length, frame.data() + 6, 4);
    if (frame[5] != 0) return {request, "refused: " + frame.substr(10)};
    EXPECT_EQ(length, 0u);
    return {request, frame.substr(10)};
  }

  static constexpr std::size_t kLarge = std::size_t{40} << 20;
  fs::path folder_;
  std::shared_ptr<AssetLibrary> library_ = std::make_shared<AssetLibrary>();
};

TEST_F(AssetFetchTest, MeshesAreSentInRequestOrder) {
  const auto client = join({.assets = library_});
  EXPECT_THAT(client->receive_op("serverInfo")["capabilities"], Contains("assets"));
  for (int i = 1; i < 20; ++i) ask(*client, "package://arm/" + std::to_string(i) + ".stl", 100 + i);
  ask(*client, "package://arm/package.xml", 7);
  for (int i = 1; i < 20; ++i) {
    const auto [request, text] = answer(*client);
    EXPECT_EQ(request, 100u + static_cast<unsigned>(i));
    EXPECT_EQ(text, "mesh " + std::to_string(i));
  }
  const auto [request, text] = answer(*client);
  EXPECT_EQ(request, 7u);
  EXPECT_THAT(text, HasSubstr("refused: cannot fetch 'package://arm/package.xml'"));
  ask(*client, "package://arm/0.stl", 8);
  EXPECT_EQ(answer(*client).second.size(), kLarge);
}

TEST_F(AssetFetchTest, WithoutLibraryFetchIsRefused) {
  const auto client = join();
  EXPECT_THAT(client->receive_op("serverInfo")["capabilities"], Not(Contains("assets")));
  ask(*client, "package://arm/1.stl", 1);
  EXPECT_THAT(answer(*client).second, HasSubstr("refused: "));
}

TEST_F(AssetFetchTest, NonReadingClientIsStillServed) {
  const auto greedy = join({.assets = library_});
  for (int i = 0; i < 100; ++i) ask(*greedy, "package://arm/0.stl", i);
  std::this_thread::sleep_for(milliseconds(200));
  greedy->send(
      R"({"op":"advertise","channels":[{"id":1,"topic":"/command","encoding":"cdr","schemaName":"std_msgs/msg/Float64"}]})");
  greedy->send_binary(std::string("\x01\x01\0\0\0\x00\x01\0\0", 9) + std::string(8, '\0'));
  for (int i = 0; i < 1000 && twin_.received() == 0; ++i) std::this_thread::sleep_for(milliseconds(10));
  EXPECT_EQ(twin_.received(), 1) << "expected a command not to wait behind a mesh";
  const auto other = another();
  ask(*other, "package://arm/3.stl", 1);
  EXPECT_EQ(answer(*other).second, "mesh 3");
  EXPECT_EQ(answer(*greedy).second.size(), kLarge);
}

}  // namespace
}  // namespace doppel
