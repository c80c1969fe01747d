// What the network can do to a participant: no free ports, garbage, traffic during its destruction.

#include "network.h"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <atomic>
#include <random>

namespace doppel::ros2::test {
namespace {

class Socket {
 public:
  Socket() : fd_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}
  ~Socket() { ::close(fd_); }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  [[nodiscard]] bool take_port(std::uint32_t port) const {
    const sockaddr_in where = loopback(port);
    return ::bind(fd_, reinterpret_cast<const sockaddr*>(&where), sizeof where) == 0;
  }
  void send(std::uint32_t port, const std::vector<std::uint8_t>& bytes) const {
    const sockaddr_in where = loopback(port);
    ::sendto(fd_, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&where), sizeof where);
  }

 private:
  static sockaddr_in loopback(std::uint32_t port) {
    sockaddr_in where{};
    where.sin_family = AF_INET;
    where.sin_port = htons(static_cast<std::uint16_t>(port));
    where.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return where;
  }
  int fd_;
};

std::uint32_t first_port(const OwnDomain& domain) {
  return 7400 + 250 * domain.id() + 10;
}

TEST(Participant, NoFreePortIsReported) {
  const OwnDomain domain;
  std::vector<std::unique_ptr<Socket>> taken;
  for (std::uint32_t i = 0; i < 240; i += 2) {  // one port of each pair is enough
    taken.push_back(std::make_unique<Socket>());
    ASSERT_TRUE(taken.back()->take_port(first_port(domain) + i));
  }
  try {
    make_participant(on_domain(domain), [] {});
    FAIL() << "expected a NetworkError: no port is free";
  } catch (const NetworkError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("domain " + std::to_string(domain.id())), std::string::npos) << text;
    EXPECT_NE(text.find("ROS_DOMAIN_ID"), std::string::npos) << text;
  }
  taken.pop_back();
  EXPECT_TRUE(make_participant(on_domain(domain), [] {}));
}

TEST(Participant, RangeOffDiscoversNobody) {
  const OwnDomain domain;
  Activity activity;
  ParticipantOptions options = on_domain(domain);
  const auto here = make_participant(options, activity.signal());
  const auto there = make_participant(options, activity.signal());
  options.range = DiscoveryRange::off;
  const auto off = make_participant(options, activity.signal());
  const auto writer = here->make_writer(text_topic());
  const auto reader = there->make_reader(text_topic());
  const auto deaf = off->make_reader(text_topic());
  ASSERT_TRUE(activity.wait([&] { return reader->matched() == 1; }));
  EXPECT_EQ(here->participants().size(), 2u);
  EXPECT_EQ(off->participants().size(), 1u);
  EXPECT_EQ(deaf->matched(), 0u);
}

// Two participants, one of which receives from the other.
struct Pair {
  OwnDomain domain;
  Activity activity;
  std::unique_ptr<Participant> here = make_participant(on_domain(domain), activity.signal());
  std::unique_ptr<Participant> there = make_participant(on_domain(domain), activity.signal());
  std::unique_ptr<Writer> writer = here->make_writer(text_topic());
  std::unique_ptr<Reader> reader = there->make_reader(text_topic());

  bool meet() {
    return activity.wait([&] { return writer->matched() == 1 && reader->matched() == 1; });
  }
  void expect_to_be_heard() {
    writer->write(cdr_text("still here"));
    Sample sample;
    ASSERT_TRUE(activity.wait([&] { return reader->take(sample); }));
    EXPECT_EQ(sample.cdr, cdr_text("still here"));
  }
};

// Fast DDS fills a datagram up to 65,500 bytes and then adds its statistics. One that was cut off would be refused, at
// every repetition, and the endpoints in it would never be found.
TEST(Participant, DatagramLongerThanLimitOfFastDdsIsReadWhole) {
  Pair pair;
  ASSERT_TRUE(pair.meet());
  std::vector<std::uint8_t> datagram{'R', 'T', 'P', 'S', 2, 3, 1, 15};
  datagram.resize(20, 7);  // of a stranger
  constexpr std::uint16_t kPads = 65480;
  for (const int byte : {0x01, 0x01, kPads & 0xff, kPads >> 8})
    datagram.push_back(static_cast<std::uint8_t>(byte));
  datagram.resize(65504, 0);
  const Socket sender;
  for (int i = 0; i < 20; ++i) sender.send(first_port(pair.domain), datagram);
  pair.expect_to_be_heard();
  EXPECT_EQ(pair.here->refused_datagrams() + pair.there->refused_datagrams(), 0u);
}

// Statistics would make Fast DDS add writers, and abort the process when a peer's counters decrease.
TEST(Participant, PeerStatisticsAreDisabled) {
  setenv("FASTDDS_STATISTICS", "NETWORK_LATENCY_TOPIC;RTPS_SENT_TOPIC", 1);
  EXPECT_THROW(make_participant(on_domain(OwnDomain()), [] {}), NetworkError);
  forget_statistics();
  Pair pair;
  ASSERT_TRUE(pair.meet());
  EXPECT_EQ(pair.here->endpoints().size(), 2u);
  EXPECT_EQ(pair.there->endpoints().size(), 2u);
}

