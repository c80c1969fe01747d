#pragma once
// Announcements of participants and endpoints, reduced to what this program uses before Fast DDS parses them.
//
// Most published faults of Fast DDS are in its parsers of the parameters of these announcements
// (CVE-2024-30258, CVE-2025-62599 to -62603 and -64098, CVE-2026-49861, -49863, -53589, -53590, -55063;
// SECURITY.md lists them), many of parameters that ROS 2 without DDS Security never needs: tokens, type
// objects, filters, properties. Those are blanked; the others are checked.

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "doppel/ros/network/detail/rtps.h"
#include "doppel/ros/network/participant.h"

namespace doppel::ros2 {

// The largest announcement; the largest of ROS 2's are a tenth of it.
constexpr std::size_t kMaxAnnouncement = 32 * 1024;
// Announcements whose fragments have not all arrived.
constexpr std::size_t kMaxOpenAnnouncements = 64;
// Endpoints of all participants, present ones and earlier ones.
constexpr std::size_t kMaxAnnouncedEndpoints = 2 * kMaxEndpoints;

// The endpoints that participants have announced, with their policies that never change. Any thread.
class AnnouncedEndpoints {
 public:
  // To be called when Fast DDS reports a participant. The policies of an endpoint hold beyond its
  // participant: Fast DDS may report one that has left while its endpoints are still being removed, and an
  // announcement may wait in Fast DDS for an earlier one.
  void join(const Gid& participant);
  void leave(const Gid& participant);
  // False for an endpoint of a participant that is not present, or with other policies than before, and where
  // those of present participants are too many.
  bool admits(const Gid& endpoint, std::uint64_t policies);

 private:
  using Prefix = std::array<std::uint8_t, Gid::kPrefixSize>;
  struct Participant {
    bool is_present = true;
    std::uint64_t departure = 0;  // its number, by which the earliest is found
    std::map<Gid, std::uint64_t> endpoints;
  };
  bool has_room();

  std::mutex mutex_;
  std::map<Prefix, Participant> participants_;
  std::size_t endpoints_ = 0;
  std::uint64_t departures_ = 0;
};

// Whether a datagram that RtpsGuard admits has announcements, or fragments of them.
bool has_announcement(std::span<const std::uint8_t> datagram);

// One thread at a time.
class RtpsDiscovery {
 public:
  explicit RtpsDiscovery(std::shared_ptr<AnnouncedEndpoints> endpoints) : endpoints_(std::move(endpoints)) {}
  // The datagram, which RtpsGuard admits, as Fast DDS may receive it: each parameter that is not needed
  // replaced by padding, and fragments of announcements by the whole at the last of them. The result is a
  // view of this object, until the next call; nothing if a needed parameter is malformed, or if
  // AnnouncedEndpoints refuses an endpoint.
  std::optional<std::span<const std::uint8_t>> reduced(std::span<const std::uint8_t> datagram);

 private:
  using Bytes = rtps::Bytes;
  using Sample = std::array<std::uint8_t, 24>;  // the writer, and its sequence number in its byte order
  struct Open {
    std::uint64_t age = 0;
    std::uint32_t fragment_size = 0;
    std::vector<std::uint8_t> bytes;
    std::vector<bool> received;  // by fragment
  };
  bool append_data(const rtps::Submessage& submessage, Bytes payload);
  bool append_fragment(const rtps::Submessage& submessage, Bytes payload, Bytes prefix);
  bool admits_endpoint(const rtps::Submessage& submessage, Bytes announcement);
  Open* open_announcement(const Sample& sample, std::uint32_t fragment_size, std::uint32_t whole);

  const std::shared_ptr<AnnouncedEndpoints> endpoints_;
  std::map<Sample, Open> open_;
  std::uint64_t age_ = 0;
  std::vector<std::uint8_t> result_;
};

}  // namespace doppel::ros2
