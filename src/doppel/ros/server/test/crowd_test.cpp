#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <thread>

#include "doppel/ros/messages/sensor_msgs.h"
#include "doppel/ros/server/server.h"
#include "doppel/ros/server/test/raw_client.h"
#include "doppel/ros/server/test/resident_memory.h"

// Fifty clients, half of which never read: the others receive every message in order, the loop that publishes
// never waits, and memory is bounded.

namespace doppel {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr std::size_t kMessages = 600, kReaders = 25, kSleepers = 25;
constexpr std::size_t kPadding =
    12'000;  // bytes of a message: 7 MB in total for each client, more than sockets can buffer
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
constexpr auto kPeriod = milliseconds(25);  // readers take five times as long
#else
constexpr auto kPeriod = milliseconds(10);
#endif
// kB: a queue of 1 MiB each, the messages in transit, and a margin.
constexpr long kMaxCrowdGrowth = growth_bound(80'000);

long waits_of_this_thread() {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_nvcsw;
}

// A loop that publishes messages continuously once started, and counts its own waits.
class Loop {
 public:
  Loop() : thread_([this] { run(); }) {
    while (!ready_) std::this_thread::yield();
  }
  ~Loop() {
    ending_ = true;
    thread_.join();
  }
  [[nodiscard]] Bus& bus() { return bus_; }
  void begin() { begun_ = true; }
  [[nodiscard]] long waits() const { return waits_; }
  // The time at which message `i` was published, since the clock's epoch.
  [[nodiscard]] std::chrono::nanoseconds published(std::size_t i) const {
    return std::chrono::nanoseconds(published_[i].load());
  }

 private:
  void run() {
    Node node(bus_, "/arm");
    const auto states = node.advertise<sensor_msgs::msg::JointState>("/joint_states");
    sensor_msgs::msg::JointState state;
    state.name = {std::string(kPadding, 'x')};
    ready_ = true;
    auto next = steady_clock::now();
    while (!ending_) {
      bus_.spin();
      if (begun_ && sent_ < kMessages) {
        published_[sent_] = steady_clock::now().time_since_epoch().count();
        const long before = waits_of_this_thread();
        states.publish(state, time_from_nanoseconds(static_cast<std::int64_t>(sent_)));
        waits_ += waits_of_this_thread() - before;
        ++sent_;
      }
      // After a delay on a busy machine it does not catch up: a burst would exceed a client's queue.
      next = std::max(next + kPeriod, steady_clock::now());
      std::this_thread::sleep_until(next);
    }
  }

  Bus bus_;
  std::atomic<bool> ready_ = false, begun_ = false, ending_ = false;
  std::atomic<std::size_t> sent_ = 0;
  std::atomic<long> waits_ = 0;
  std::array<std::atomic<std::int64_t>, kMessages> published_{};
  std::thread thread_;
};

std::unique_ptr<test::RawClient> subscriber(std::uint16_t port) {
  auto client = std::make_unique<test::RawClient>(port);
  EXPECT_EQ(client->handshake(), "");
  const auto offers = client->receive_op("advertise");
  for (const auto& channel : offers["channels"]) {
    if (channel["topic"] != "/joint_states") continue;
    client->send(R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":)" + channel["id"].dump() + "}]}");
  }
  client->send(R"({"op":"getParameters","parameterNames":[""],"id":"subscribed"})");
  client->receive_op("parameterValues");
  return client;
}

// Reads all messages; returns the latency of each.
std::vector<steady_clock::duration> read_all(test::RawClient& client, const Loop& loop) {
  std::vector<steady_clock::duration> delays;
  for (std::size_t stamp = 0; stamp + 1 < kMessages;) {
    const std::string frame = client.receive();
    if (frame[0] != 1) continue;
    std::memcpy(&stamp, frame.data() + 5, sizeof(stamp));
    if (stamp != delays.size()) {
      ADD_FAILURE() << "message " << stamp << " arrived after " << delays.size()
                    << " others; expected the order of publishing";
      break;
    }
    delays.push_back(steady_clock::now().time_since_epoch() - loop.published(std::min(stamp, kMessages - 1)));
  }
  return delays;
}

TEST(ServerLoad, NonReadingClientsDoNotDelayOthers) {
  Loop loop;
  const Log log;
  const Server server(loop.bus(), {.port = 0, .max_clients = 64, .client_queue_bytes = std::size_t{1} << 20},
                      log);
  std::vector<std::unique_ptr<test::RawClient>> sleepers, readers;
  for (std::size_t i = 0; i < kSleepers; ++i) sleepers.push_back(subscriber(server.port()));
  for (std::size_t i = 0; i < kReaders; ++i) readers.push_back(subscriber(server.port()));
  const long before = resident_kilobytes();
  std::vector<std::vector<steady_clock::duration>> delays(kReaders);
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < kReaders; ++i)
    threads.emplace_back([&, i] { delays[i] = read_all(*readers[i], loop); });
  loop.begin();
  for (std::thread& thread : threads) thread.join();
  // The first access to a page of memory may wait for another thread's mmap.
  EXPECT_LT(loop.waits(), 5) << "expected publishing not to block the loop's thread";
  EXPECT_GT(server.skipped(), kSleepers) << "expected the messages that no client reads to be skipped";
  EXPECT_LT(resident_kilobytes() - before, kMaxCrowdGrowth);
  std::vector<steady_clock::duration> all;
  for (const auto& one : delays) all.insert(all.end(), one.begin(), one.end());
  ASSERT_FALSE(all.empty());
  std::ranges::sort(all);
  RecordProperty("median_us", std::to_string(all[all.size() / 2] / std::chrono::microseconds(1)));
  RecordProperty("skipped", std::to_string(server.skipped()));
  EXPECT_TRUE(test::RawClient(server.port()).handshake().empty());
}

}  // namespace
}  // namespace doppel