TEST(Participant, GarbageIsIgnored) {
  Pair pair;
  ASSERT_TRUE(pair.meet());
  const auto known = pair.there->endpoints().size();

  const Socket stranger;
  std::mt19937 random(1);  // the same garbage in each run
  for (int i = 0; i < 2000; ++i) {
    std::vector<std::uint8_t> bytes(random() % 300);
    for (auto& b : bytes) b = static_cast<std::uint8_t>(random());
    const std::string_view start = "RTPS\x02\x03\x01\x0f";
    if (i % 2 == 0 && bytes.size() > start.size()) std::copy(start.begin(), start.end(), bytes.begin());
    stranger.send(first_port(pair.domain) + static_cast<std::uint32_t>(i) % 4, bytes);
  }
  pair.expect_to_be_heard();
  EXPECT_EQ(pair.there->endpoints().size(), known);
  EXPECT_GT(pair.here->refused_datagrams() + pair.there->refused_datagrams(), 0u);
}

// The announcement of a participant that does not exist, whose lease never ends.
std::vector<std::uint8_t> announcement(std::uint16_t number) {
  // clang-format off
  std::vector<std::uint8_t> bytes = {
      'R', 'T', 'P', 'S', 2, 3, 1, 15, 1, 15, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7,  // the header
      0x15, 0x05, 0, 0, 0, 0, 16, 0,                                         // DATA
      0, 1, 0, 0xc7, 0, 1, 0, 0xc2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 3, 0, 0,      // of discovery, the first sample
      0x15, 0, 4, 0, 2, 3, 0, 0, 0x16, 0, 4, 0, 1, 15, 0, 0,                 // version, vendor
      0x50, 0, 16, 0, 1, 15, 7, 7, 7, 7, 7, 7, 7, 7, 7, 7, 0, 0, 1, 0xc1,    // its GUID
      0x31, 0, 24, 0, 1, 0, 0, 0, 9, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 127, 0, 0, 1,  // its port
      0x32, 0, 24, 0, 1, 0, 0, 0, 9, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 127, 0, 0, 1,  // another
      0x02, 0, 8, 0, 0xff, 0xff, 0xff, 0x7f, 0, 0, 0, 0,                     // the lease
      0x58, 0, 4, 0, 0x3f, 0x0c, 0, 0, 1, 0, 0, 0,                           // its built-in endpoints
  };
  // clang-format on
  for (const std::size_t at : {18, 78}) {
    bytes[at] = static_cast<std::uint8_t>(number >> 8);
    bytes[at + 1] = static_cast<std::uint8_t>(number);
  }
  bytes[22] = static_cast<std::uint8_t>(bytes.size() - 24);
  return bytes;
}

TEST(Participant, ParticipantsBeyondLimitAreIgnored) {
  Pair pair;
  ASSERT_TRUE(pair.meet());
  const std::uint64_t middleware_log = pair.there->middleware_log().count;

  const Socket stranger;
  const auto announce = [&](std::uint16_t number) {
    for (std::uint32_t port : {0, 2}) stranger.send(first_port(pair.domain) + port, announcement(number));
  };
  std::uint16_t announced = 0;
  const auto are_full = [&](const Participant& participant) {
    return participant.participants().size() >= kMaxParticipants;
  };
  ASSERT_TRUE(pair.activity.wait([&] {
    for (int i = 0; i < 10 && announced < 10 * kMaxParticipants; ++i) announce(announced++);
    return are_full(*pair.here) && are_full(*pair.there);
  }));
  for (std::uint16_t i = 0; i < 50; ++i) announce(announced++);
  pair.expect_to_be_heard();
  EXPECT_EQ(pair.here->participants().size(), kMaxParticipants);
  EXPECT_EQ(pair.there->participants().size(), kMaxParticipants);
  EXPECT_GT(pair.there->middleware_log().count, middleware_log);
}

TEST(Participant, DestructionDuringTrafficIsSafe) {
  const OwnDomain domain;
  Activity activity;
  const auto here = make_participant(on_domain(domain), activity.signal());
  const auto writer = here->make_writer(text_topic());
  std::atomic<bool> stop{false};
  std::thread traffic([&] {
    const Bytes text = cdr_text(std::string(1000, 't'));
    while (!stop) writer->write(text);
  });
  for (int i = 0; i < 5; ++i) {
    const auto there = make_participant(on_domain(domain), activity.signal());
    const auto reader = there->make_reader(text_topic());
    Sample sample;
    EXPECT_TRUE(activity.wait([&] { return reader->take(sample); }));
  }
  stop = true;
  traffic.join();
}

// Each sample that it kept would cost each reader more with every heartbeat.
TEST(Participant, VolatileWriterDropsAcknowledgedSamples) {
  constexpr auto kPeriod = std::chrono::milliseconds(8);   // a sample waits for its acknowledgement for five
  constexpr auto kFirst = std::chrono::milliseconds(120);  // a reader's first acknowledgement comes after 70
  constexpr std::size_t kReaders = 20, kLast = 3;
  Pair pair;
  EndpointSpec spec = text_topic();
  spec.topic += "_of_many";
  spec.qos.depth = 1000;
  spec.of_service = true;  // requires acknowledgements every 20 ms
  const auto writer = pair.here->make_writer(spec);
  std::vector<std::unique_ptr<Reader>> readers;
  for (std::size_t i = 1; i <= kReaders; ++i) {
    readers.push_back(pair.there->make_reader(spec));
    const auto until = std::chrono::steady_clock::now() + kFirst;
    ASSERT_TRUE(pair.activity.wait([&] {
      writer->write(cdr_text("sample"));
      std::this_thread::sleep_for(kPeriod);
      return writer->matched() == i && std::chrono::steady_clock::now() > until;
    }));
  }
  for (std::size_t i = 0; i < kLast; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    writer->write(cdr_text("sample"));
  }
  EXPECT_LE(writer->forget(), kLast);
}

}  // namespace
}  // namespace doppel::ros2::test
