// The published faults of DDS implementations, and mutations of valid and faulty datagrams, sent to a twin
// that is open to this machine and to one that is open to the subnet: it neither ends, nor grows without
// bound, nor stands still.
//
// DOPPEL_MUTATED_DATAGRAMS is how many mutations are sent (default 100000).

#include "doppel/ros/network/test/published_faults.h"

#include <control_msgs.h>
#include <gtest/gtest.h>
#include <rcl_interfaces.h>
#include <sensor_msgs.h>
#include <trajectory_msgs.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <random>

#include "fast_peer.h"
#include "hostile_datagrams.h"
#include "twin_process.h"

namespace doppel::ros2_testing {
namespace {

constexpr double kMaxGrowth = 200;  // MB, of the memory of a twin that is attacked

using sensor_msgs::msg::dds_::JointState_;

class PublishedFaults : public ::testing::TestWithParam<const char*> {
 protected:
  using ParameterClient = ServiceClient<rcl_interfaces::srv::dds_::GetParameters_Request_,
                                        rcl_interfaces::srv::dds_::GetParameters_Response_>;

  void SetUp() override {
    ports_ = twin_as_seen_by(peer_).second.ports;
    ASSERT_FALSE(ports_.empty()) << twin_.output();
    ASSERT_NO_FATAL_FAILURE(expect_answer());
  }
  void TearDown() override {
    if (HasFailure()) std::fputs(twin_.output().c_str(), stderr);
  }
  void expect_answer() {
    rcl_interfaces::srv::dds_::GetParameters_Request_ request;
    request.names_() = {"joints"};
    ASSERT_TRUE(twin_.process().running());
    ASSERT_TRUE(client_.call(request).has_value()) << "expected a response from a service";
  }
  void send(const Octets& datagram) const {
    for (const int port : ports_) socket_.send(port, datagram);
  }
  // A participant that the twin knows, with a writer of commands: its samples reach a reader.
  void announce(const Prefix& sender) const {
    send(RtpsPacket(sender).data(kParticipants, 1, valid_participant(sender).end()).bytes());
    const Announcement writer =
        valid_endpoint(sender, kUserWriter, "rt/omarm_arm_controller/joint_trajectory",
                       "trajectory_msgs::msg::dds_::JointTrajectory_");
    send(RtpsPacket(sender).data(kWriters, 1, writer.end()).range(7, kWriters, 1, 1, 1).bytes());
  }
  [[nodiscard]] double resident_megabytes() {
    std::ifstream file("/proc/" + std::to_string(twin_.process().pid()) + "/statm");
    double whole = 0, resident = 0;
    file >> whole >> resident;
    return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
  }
  // The twin's time, s.
  double twin_time() {
    states_.forget_all();
    const auto state = states_.next();
    EXPECT_TRUE(state.has_value()) << "expected joint states";
    return state ? state->header_().stamp_().sec_() + 1e-9 * state->header_().stamp_().nanosec_() : 0;
  }

  static FastPeer::Options options() {
    FastPeer::Options options;
    options.reach = GetParam() == std::string("SUBNET") ? Reach::subnet : Reach::loopback;
    return options;
  }

