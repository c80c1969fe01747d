#pragma once
// One DDS participant: writers and readers of CDR bytes, and discovery. The conventions of ROS 2 (names,
// services, nodes) are in the other headers of this module; the implementation with Fast DDS is a plugin
// module that is loaded with the first participant (fastdds/fast_participant.cpp).
//
// Functions may be called from any thread, those of a Reader from one at a time. Nothing waits for the
// network, except Writer::write of a reliable writer with a full keep-all history: 10 ms, at most once
// in 100 ms.

#include <algorithm>
#include <array>
#include <chrono>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "doppel/export.h"
#include "doppel/ros/messages/codec.h"
#include "doppel/ros/network/qos_profile.h"

namespace doppel::ros2 {

// RTPS's GUID: twelve bytes for the participant, four for the endpoint.
struct DOPPEL_API Gid {
  static constexpr std::size_t kPrefixSize = 12;  // the participant's part
  std::array<std::uint8_t, 16> bytes{};
  friend auto operator<=>(const Gid&, const Gid&) = default;
  // The participant's part, which its endpoints have in common.
  [[nodiscard]] std::span<const std::uint8_t, kPrefixSize> prefix() const {
    return std::span(bytes).first<kPrefixSize>();
  }
};
inline bool is_same_participant(const Gid& a, const Gid& b) {
  return std::ranges::equal(a.prefix(), b.prefix());
}

// Identifies a sample by its writer and sequence number (from 1); relates a service's reply to its request.
struct SampleIdentity {
  Gid writer;
  std::int64_t sequence = 0;
  friend bool operator==(const SampleIdentity&, const SampleIdentity&) = default;
};

struct Sample {
  Bytes cdr;  // with the encapsulation header, and RTPS's padding to a multiple of four bytes
  SampleIdentity identity, related;
  std::int64_t source_timestamp = 0, reception_timestamp = 0;  // ns since the epoch, wall-clock time
};

// An endpoint from discovery, with the names of DDS, which names.h converts: "rt/joint_states",
// "sensor_msgs::msg::dds_::JointState_" and so on.
struct EndpointInfo {
  Gid gid;
  bool is_writer = false;
  std::string topic, type;
  std::string type_hash;  // "RIHS01_..."; "": not announced
  QosProfile qos;
  bool is_own = false;  // of this participant
};

struct ParticipantInfo {
  Gid gid;
  std::string name, enclave;
  friend bool operator==(const ParticipantInfo&, const ParticipantInfo&) = default;
};

// The options of a new endpoint.
struct EndpointSpec {
  std::string topic, type;  // DDS names
  std::string type_hash;    // goes into the user data as "typehash=...;"; "": left out
  QosProfile qos;
  // For a service's requests or replies: a client waits for each of them, so that lost samples are requested
  // sooner, and a writer provides is_in_step().
  bool of_service = false;
};

class DOPPEL_API Writer {
 public:
  virtual ~Writer() = default;
  [[nodiscard]] virtual const Gid& gid() const = 0;
  // The identity of the written sample. nullopt if the writer's history is full (reliable, keep all), also
  // within the following 100 ms, or if there are more bytes than kMaxSampleBytes (rtps_guard.h). `related` is
  // sent with the sample, as rmw_fastrtps relates replies to requests.
  virtual std::optional<SampleIdentity> write(std::span<const std::byte> cdr,
                                              const SampleIdentity* related = nullptr) = 0;
  // Drops the samples kept for later readers (transient local) or not yet acknowledged; returns their number.
  virtual std::size_t forget() = 0;
  [[nodiscard]] virtual std::size_t matched() const = 0;  // readers
  [[nodiscard]] virtual bool is_matched(const Gid& reader) const = 0;
  // For a writer of_service: whether the matched reader has acknowledged anything since the match. Before
  // that it may not have found this writer yet, and keeps received samples undelivered, up to the depth
  // of its history.
  [[nodiscard]] virtual bool is_in_step(const Gid& reader) const = 0;
};

class DOPPEL_API Reader {
 public:
  virtual ~Reader() = default;
  [[nodiscard]] virtual const Gid& gid() const = 0;
  // One load: whether samples may have arrived since the last take() that returned false.
  [[nodiscard]] virtual bool is_ready() const = 0;
  // Takes the oldest sample, reusing the memory of `sample`; false: there is none. Samples of this
  // participant's own writers are not delivered.
  virtual bool take(Sample& sample) = 0;
  [[nodiscard]] virtual std::size_t matched() const = 0;  // writers
  [[nodiscard]] virtual bool is_matched(const Gid& writer) const = 0;
  [[nodiscard]] virtual std::uint64_t lost() const = 0;  // samples that DDS reports as lost
};

// The middleware's warnings so far in this process, which are collected instead of printed.
struct MiddlewareLog {
  std::uint64_t count = 0;
  std::string latest;
};

struct ParticipantOptions;  // environment.h

// The largest number of participants and endpoints that a participant stores, including itself; further ones
// are ignored, with a warning, until some leave.
constexpr std::size_t kMaxParticipants = 250;
constexpr std::size_t kMaxEndpoints = 10'000;  // readers, and as many writers

class DOPPEL_API Participant {
 public:
  virtual ~Participant() = default;  // after its writers and readers
  [[nodiscard]] virtual const Gid& gid() const = 0;
  // Throw NetworkError: the topic is already used here with another type, or the QoS is invalid.
  [[nodiscard]] virtual std::unique_ptr<Writer> make_writer(const EndpointSpec& spec) = 0;
  [[nodiscard]] virtual std::unique_ptr<Reader> make_reader(const EndpointSpec& spec) = 0;

  // The result of discovery, including this participant; its version increases by one with every change.
  [[nodiscard]] virtual std::uint64_t discovery_version() const = 0;
  [[nodiscard]] virtual std::vector<EndpointInfo> endpoints() const = 0;
  [[nodiscard]] virtual std::vector<ParticipantInfo> participants() const = 0;
  [[nodiscard]] virtual MiddlewareLog middleware_log() const = 0;
  // The number of received datagrams that were not valid RTPS or would need absurd amounts of memory.
  [[nodiscard]] virtual std::uint64_t refused_datagrams() const = 0;
};

// Fast DDS's profile files (FASTRTPS_DEFAULT_PROFILES_FILE) do not apply to this participant: they are made
// for the transports of ROS 2 and could extend the range of `options`.
//
// `on_activity` is called on the middleware's threads whenever a reader has become ready, or something was
// matched, discovered or lost; it must neither block nor call the participant, and typically writes to an
// eventfd. Throws NetworkError: no usable network, no free port, an unknown static peer, Fast DDS is missing;
// the text contains the cause and the fix.
DOPPEL_API std::unique_ptr<Participant> make_participant(const ParticipantOptions& options,
                                                         std::function<void()> on_activity);

struct DOPPEL_API NetworkError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace doppel::ros2
