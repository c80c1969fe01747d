#include "doppel/ros/network/detail/rtps_discovery.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "doppel/ros/network/detail/rtps_guard.h"
#include "doppel/ros/network/test/published_faults.h"

namespace doppel::ros2 {
namespace {

using namespace ros2_testing;  // NOLINT(google-build-using-namespace)  // of the datagrams

constexpr Prefix kSender{1, 15, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};

Gid gid_of(const Prefix& sender) {
  Gid gid;
  std::ranges::copy(sender, gid.bytes.begin());
  return gid;
}

// A receiver that knows kSender.
struct Receiver {
  Receiver() { endpoints->join(gid_of(kSender)); }
  std::shared_ptr<AnnouncedEndpoints> endpoints = std::make_shared<AnnouncedEndpoints>();
  RtpsDiscovery discovery{endpoints};
};

std::optional<Octets> reduced(RtpsDiscovery& discovery, const Octets& datagram) {
  const auto result = discovery.reduced(datagram);
  if (!result) return std::nullopt;
  return Octets(result->begin(), result->end());
}

std::optional<Octets> reduced(const Octets& datagram) {
  Receiver receiver;
  return reduced(receiver.discovery, datagram);
}

Octets with_participant(const Announcement& announcement) {
  return RtpsPacket(kSender).data(kParticipants, 1, announcement.end()).bytes();
}

TEST(RtpsDiscovery, ValidAnnouncementsPassUnchanged) {
  const Octets participant = with_participant(valid_participant(kSender));
  EXPECT_EQ(reduced(participant), participant);
  const Octets endpoint =
      RtpsPacket(kSender)
          .data(kWriters, 1, valid_endpoint(kSender, kUserWriter, "rt/chatter", "T").end())
          .bytes();
  EXPECT_EQ(reduced(endpoint), endpoint);
}

TEST(RtpsDiscovery, OnlyAnnouncementsAreTreated) {
  EXPECT_TRUE(has_announcement(with_participant(valid_participant(kSender))));
  EXPECT_FALSE(has_announcement(RtpsPacket(kSender).data(kUserWriter, 1, Octets(64, 0xff)).bytes()));
}

TEST(RtpsDiscovery, OtherSubmessagesPassUnchanged) {
  const Octets sample =
      RtpsPacket(kSender).data(kUserWriter, 1, Octets(64, 0xff)).range(7, kUserWriter, 1, 1, 1).bytes();
  EXPECT_EQ(reduced(sample), sample);
}

TEST(RtpsDiscovery, ParametersThatAreNotNeededBecomePadding) {
  const Announcement before = valid_participant(kSender);
  const Octets token = words({7, 0x41414141}), user_data = words({4, 0x3b413d61});
  Octets expected = with_participant(Announcement(before).with(0x0000, token).with(0x2c, user_data));
  EXPECT_EQ(reduced(with_participant(Announcement(before).with(0x1001, token).with(0x2c, user_data))),
            expected);
}

TEST(RtpsDiscovery, MalformedNeededParameterIsRefused) {
  const auto is_admitted = [&](std::uint16_t id, const Octets& value) {
    return reduced(with_participant(valid_participant(kSender).with(id, value))).has_value();
  };
  EXPECT_TRUE(is_admitted(0x2c, words({4, 0})));
  EXPECT_FALSE(is_admitted(0x2c, words({5, 0}))) << "user data beyond its parameter";
  EXPECT_FALSE(is_admitted(0x2c, words({0xffffffff, 0})));
  EXPECT_TRUE(is_admitted(0x62, text("/")));
  EXPECT_FALSE(is_admitted(0x62, words({4, 0x41414141}))) << "a name without its zero byte";
  EXPECT_FALSE(is_admitted(0x31, words({1, 7400}))) << "a short address";
  EXPECT_FALSE(is_admitted(0x02, words({0, 0}))) << "a lease of zero";
  EXPECT_FALSE(is_admitted(0x02, words({0x80000000, 0}))) << "a negative lease";
  Octets endless = valid_participant(kSender).end();
  endless.resize(endless.size() - 4);
  EXPECT_FALSE(reduced(RtpsPacket(kSender).data(kParticipants, 1, endless).bytes()));
}

std::vector<Octets> in_fragments(const Octets& whole, std::uint32_t size) {
  std::vector<Octets> all;
  for (std::size_t begin = 0; begin < whole.size(); begin += size) {
    const Octets part(whole.begin() + begin, whole.begin() + std::min(whole.size(), begin + size));
    const auto number = static_cast<std::uint32_t>(begin / size + 1);
    all.push_back(
        RtpsPacket(kSender)
            .fragment(kParticipants, 7, number, 1, size, static_cast<std::uint32_t>(whole.size()), part)
            .bytes());
  }
  return all;
}

TEST(RtpsDiscovery, FragmentsOfAnnouncementBecomeOneSampleInAnyOrder) {
  const Octets whole = valid_participant(kSender).end();
  const Octets expected = RtpsPacket(kSender).data(kParticipants, 7, whole).bytes();
  const Octets header = RtpsPacket(kSender).bytes();
  std::vector<Octets> parts = in_fragments(whole, 48);
  ASSERT_GT(parts.size(), 2u);
  for (const bool backwards : {false, true}) {
    Receiver receiver;
    if (backwards) std::ranges::reverse(parts);
    for (std::size_t i = 0; i + 1 < parts.size(); ++i) {
      EXPECT_EQ(reduced(receiver.discovery, parts[i]), header);
      EXPECT_EQ(reduced(receiver.discovery, parts[i]), header) << "expected a repetition to change nothing";
    }
    EXPECT_EQ(reduced(receiver.discovery, parts.back()), expected);
  }
}

TEST(RtpsDiscovery, FragmentsOfLargeOrChangedAnnouncementAreRefused) {
  const auto fragment = [](std::uint32_t size, std::uint32_t whole) {
    return RtpsPacket(kSender).fragment(kParticipants, 1, 1, 1, size, whole, Octets(size)).bytes();
  };
  Receiver receiver;
  EXPECT_FALSE(reduced(receiver.discovery, fragment(64, kMaxAnnouncement + 1)));
  EXPECT_TRUE(reduced(receiver.discovery, fragment(64, 640)));
  EXPECT_FALSE(reduced(receiver.discovery, fragment(64, 641)));
  EXPECT_FALSE(reduced(receiver.discovery, fragment(128, 640)));
}

TEST(RtpsDiscovery, OldestOfTooManyOpenAnnouncementsIsForgotten) {
  const Octets whole = valid_participant(kSender).end();
  const std::vector<Octets> parts = in_fragments(whole, 64);
  ASSERT_EQ(parts.size(), 2u);
  Receiver receiver;
  ASSERT_TRUE(reduced(receiver.discovery, parts[0]));
  for (std::uint32_t sequence = 100; sequence < 100 + kMaxOpenAnnouncements; ++sequence) {
    ASSERT_TRUE(
        reduced(receiver.discovery,
                RtpsPacket(kSender).fragment(kParticipants, sequence, 1, 1, 64, 640, Octets(64)).bytes()));
  }
  EXPECT_EQ(reduced(receiver.discovery, parts[1]), RtpsPacket(kSender).bytes())
      << "expected the first part to be forgotten";
}

Octets with_reader(std::uint32_t reliability, std::uint32_t period = 7) {
  const Announcement reader = valid_endpoint(kSender, {0, 0, 0x13, 4}, "rt/joint_states", "T")
                                  .with(0x23, words({period, 0}))
                                  .with(0x1a, words({reliability, 0, 0}));
  return RtpsPacket(kSender).data(kReaders, 1, reader.end()).bytes();
}

// Fast DDS 2.9 accepts such an update, and an assertion ends the process at the next sample for the reader.
TEST(RtpsDiscovery, EndpointThatChangesItsReliabilityIsRefused) {
  Receiver receiver;
  EXPECT_TRUE(reduced(receiver.discovery, with_reader(1)));
  EXPECT_TRUE(reduced(receiver.discovery, with_reader(1, 8))) << "expected a deadline to be able to change";
  EXPECT_FALSE(reduced(receiver.discovery, with_reader(2)));
}

// Fast DDS may still be removing the endpoint when its participant is discovered anew.
TEST(RtpsDiscovery, PoliciesOfEndpointHoldWhenItsParticipantReturns) {
  Receiver receiver;
  EXPECT_TRUE(reduced(receiver.discovery, with_reader(1)));
  receiver.endpoints->leave(gid_of(kSender));
  EXPECT_FALSE(reduced(receiver.discovery, with_reader(1))) << "the participant is not present";
  receiver.endpoints->join(gid_of(kSender));
  EXPECT_FALSE(reduced(receiver.discovery, with_reader(2)));
  EXPECT_TRUE(reduced(receiver.discovery, with_reader(1)));
}

TEST(RtpsDiscovery, EndpointsAreLimitedAndThoseOfEarliestDepartureForgotten) {
  AnnouncedEndpoints endpoints;
  const auto endpoint = [](std::uint8_t participant, std::size_t number) {
    Gid gid = gid_of(kSender);
    gid.bytes[0] = participant;
    gid.bytes[13] = static_cast<std::uint8_t>(number >> 8);
    gid.bytes[14] = static_cast<std::uint8_t>(number);
    return gid;
  };
  for (const std::uint8_t participant : {1, 2, 3}) endpoints.join(endpoint(participant, 0));
  const std::size_t half = kMaxAnnouncedEndpoints / 2;
  for (std::size_t i = 0; i < half; ++i) {
    ASSERT_TRUE(endpoints.admits(endpoint(1, i), 1));
    ASSERT_TRUE(endpoints.admits(endpoint(2, i), 1));
  }
  EXPECT_FALSE(endpoints.admits(endpoint(3, 0), 1));
  endpoints.leave(endpoint(2, 0));
  EXPECT_TRUE(endpoints.admits(endpoint(3, 0), 1));
  EXPECT_FALSE(endpoints.admits(endpoint(1, 0), 2)) << "expected those of a present participant to be kept";
  EXPECT_FALSE(endpoints.admits(endpoint(2, 0), 1));
  endpoints.join(endpoint(2, 0));
  EXPECT_TRUE(endpoints.admits(endpoint(2, 0), 2)) << "expected those of the one that left to be forgotten";
}

TEST(RtpsDiscovery, PublishedFaultsAreRefusedOrBlanked) {
  for (const auto& fault : published_faults(kSender)) {
    SCOPED_TRACE(fault.name);
    RtpsGuard guard;
    Receiver receiver;
    std::optional<Octets> result;
    for (const Octets& datagram : fault.datagrams) {
      result.reset();
      if (guard.admits(datagram))
        result = !has_announcement(datagram) ? datagram : reduced(receiver.discovery, datagram);
    }
    EXPECT_EQ(result.has_value(), fault.treatment != Treatment::refused);
    if (!result || fault.treatment != Treatment::blanked) continue;
    EXPECT_NE(*result, fault.datagrams.back());
    // What remains is what a sound receiver makes of it: nothing changes at the second pass.
    EXPECT_EQ(reduced(*result), *result);
  }
}

}  // namespace
}  // namespace doppel::ros2