  TwinProcess twin_{{}, "omarm_one", GetParam()};
  FastPeer peer_{own_domain(), options()};
  ParameterClient client_{peer_, "/omarm_arm_controller/get_parameters"};
  Subscription<JointState_> states_ = peer_.subscribe<JointState_>("rt/joint_states");
  DatagramSocket socket_;
  std::vector<int> ports_;
};

Prefix sender_number(std::uint32_t number) {
  Prefix sender{1, 15, 0x66};
  for (std::size_t i = 0; i < 4; ++i) sender[4 + i] = static_cast<std::uint8_t>(number >> (8 * i));
  return sender;
}

TEST_P(PublishedFaults, NeitherEndNorBlockTwin) {
  const double before = resident_megabytes();
  const std::size_t count = published_faults(sender_number(0)).size();
  for (std::uint32_t i = 0; i < count; ++i) {
    const Prefix sender = sender_number(i);
    const PublishedFault fault = published_faults(sender)[i];
    SCOPED_TRACE(fault.name);
    announce(sender);
    for (int times = 0; times < 20; ++times) {
      std::ranges::for_each(fault.datagrams, [&](const Octets& datagram) { send(datagram); });
    }
    ASSERT_NO_FATAL_FAILURE(expect_answer());
  }
  const double grown = resident_megabytes() - before, begun = twin_time();
  EXPECT_LT(grown, kMaxGrowth) << "MB";
  EXPECT_GT(twin_time(), begun);
  std::printf("%s: %zu faults, memory %+.0f MB\n", GetParam(), count, grown);
}

TEST_P(PublishedFaults, MutationsNeitherEndNorBlockTwin) {
  const char* const text = std::getenv("DOPPEL_MUTATED_DATAGRAMS");
  const long count = text != nullptr ? std::atol(text) : 100'000;
  constexpr unsigned kSeed = 34;
  constexpr std::uint32_t kSenders = 20;
  std::mt19937 random(kSeed);
  std::vector<Octets> originals;
  for (std::uint32_t i = 0; i < kSenders; ++i) {
    const Prefix sender = sender_number(1000 + i);
    announce(sender);
    for (const PublishedFault& fault : published_faults(sender)) {
      originals.insert(originals.end(), fault.datagrams.begin(), fault.datagrams.end());
    }
    originals.push_back(RtpsPacket(sender).data(kParticipants, 1, valid_participant(sender).end()).bytes());
    const Announcement reader =
        valid_endpoint(sender, {0, 0, 0x13, 4}, "rt/joint_states", "sensor_msgs::msg::dds_::JointState_");
    originals.push_back(
        RtpsPacket(sender).data(kReaders, 1, reader.end()).range(7, kReaders, 1, 1, 1).bytes());
    originals.push_back(RtpsPacket(sender)
                            .data(kUserWriter, 1, {0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0})
                            .range(7, kUserWriter, 1, 9, 2)
                            .bytes());
    originals.push_back(RtpsPacket(sender).range(8, kUserWriter, 3, 7, 0).bytes());
  }
  const double before = resident_megabytes(), begun = twin_time();
  const auto start = std::chrono::steady_clock::now();
  for (long sent = 0; sent < count; ++sent) {
    Octets datagram = originals[random() % originals.size()];
    if (random() % 8 == 0) {
      const Octets& other = originals[random() % originals.size()];
      datagram.insert(datagram.end(), other.begin() + 20, other.end());
    }
    for (unsigned flips = random() % 6; flips > 0; --flips) {
      // The first four bytes are the name of the protocol, without which nothing is read.
      datagram[4 + random() % (datagram.size() - 4)] = static_cast<std::uint8_t>(random());
    }
    if (random() % 16 == 0) datagram.resize(random() % datagram.size());
    socket_.send(ports_[static_cast<std::size_t>(sent) % ports_.size()], datagram);
    // The service also gives the twin time to read its sockets.
    if (sent % 1000 == 0) {
      ASSERT_NO_FATAL_FAILURE(expect_answer()) << sent << " sent, seed " << kSeed;
    }
  }
  const double grown = resident_megabytes() - before, passed = twin_time() - begun;
  const double took = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  EXPECT_LT(grown, kMaxGrowth) << "MB";
  EXPECT_GT(passed, 0.5 * took) << "expected the twin to keep its pace";
  std::printf("%s: %ld mutations, memory %+.0f MB, %.1f s of the twin in %.1f s\n", GetParam(), count, grown,
              passed, took);
}

INSTANTIATE_TEST_SUITE_P(Ranges, PublishedFaults, ::testing::Values("LOCALHOST", "SUBNET"),
                         [](const auto& range) { return std::string(range.param); });

}  // namespace
}  // namespace doppel::ros2_testing
