#pragma once
// The names of fast_dds.h for Fast DDS 3.1.

#include <algorithm>
#include <fastdds/LibrarySettings.hpp>
#include <fastdds/config.hpp>
#include <fastdds/dds/builtin/topic/ParticipantBuiltinTopicData.hpp>
#include <fastdds/dds/builtin/topic/PublicationBuiltinTopicData.hpp>
#include <fastdds/dds/builtin/topic/SubscriptionBuiltinTopicData.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/rtps/common/Guid.hpp>
#include <fastdds/rtps/common/InstanceHandle.hpp>
#include <fastdds/rtps/common/Locator.hpp>
#include <fastdds/rtps/common/LocatorList.hpp>
#include <fastdds/rtps/common/SampleIdentity.hpp>
#include <fastdds/rtps/common/WriteParams.hpp>
#include <fastdds/rtps/transport/ChainingTransport.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.hpp>
#include <fastdds/utils/IPLocator.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace doppel::ros2::fast {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastdds::rtps;
namespace transport = eprosima::fastdds::rtps;  // apart from rtps in 2.x

inline constexpr const char* kVersion = FASTDDS_VERSION_STR;

using DdsDuration = dds::Duration_t;
inline const DdsDuration kForever = dds::c_TimeInfinite;

inline bool is_ok(dds::ReturnCode_t code) {
  return code == dds::RETCODE_OK;
}
inline bool write(dds::DataWriter& writer, const void* sample, rtps::WriteParams& params) {
  return is_ok(writer.write(sample, params));
}
inline void turn_off_intraprocess() {
  eprosima::fastdds::LibrarySettings settings;
  settings.intraprocess_delivery = eprosima::fastdds::INTRAPROCESS_OFF;
  dds::DomainParticipantFactory::get_instance()->set_library_settings(settings);
}

// -- settings

inline DdsDuration& heartbeat_period(dds::DataWriterQos& qos) {
  return qos.reliable_writer_qos().times.heartbeat_period;
}
inline DdsDuration& nack_response_delay(dds::DataWriterQos& qos) {
  return qos.reliable_writer_qos().times.nack_response_delay;
}
inline DdsDuration& first_acknack_delay(dds::DataReaderQos& qos) {
  return qos.reliable_reader_qos().times.initial_acknack_delay;
}
inline dds::DataRepresentationQosPolicy& representation(dds::DataReaderQos& qos) {
  return qos.representation();
}
inline void set_user_data(dds::UserDataQosPolicy& policy, const std::string& text) {
  policy.data_vec(std::vector<rtps::octet>(text.begin(), text.end()));
}

// -- discovery

using ParticipantData = dds::ParticipantBuiltinTopicData;
using ReaderData = dds::SubscriptionBuiltinTopicData;
using WriterData = dds::PublicationBuiltinTopicData;

inline std::string name_of(const ParticipantData& data) {
  return data.participant_name.to_string();
}
template <class Data>
const auto& guid_of(const Data& data) {
  return data.guid;
}
template <class Data>
std::string topic_of(const Data& data) {
  return data.topic_name.to_string();
}
template <class Data>
std::string type_of(const Data& data) {
  return data.type_name.to_string();
}
template <class Data>
const auto& user_data_of(const Data& data) {
  return data.user_data.data_vec();
}
template <class Data>
const auto& reliability_of(const Data& data) {
  return data.reliability;
}
template <class Data>
const auto& durability_of(const Data& data) {
  return data.durability;
}
template <class Data>
const auto& deadline_of(const Data& data) {
  return data.deadline;
}
template <class Data>
const auto& lifespan_of(const Data& data) {
  return data.lifespan;
}
template <class Data>
const auto& liveliness_of(const Data& data) {
  return data.liveliness;
}
inline const auto& unicast_of(const ReaderData& data) {
  return data.remote_locators.unicast;
}

// On threads of Fast DDS. `left`: the peer has gone, or was not heard for its lease.
class DiscoveryListener : public dds::DomainParticipantListener {
 protected:
  virtual void participant_changed(const ParticipantData& data, bool left) = 0;
  virtual void reader_changed(const ReaderData& data, bool left) = 0;
  virtual void writer_changed(const WriterData& data, bool left) = 0;

 private:
  void on_participant_discovery(dds::DomainParticipant*, rtps::ParticipantDiscoveryStatus reason,
                                const ParticipantData& data, bool&) final {
    using Status = rtps::ParticipantDiscoveryStatus;
    participant_changed(data, reason == Status::REMOVED_PARTICIPANT || reason == Status::DROPPED_PARTICIPANT);
  }
  void on_data_reader_discovery(dds::DomainParticipant*, rtps::ReaderDiscoveryStatus reason,
                                const ReaderData& data, bool&) final {
    reader_changed(data, reason == rtps::ReaderDiscoveryStatus::REMOVED_READER);
  }
  void on_data_writer_discovery(dds::DomainParticipant*, rtps::WriterDiscoveryStatus reason,
                                const WriterData& data, bool&) final {
    writer_changed(data, reason == rtps::WriterDiscoveryStatus::REMOVED_WRITER);
  }
};

