// What the network does to a participant: no ports, garbage, traffic in the middle of its end.

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

TEST(Network, WithoutAFreePortItIsSaidSo) {
  const OwnDomain domain;
  std::vector<std::unique_ptr<Socket>> taken;
  for (std::uint32_t i = 0; i < 240; i += 2) {  // one of each pair is enough
    taken.push_back(std::make_unique<Socket>());
    ASSERT_TRUE(taken.back()->take_port(first_port(domain) + i));
  }
  try {
    make_participant(on_domain(domain), [] {});
    FAIL() << "made without ports";
  } catch (const NetworkError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("domain " + std::to_string(domain.id())), std::string::npos) << text;
    EXPECT_NE(text.find("ROS_DOMAIN_ID"), std::string::npos) << text;
  }
  taken.pop_back();
  EXPECT_TRUE(make_participant(on_domain(domain), [] {}));
}

TEST(Network, WhoeverIsOffMeetsNobody) {
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

TEST(Network, GarbageChangesNothing) {
  const OwnDomain domain;
  Activity activity;
  const auto here = make_participant(on_domain(domain), activity.signal());
  const auto there = make_participant(on_domain(domain), activity.signal());
  const auto writer = here->make_writer(text_topic());
  const auto reader = there->make_reader(text_topic());
  ASSERT_TRUE(activity.wait([&] { return writer->matched() == 1 && reader->matched() == 1; }));
  const auto known = there->endpoints().size();

  const Socket stranger;
  std::mt19937 random(1);  // the same garbage every time
  for (int i = 0; i < 2000; ++i) {
    std::vector<std::uint8_t> bytes(random() % 300);
    for (auto& b : bytes) b = static_cast<std::uint8_t>(random());
    const std::string_view start = "RTPS\x02\x03\x01\x0f";
    if (i % 2 == 0 && bytes.size() > start.size()) std::copy(start.begin(), start.end(), bytes.begin());
    stranger.send(first_port(domain) + static_cast<std::uint32_t>(i) % 4, bytes);
  }
  writer->write(cdr_text("still here"));
  Sample sample;
  ASSERT_TRUE(activity.wait([&] { return reader->take(sample); }));
  EXPECT_EQ(sample.cdr, cdr_text("still here"));
  EXPECT_EQ(there->endpoints().size(), known);
  EXPECT_GT(here->refused_datagrams() + there->refused_datagrams(), 0u);
}

TEST(Network, AParticipantMayGoInTheMiddleOfTraffic) {
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

}  // namespace
}  // namespace doppel::ros2::test
