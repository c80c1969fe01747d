#pragma once
// The view that peers have of Fast DDS 2 (Debian 12) and 3 (Debian 13): what their headers, and the types
// that the generators write, call differently. It shares no code with src/.

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>

#if __has_include(<fastdds/rtps/common/Guid.hpp>)
#define DOPPEL_PEER_FAST_DDS_3
#include <fastcdr/CdrSizeCalculator.hpp>
#include <fastdds/LibrarySettings.hpp>
#include <fastdds/dds/builtin/topic/ParticipantBuiltinTopicData.hpp>
#include <fastdds/dds/builtin/topic/PublicationBuiltinTopicData.hpp>
#include <fastdds/dds/builtin/topic/SubscriptionBuiltinTopicData.hpp>
#include <fastdds/rtps/common/WriteParams.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.hpp>
#include <fastdds/utils/IPLocator.hpp>
#else
#include <fastdds/rtps/common/WriteParams.h>
#include <fastdds/rtps/participant/ParticipantDiscoveryInfo.h>
#include <fastdds/rtps/reader/ReaderDiscoveryInfo.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/rtps/writer/WriterDiscoveryInfo.h>
#include <fastrtps/utils/IPLocator.h>
#include <fastrtps/xmlparser/XMLProfileManager.h>
#endif

#include <cstdint>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <functional>
#include <string>

namespace doppel::ros2_testing {

namespace dds = eprosima::fastdds::dds;

#ifdef DOPPEL_PEER_FAST_DDS_3

namespace rtps = eprosima::fastdds::rtps;
namespace transport = eprosima::fastdds::rtps;
using PeerDuration = dds::Duration_t;
using ParticipantData = dds::ParticipantBuiltinTopicData;

inline bool is_ok(dds::ReturnCode_t code) {
  return code == dds::RETCODE_OK;
}
inline void turn_off_intraprocess() {
  eprosima::fastdds::LibrarySettings settings;
  settings.intraprocess_delivery = eprosima::fastdds::INTRAPROCESS_OFF;
  dds::DomainParticipantFactory::get_instance()->set_library_settings(settings);
}

// A generated value as CDR, without the encapsulation header.
template <class T>
void put_value(eprosima::fastcdr::Cdr& cdr, const T& value) {
  cdr << value;
}
template <class T>
void get_value(eprosima::fastcdr::Cdr& cdr, T& value) {
  cdr >> value;
}
template <class T>
std::uint32_t size_of_value(const T& value) {
  eprosima::fastcdr::CdrSizeCalculator calculator(eprosima::fastcdr::CdrVersion::XCDRv1);
  std::size_t alignment = 0;
  return static_cast<std::uint32_t>(calculator.calculate_serialized_size(value, alignment));
}
inline eprosima::fastcdr::Cdr cdr_of(eprosima::fastcdr::FastBuffer& buffer) {
  return {buffer, eprosima::fastcdr::Cdr::LITTLE_ENDIANNESS, eprosima::fastcdr::CdrVersion::XCDRv1};
}
inline std::uint32_t length_of(const eprosima::fastcdr::Cdr& cdr) {
  return static_cast<std::uint32_t>(cdr.get_serialized_data_length());
}

#else

namespace rtps = eprosima::fastrtps::rtps;
namespace transport = eprosima::fastdds::rtps;
using PeerDuration = eprosima::fastrtps::Duration_t;
using ParticipantData = rtps::ParticipantProxyData;

inline bool is_ok(const eprosima::fastrtps::types::ReturnCode_t& code) {
  return code == eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK;
}
inline void turn_off_intraprocess() {
  eprosima::fastrtps::LibrarySettingsAttributes settings;
  settings.intraprocess_delivery = eprosima::fastrtps::INTRAPROCESS_OFF;
  eprosima::fastrtps::xmlparser::XMLProfileManager::library_settings(settings);
}

// A generated value as CDR, without the encapsulation header.
template <class T>
void put_value(eprosima::fastcdr::Cdr& cdr, const T& value) {
  value.serialize(cdr);
}
template <class T>
void get_value(eprosima::fastcdr::Cdr& cdr, T& value) {
  value.deserialize(cdr);
}
template <class T>
std::uint32_t size_of_value(const T& value) {
  return static_cast<std::uint32_t>(T::getCdrSerializedSize(value));
}
inline eprosima::fastcdr::Cdr cdr_of(eprosima::fastcdr::FastBuffer& buffer) {
  return {buffer, eprosima::fastcdr::Cdr::LITTLE_ENDIANNESS, eprosima::fastcdr::Cdr::DDS_CDR};
}
inline std::uint32_t length_of(const eprosima::fastcdr::Cdr& cdr) {
  return static_cast<std::uint32_t>(cdr.getSerializedDataLength());
}

#endif

// The type of a topic without a key.
class PeerType : public dds::TopicDataType {
 protected:
  using Payload = rtps::SerializedPayload_t;

  virtual bool put(const void* data, Payload& payload) const = 0;
  virtual bool get(const Payload& payload, void* data) const = 0;
  [[nodiscard]] virtual std::uint32_t size_of(const void* data) const = 0;
  [[nodiscard]] virtual void* make() const = 0;
  virtual void destroy(void* data) const = 0;

#ifdef DOPPEL_PEER_FAST_DDS_3
  PeerType(const std::string& name, std::uint32_t first_size) {
    set_name(name);
    max_serialized_type_size = first_size;
  }

