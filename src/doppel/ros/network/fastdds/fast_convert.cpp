#include "doppel/ros/network/fastdds/fast_convert.h"

#include <algorithm>
#include <cstring>
#include <limits>

namespace doppel::ros2::fast {
namespace {

// The time for which a keep-all writer waits for room in its history; long enough for another thread that is
// using the history.
const DdsDuration kMaxBlockingTime{0, 10'000'000};
// The delay of a new reader's first ACKNACK, which requests missed samples; Fast DDS's default is 70 ms.
constexpr std::uint32_t kServicesFirstQuestion = 2'000'000;                                     // ns
constexpr std::uint32_t kHeartbeatPeriod = 500'000'000, kServicesHeartbeatPeriod = 20'000'000;  // ns
constexpr std::int64_t kNanosecondsPerSecond = 1'000'000'000;

DdsDuration duration_of(std::chrono::nanoseconds duration) {
  const std::int64_t seconds = duration.count() / kNanosecondsPerSecond;
  if (duration == QosProfile::kInfinite || seconds >= std::numeric_limits<std::int32_t>::max())
    return kForever;
  return {static_cast<std::int32_t>(seconds),
          static_cast<std::uint32_t>(duration.count() % kNanosecondsPerSecond)};
}

std::chrono::nanoseconds duration_of(const DdsDuration& duration) {
  if (duration == kForever) return QosProfile::kInfinite;
  return std::chrono::nanoseconds(duration.to_ns());
}

template <class Qos>
void fill(const EndpointSpec& spec, Qos& qos) {
  const QosProfile& profile = spec.qos;
  qos.history().kind =
      profile.history == History::keep_all ? dds::KEEP_ALL_HISTORY_QOS : dds::KEEP_LAST_HISTORY_QOS;
  constexpr std::size_t kMax = std::numeric_limits<std::int32_t>::max();
  qos.history().depth = static_cast<std::int32_t>(std::clamp<std::size_t>(profile.depth, 1, kMax));
  qos.durability().kind = profile.durability == Durability::transient_local
                              ? dds::TRANSIENT_LOCAL_DURABILITY_QOS
                              : dds::VOLATILE_DURABILITY_QOS;
  qos.reliability().kind = profile.reliability == Reliability::reliable ? dds::RELIABLE_RELIABILITY_QOS
                                                                        : dds::BEST_EFFORT_RELIABILITY_QOS;
  qos.lifespan().duration = duration_of(profile.lifespan);
  qos.deadline().period = duration_of(profile.deadline);
  qos.liveliness().kind = profile.liveliness == Liveliness::manual_by_topic
                              ? dds::MANUAL_BY_TOPIC_LIVELINESS_QOS
                              : dds::AUTOMATIC_LIVELINESS_QOS;
  qos.liveliness().lease_duration = duration_of(profile.lease);
  qos.liveliness().announcement_period =
      profile.lease == QosProfile::kInfinite ? kForever : duration_of(profile.lease / 3 * 2);
  if (!spec.type_hash.empty()) {
    set_user_data(qos.user_data(), "typehash=" + spec.type_hash + ";");
  }
  qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  qos.data_sharing().off();
  // The initial allocation, here and for each matched peer; the default of 100 would be half of the memory
  // of a twin.
  qos.resource_limits().allocated_samples = 1;
}

template <class Data>
QosProfile profile_of_peer(const Data& data) {
  QosProfile profile;
  profile.reliability = reliability_of(data).kind == dds::BEST_EFFORT_RELIABILITY_QOS
                            ? Reliability::best_effort
                            : Reliability::reliable;
  profile.durability = durability_of(data).kind == dds::VOLATILE_DURABILITY_QOS ? Durability::volatile_
                                                                                : Durability::transient_local;
  profile.history = History::unknown;
  profile.depth = 0;
  profile.deadline = duration_of(deadline_of(data).period);
  profile.lifespan = duration_of(lifespan_of(data).duration);
  profile.lease = duration_of(liveliness_of(data).lease_duration);
  profile.liveliness = liveliness_of(data).kind == dds::MANUAL_BY_TOPIC_LIVELINESS_QOS
                           ? Liveliness::manual_by_topic
                           : Liveliness::automatic;
  return profile;
}

}  // namespace

Gid gid_of(const rtps::GUID_t& guid) {
  Gid gid;
  std::memcpy(gid.bytes.data(), guid.guidPrefix.value, rtps::GuidPrefix_t::size);
  std::memcpy(gid.bytes.data() + rtps::GuidPrefix_t::size, guid.entityId.value, rtps::EntityId_t::size);
  return gid;
}

SampleIdentity identity_of(const rtps::SampleIdentity& identity) {
  const rtps::SequenceNumber_t& sequence = identity.sequence_number();
  const bool known = sequence != rtps::SequenceNumber_t::unknown();
  return {gid_of(identity.writer_guid()), known ? static_cast<std::int64_t>(sequence.to64long()) : 0};
}

rtps::SampleIdentity identity_of(const SampleIdentity& identity) {
  rtps::SampleIdentity result;
  rtps::GUID_t guid;
  std::memcpy(guid.guidPrefix.value, identity.writer.bytes.data(), rtps::GuidPrefix_t::size);
  std::memcpy(guid.entityId.value, identity.writer.bytes.data() + rtps::GuidPrefix_t::size,
              rtps::EntityId_t::size);
  result.writer_guid(guid);
  if (identity.sequence != 0)
    result.sequence_number(rtps::SequenceNumber_t(static_cast<std::uint64_t>(identity.sequence)));
  return result;
}

dds::DataWriterQos writer_qos(const EndpointSpec& spec) {
  dds::DataWriterQos qos;
  fill(spec, qos);
  if (spec.qos.history == History::keep_all) qos.reliability().max_blocking_time = kMaxBlockingTime;
  // Synchronous, in the writing thread: Fast DDS's thread for asynchronous sending spins while a
  // writer is busy.
  qos.publish_mode().kind = dds::SYNCHRONOUS_PUBLISH_MODE;
  qos.representation().m_value = {dds::XCDR_DATA_REPRESENTATION};
  // Only a heartbeat informs a reader about a loss of the last data, for example a fragment of
  // a large description.
  heartbeat_period(qos) = {0, spec.of_service ? kServicesHeartbeatPeriod : kHeartbeatPeriod};
  if (spec.of_service) nack_response_delay(qos) = {0, 0};
  return qos;
}

dds::DataReaderQos reader_qos(const EndpointSpec& spec) {
  dds::DataReaderQos qos;
  fill(spec, qos);
  if (spec.of_service) first_acknack_delay(qos) = {0, kServicesFirstQuestion};
  representation(qos).m_value = {dds::XCDR_DATA_REPRESENTATION};
  return qos;
}

QosProfile profile_of(const WriterData& writer) {
  return profile_of_peer(writer);
}
QosProfile profile_of(const ReaderData& reader) {
  return profile_of_peer(reader);
}

}  // namespace doppel::ros2::fast