// -- types

class TypeOfBytes : public dds::TopicDataType {
 protected:
  using Payload = rtps::SerializedPayload_t;

  // first_size: bytes, the initial allocation of a sample; it grows with longer ones.
  TypeOfBytes(const std::string& name, std::uint32_t first_size) {
    set_name(name);
    max_serialized_type_size = first_size;
    is_compute_key_provided = false;
  }
  [[nodiscard]] virtual std::uint32_t size_of(const void* written) const = 0;
  virtual bool put(const void* written, Payload& payload) const = 0;
  virtual bool get(const Payload& payload, void* sample) const = 0;
  [[nodiscard]] virtual void* make() const = 0;
  virtual void destroy(void* sample) const = 0;

 private:
  bool serialize(const void* written, Payload& payload, dds::DataRepresentationId_t) final {
    return put(written, payload);
  }
  bool deserialize(Payload& payload, void* sample) final { return get(payload, sample); }
  std::uint32_t calculate_serialized_size(const void* written, dds::DataRepresentationId_t) final {
    return size_of(written);
  }
  void* create_data() final { return make(); }
  void delete_data(void* sample) final { destroy(sample); }
  bool compute_key(Payload&, rtps::InstanceHandle_t&, bool) final { return false; }
  bool compute_key(const void*, rtps::InstanceHandle_t&, bool) final { return false; }
};

// -- the transport

using Octets = std::span<const rtps::octet>;
using SendDeadline = std::chrono::steady_clock::time_point;

// Fast DDS 3 gives a datagram in parts, which are joined only where the bytes are looked at.
class Datagram {
 public:
  Datagram(const std::vector<rtps::NetworkBuffer>& parts, std::uint32_t size) : parts_(parts), size_(size) {}
  explicit Datagram(Octets bytes)
      : single_{{bytes.data(), static_cast<std::uint32_t>(bytes.size())}},
        parts_(single_),
        size_(static_cast<std::uint32_t>(bytes.size())) {}
  Datagram(const Datagram&) = delete;
  Datagram& operator=(const Datagram&) = delete;

  [[nodiscard]] Octets bytes() {
    joined_.clear();
    for (const rtps::NetworkBuffer& part : parts_) {
      const auto* const begin = static_cast<const rtps::octet*>(part.buffer);
      const std::size_t room = size_ - joined_.size();
      joined_.insert(joined_.end(), begin, begin + std::min<std::size_t>(part.size, room));
    }
    return joined_;
  }
  bool send(rtps::SenderResource& below, rtps::LocatorsIterator* begin, rtps::LocatorsIterator* end,
            const SendDeadline& deadline) {
    return below.send(parts_, size_, begin, end, deadline);
  }

 private:
  std::vector<rtps::NetworkBuffer> single_;
  const std::vector<rtps::NetworkBuffer>& parts_;
  std::uint32_t size_;
  std::vector<rtps::octet> joined_;
};

class TransportOfDatagrams : public transport::ChainingTransport {
 public:
  explicit TransportOfDatagrams(const transport::ChainingTransportDescriptor& descriptor)
      : transport::ChainingTransport(descriptor) {}
  transport::TransportDescriptorInterface* get_configuration() final {
    return low_level_transport_->get_configuration();
  }

 protected:
  virtual bool send_datagram(Datagram& datagram, rtps::SenderResource& below, rtps::LocatorsIterator* begin,
                             rtps::LocatorsIterator* end, const SendDeadline& deadline) = 0;
  // The address by which a peer is reached; nullopt: as the transport below says.
  struct Mapping {
    bool reachable = false;
    rtps::Locator_t place;
  };
  [[nodiscard]] virtual std::optional<Mapping> mapping_of(const rtps::Locator_t& peer) const = 0;

 private:
  bool send(rtps::SenderResource* below, const std::vector<rtps::NetworkBuffer>& parts, std::uint32_t size,
            rtps::LocatorsIterator* begin, rtps::LocatorsIterator* end, const SendDeadline& deadline) final {
    Datagram datagram(parts, size);
    return send_datagram(datagram, *below, begin, end, deadline);
  }
  bool transform_remote_locator(const rtps::Locator_t& peer, rtps::Locator_t& result) const final {
    const auto mapped = mapping_of(peer);
    return mapped ? use(*mapped, result) : low_level_transport_->transform_remote_locator(peer, result);
  }
  bool transform_remote_locator(const rtps::Locator_t& peer, rtps::Locator_t& result,
                                bool peer_permits_localhost, bool own_permits_localhost) const final {
    const auto mapped = mapping_of(peer);
    return mapped ? use(*mapped, result)
                  : low_level_transport_->transform_remote_locator(peer, result, peer_permits_localhost,
                                                                   own_permits_localhost);
  }
  static bool use(const Mapping& mapped, rtps::Locator_t& result) {
    if (mapped.reachable) result = mapped.place;
    return mapped.reachable;
  }
};

}  // namespace doppel::ros2::fast