 private:
  bool serialize(const void* data, Payload& payload, dds::DataRepresentationId_t) final {
    return put(data, payload);
  }
  bool deserialize(Payload& payload, void* data) final {
    return get(payload, data);
  }
  std::uint32_t calculate_serialized_size(const void* data, dds::DataRepresentationId_t) final {
    return size_of(data);
  }
  void* create_data() final {
    return make();
  }
  void delete_data(void* data) final {
    destroy(data);
  }
  bool compute_key(Payload&, rtps::InstanceHandle_t&, bool) final {
    return false;
  }
  bool compute_key(const void*, rtps::InstanceHandle_t&, bool) final {
    return false;
  }
#else
  PeerType(const std::string& name, std::uint32_t first_size) {
    setName(name.c_str());
    m_typeSize = first_size;
    m_isGetKeyDefined = false;
  }

 private:
  bool serialize(void* data, Payload* payload) final {
    return put(data, *payload);
  }
  bool deserialize(Payload* payload, void* data) final {
    return get(*payload, data);
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) final {
    return [this, data] { return size_of(data); };
  }
  void* createData() final {
    return make();
  }
  void deleteData(void* data) final {
    destroy(data);
  }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) final {
    return false;
  }
#endif
};

// A discovered endpoint.
struct EndpointData {
  rtps::GUID_t guid;
  std::string topic, type;
  std::vector<rtps::octet> user_data;
  bool reliable = false, latched = false;
};

class PeerListener : public dds::DomainParticipantListener {
 protected:
  virtual void participant_changed(const ParticipantData& data, bool removed) = 0;
  virtual void endpoint_changed(const EndpointData& data, bool is_writer, bool removed) = 0;

 private:
#ifdef DOPPEL_PEER_FAST_DDS_3
  template <class Data>
  static EndpointData endpoint_of(const Data& data) {
    return {data.guid,
            data.topic_name.to_string(),
            data.type_name.to_string(),
            data.user_data.data_vec(),
            data.reliability.kind == dds::RELIABLE_RELIABILITY_QOS,
            data.durability.kind == dds::TRANSIENT_LOCAL_DURABILITY_QOS};
  }
  void on_participant_discovery(dds::DomainParticipant*, rtps::ParticipantDiscoveryStatus status,
                                const ParticipantData& data, bool&) final {
    using Status = rtps::ParticipantDiscoveryStatus;
    participant_changed(data, status == Status::REMOVED_PARTICIPANT || status == Status::DROPPED_PARTICIPANT);
  }
  void on_data_writer_discovery(dds::DomainParticipant*, rtps::WriterDiscoveryStatus status,
                                const dds::PublicationBuiltinTopicData& data, bool&) final {
    endpoint_changed(endpoint_of(data), true, status == rtps::WriterDiscoveryStatus::REMOVED_WRITER);
  }
  void on_data_reader_discovery(dds::DomainParticipant*, rtps::ReaderDiscoveryStatus status,
                                const dds::SubscriptionBuiltinTopicData& data, bool&) final {
    endpoint_changed(endpoint_of(data), false, status == rtps::ReaderDiscoveryStatus::REMOVED_READER);
  }
#else
  template <class Data>
  static EndpointData endpoint_of(const Data& data) {
    return {data.guid(),
            data.topicName().to_string(),
            data.typeName().to_string(),
            data.m_qos.m_userData.getValue(),
            data.m_qos.m_reliability.kind == dds::RELIABLE_RELIABILITY_QOS,
            data.m_qos.m_durability.kind == dds::TRANSIENT_LOCAL_DURABILITY_QOS};
  }
  void on_participant_discovery(dds::DomainParticipant*, rtps::ParticipantDiscoveryInfo&& info) final {
    using Info = rtps::ParticipantDiscoveryInfo;
    participant_changed(info.info,
                        info.status == Info::REMOVED_PARTICIPANT || info.status == Info::DROPPED_PARTICIPANT);
  }
  void on_publisher_discovery(dds::DomainParticipant*, rtps::WriterDiscoveryInfo&& info) final {
    endpoint_changed(endpoint_of(info.info), true, info.status == rtps::WriterDiscoveryInfo::REMOVED_WRITER);
  }
  void on_subscriber_discovery(dds::DomainParticipant*, rtps::ReaderDiscoveryInfo&& info) final {
    endpoint_changed(endpoint_of(info.info), false, info.status == rtps::ReaderDiscoveryInfo::REMOVED_READER);
  }
#endif
};

#ifdef DOPPEL_PEER_FAST_DDS_3
inline const rtps::GUID_t& guid_of(const ParticipantData& data) {
  return data.guid;
}
inline std::string name_of(const ParticipantData& data) {
  return data.participant_name.to_string();
}
inline const auto& user_data_of(const ParticipantData& data) {
  return data.user_data.data_vec();
}
#else
inline const rtps::GUID_t& guid_of(const ParticipantData& data) {
  return data.m_guid;
}
inline std::string name_of(const ParticipantData& data) {
  return data.m_participantName.to_string();
}
inline const auto& user_data_of(const ParticipantData& data) {
  return data.m_userData.getValue();
}
#endif

}  // namespace doppel::ros2_testing
