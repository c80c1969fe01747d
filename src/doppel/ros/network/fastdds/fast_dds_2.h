#pragma once
// The names of fast_dds.h for Fast DDS 2.9.

#include <fastdds/rtps/common/Guid.h>
#include <fastdds/rtps/common/InstanceHandle.h>
#include <fastdds/rtps/common/Locator.h>
#include <fastdds/rtps/common/SampleIdentity.h>
#include <fastdds/rtps/common/WriteParams.h>
#include <fastdds/rtps/transport/ChainingTransport.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/config.h>
#include <fastrtps/utils/IPLocator.h>
#include <fastrtps/xmlparser/XMLProfileManager.h>

#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/rtps/common/LocatorList.hpp>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace doppel::ros2::fast {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
namespace transport = eprosima::fastdds::rtps;  // 3.x has it in rtps

inline constexpr const char* kVersion = FASTRTPS_VERSION_STR;

using DdsDuration = eprosima::fastrtps::Duration_t;
inline const DdsDuration kForever = eprosima::fastrtps::c_TimeInfinite;

inline bool is_ok(const eprosima::fastrtps::types::ReturnCode_t& code) {
  return code == eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK;
}
inline bool write(dds::DataWriter& writer, const void* sample, rtps::WriteParams& params) {
  return writer.write(const_cast<void*>(sample), params);
}
inline void turn_off_intraprocess() {
  eprosima::fastrtps::LibrarySettingsAttributes settings;
  settings.intraprocess_delivery = eprosima::fastrtps::INTRAPROCESS_OFF;
  eprosima::fastrtps::xmlparser::XMLProfileManager::library_settings(settings);
}

// -- settings

inline DdsDuration& heartbeat_period(dds::DataWriterQos& qos) {
  return qos.reliable_writer_qos().times.heartbeatPeriod;
}
inline DdsDuration& nack_response_delay(dds::DataWriterQos& qos) {
  return qos.reliable_writer_qos().times.nackResponseDelay;
}
inline DdsDuration& first_acknack_delay(dds::DataReaderQos& qos) {
  return qos.reliable_reader_qos().times.initialAcknackDelay;
}
inline dds::DataRepresentationQosPolicy& representation(dds::DataReaderQos& qos) {
  return qos.type_consistency().representation;
}
inline void set_user_data(dds::UserDataQosPolicy& policy, const std::string& text) {
  policy.setValue({text.begin(), text.end()});
}

// -- discovery

using ParticipantData = rtps::ParticipantProxyData;
using ReaderData = rtps::ReaderProxyData;
using WriterData = rtps::WriterProxyData;

inline const auto& guid_of(const ParticipantData& data) {
  return data.m_guid;
}
inline std::string name_of(const ParticipantData& data) {
  return data.m_participantName.to_string();
}
inline const auto& user_data_of(const ParticipantData& data) {
  return data.m_userData.getValue();
}
template <class Data>
const auto& guid_of(const Data& data) {
  return data.guid();
}
template <class Data>
std::string topic_of(const Data& data) {
  return data.topicName().to_string();
}
template <class Data>
std::string type_of(const Data& data) {
  return data.typeName().to_string();
}
template <class Data>
const auto& user_data_of(const Data& data) {
  return data.m_qos.m_userData.getValue();
}
template <class Data>
const auto& reliability_of(const Data& data) {
  return data.m_qos.m_reliability;
}
template <class Data>
const auto& durability_of(const Data& data) {
  return data.m_qos.m_durability;
}
template <class Data>
const auto& deadline_of(const Data& data) {
  return data.m_qos.m_deadline;
}
template <class Data>
const auto& lifespan_of(const Data& data) {
  return data.m_qos.m_lifespan;
}
template <class Data>
const auto& liveliness_of(const Data& data) {
  return data.m_qos.m_liveliness;
}
inline const auto& unicast_of(const ReaderData& data) {
  return data.remote_locators().unicast;
}

// On threads of Fast DDS. `left`: the peer has gone, or was not heard for its lease.
class DiscoveryListener : public dds::DomainParticipantListener {
 protected:
  virtual void participant_changed(const ParticipantData& data, bool left) = 0;
  virtual void reader_changed(const ReaderData& data, bool left) = 0;
  virtual void writer_changed(const WriterData& data, bool left) = 0;

 private:
  void on_participant_discovery(dds::DomainParticipant*, rtps::ParticipantDiscoveryInfo&& info) final {
    using Info = rtps::ParticipantDiscoveryInfo;
    participant_changed(info.info,
                        info.status == Info::REMOVED_PARTICIPANT || info.status == Info::DROPPED_PARTICIPANT);
  }
  void on_subscriber_discovery(dds::DomainParticipant*, rtps::ReaderDiscoveryInfo&& info) final {
    reader_changed(info.info, info.status == rtps::ReaderDiscoveryInfo::REMOVED_READER);
  }
  void on_publisher_discovery(dds::DomainParticipant*, rtps::WriterDiscoveryInfo&& info) final {
    writer_changed(info.info, info.status == rtps::WriterDiscoveryInfo::REMOVED_WRITER);
  }
};

// -- types

class TypeOfBytes : public dds::TopicDataType {
 protected:
  using Payload = rtps::SerializedPayload_t;

  // first_size: bytes, the initial allocation of a sample; it grows with longer ones.
  TypeOfBytes(const std::string& name, std::uint32_t first_size) {
    setName(name.c_str());
    m_typeSize = first_size;
    m_isGetKeyDefined = false;
    auto_fill_type_object(false);
    auto_fill_type_information(false);
  }
  [[nodiscard]] virtual std::uint32_t size_of(const void* written) const = 0;
  virtual bool put(const void* written, Payload& payload) const = 0;
  virtual bool get(const Payload& payload, void* sample) const = 0;
  [[nodiscard]] virtual void* make() const = 0;
  virtual void destroy(void* sample) const = 0;

 private:
  bool serialize(void* written, Payload* payload) final { return put(written, *payload); }
  bool deserialize(Payload* payload, void* sample) final { return get(*payload, sample); }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* written) final {
    return [size = size_of(written)] { return size; };
  }
  void* createData() final { return make(); }
  void deleteData(void* sample) final { destroy(sample); }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) final { return false; }
};

// -- the transport

using Octets = std::span<const rtps::octet>;
using SendDeadline = std::chrono::steady_clock::time_point;

class Datagram {
 public:
  explicit Datagram(Octets bytes) : bytes_(bytes) {}
  [[nodiscard]] Octets bytes() { return bytes_; }
  bool send(rtps::SenderResource& below, rtps::LocatorsIterator* begin, rtps::LocatorsIterator* end,
            const SendDeadline& deadline) {
    return below.send(bytes_.data(), static_cast<std::uint32_t>(bytes_.size()), begin, end, deadline);
  }

 private:
  Octets bytes_;
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
  bool send(rtps::SenderResource* below, const rtps::octet* data, std::uint32_t size,
            rtps::LocatorsIterator* begin, rtps::LocatorsIterator* end, const SendDeadline& deadline) final {
    Datagram datagram({data, size});
    return send_datagram(datagram, *below, begin, end, deadline);
  }
  bool transform_remote_locator(const rtps::Locator_t& peer, rtps::Locator_t& result) const final {
    const auto mapped = mapping_of(peer);
    if (!mapped) return low_level_transport_->transform_remote_locator(peer, result);
    if (mapped->reachable) result = mapped->place;
    return mapped->reachable;
  }
};

}  // namespace doppel::ros2::fast
