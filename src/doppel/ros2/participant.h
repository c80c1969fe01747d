#pragma once
// One participant on the network of DDS: writers and readers of CDR bytes, and who else is there. What ROS 2
// makes of it (names, services, nodes) stands in the headers beside this one; Fast DDS, which fulfils it, is
// loaded when the first participant is made (late/fast_participant.cpp).
//
// Functions may be called from any thread, a Reader from one at a time. Nothing here waits for the network,
// but Writer::write where all is kept: 10 ms, once in 100.

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
#include "doppel/messages/codec.h"
#include "doppel/ros2/qos_profile.h"

namespace doppel::ros2 {

// RTPS's GUID: twelve bytes for the participant, four for the endpoint.
struct DOPPEL_API Gid {
  static constexpr std::size_t kPrefixSize = 12;  // the participant's part
  std::array<std::uint8_t, 16> bytes{};
  friend auto operator<=>(const Gid&, const Gid&) = default;
  // The participant's part, by which its endpoints are known as its own.
  [[nodiscard]] std::span<const std::uint8_t, kPrefixSize> prefix() const {
    return std::span(bytes).first<kPrefixSize>();
  }
};
inline bool is_same_participant(const Gid& a, const Gid& b) {
  return std::ranges::equal(a.prefix(), b.prefix());
}

// Which sample: of which writer, its how-manieth (from 1). What joins a service's answer to its request.
struct SampleIdentity {
  Gid writer;
  std::int64_t sequence = 0;
  friend bool operator==(const SampleIdentity&, const SampleIdentity&) = default;
};

struct Sample {
  Bytes cdr;  // with the encapsulation header, and what RTPS pads to a multiple of four bytes
  SampleIdentity identity, related;
  std::int64_t source_timestamp = 0, reception_timestamp = 0;  // ns since the epoch, wall time
};

// As DDS tells it: mangled names ("rt/joint_states", "sensor_msgs::msg::dds_::JointState_"), names.h undoes
// them.
struct EndpointInfo {
  Gid gid;
  bool is_writer = false;
  std::string topic, type;
  std::string type_hash;  // "RIHS01_...", "" where the endpoint does not tell
  QosProfile qos;
  bool is_own = false;  // of this participant
};

struct ParticipantInfo {
  Gid gid;
  std::string name, enclave;
  friend bool operator==(const ParticipantInfo&, const ParticipantInfo&) = default;
};

// What an endpoint is made with.
struct EndpointSpec {
  std::string topic, type;  // DDS names
  std::string type_hash;    // goes into the user data as "typehash=...;"; "": left out
  QosProfile qos;
  // Carries a service's requests or replies: somebody waits for each of them, so that what was lost on the
  // way is requested sooner, and a writer keeps is_in_step().
  bool of_service = false;
};

class DOPPEL_API Writer {
 public:
  virtual ~Writer() = default;
  [[nodiscard]] virtual const Gid& gid() const = 0;
  // The identity of what was written; nothing where the writer's history is full (reliable, keep all), for
  // the next 100 ms either, or the bytes are more than kMaxSampleBytes (rtps_guard.h). `related` goes with
  // the sample, as rmw_fastrtps joins answers to requests.
  virtual std::optional<SampleIdentity> write(std::span<const std::byte> cdr,
                                              const SampleIdentity* related = nullptr) = 0;
  // Drops what is kept, for readers that come later (transient local) or have yet to acknowledge it; how many
  // samples that were.
  virtual std::size_t forget() = 0;
  [[nodiscard]] virtual std::size_t matched() const = 0;  // readers
  [[nodiscard]] virtual bool is_matched(const Gid& reader) const = 0;
  // Of a writer of_service: whether the reader, which is matched here, has acknowledged anything since. One
  // that has not may not have found this writer yet, and keeps what comes meanwhile undelivered, as deep as
  // its history is.
  [[nodiscard]] virtual bool is_in_step(const Gid& reader) const = 0;
};

class DOPPEL_API Reader {
 public:
  virtual ~Reader() = default;
  [[nodiscard]] virtual const Gid& gid() const = 0;
  // One load: whether something has come since the last take() that returned false.
  [[nodiscard]] virtual bool is_ready() const = 0;
  // The oldest sample not yet taken; keeps the memory of `sample`. Samples of this participant's own writers
  // never come.
  virtual bool take(Sample& sample) = 0;
  [[nodiscard]] virtual std::size_t matched() const = 0;  // writers
  [[nodiscard]] virtual bool is_matched(const Gid& writer) const = 0;
  [[nodiscard]] virtual std::uint64_t lost() const = 0;  // samples that DDS says were lost on the way
};

// What the middleware has had to complain of so far in this process; it goes here and not to the terminal.
struct MiddlewareLog {
  std::uint64_t count = 0;
  std::string latest;
};

struct ParticipantOptions;  // environment.h

// What a participant keeps of the network, itself included; who comes when it has so many, of either kind, is
// not seen until some leave, which is a complaint.
constexpr std::size_t kMaxParticipants = 250;
constexpr std::size_t kMaxEndpoints = 10'000;  // readers, and as many writers

class DOPPEL_API Participant {
 public:
  virtual ~Participant() = default;  // after its writers and readers
  [[nodiscard]] virtual const Gid& gid() const = 0;
  // Throw NetworkError: the topic is in use here with another type, or the QoS is impossible.
  [[nodiscard]] virtual std::unique_ptr<Writer> make_writer(const EndpointSpec& spec) = 0;
  [[nodiscard]] virtual std::unique_ptr<Reader> make_reader(const EndpointSpec& spec) = 0;

  // All that is known of the network, this participant's own included; grows by one with every change.
  [[nodiscard]] virtual std::uint64_t discovery_version() const = 0;
  [[nodiscard]] virtual std::vector<EndpointInfo> endpoints() const = 0;
  [[nodiscard]] virtual std::vector<ParticipantInfo> participants() const = 0;
  [[nodiscard]] virtual MiddlewareLog middleware_log() const = 0;
  // Of those that came here, how many were no messages of RTPS or asked for absurd amounts of memory.
  [[nodiscard]] virtual std::uint64_t refused_datagrams() const = 0;
};

// Fast DDS' own files of profiles (FASTRTPS_DEFAULT_PROFILES_FILE) do not touch this participant: they are
// made for the transports that ROS 2 uses and would reach beyond what `options` say.
//
// `on_activity` is called from the middleware's threads whenever a reader has become ready, or something was
// matched, discovered or lost; it must neither block nor call back (an eventfd's write is the thing). Throws
// NetworkError: no usable network, no free port, an unknown static peer, Fast DDS is missing; the text says
// which and what to do.
DOPPEL_API std::unique_ptr<Participant> make_participant(const ParticipantOptions& options,
                                                         std::function<void()> on_activity);

struct DOPPEL_API NetworkError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace doppel::ros2
