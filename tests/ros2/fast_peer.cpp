#include "fast_peer.h"

#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <set>
#include <stdexcept>

namespace doppel::ros2_testing {

namespace {

template <class Octets>
std::string text(const Octets& octets) {
  std::string text(octets.begin(), octets.end());
  return text.substr(0, text.find('\0'));  // rmw_fastrtps sends the enclave's NUL as well
}

template <class EndpointQos>
void set_qos(EndpointQos& out, const TopicQos& qos) {
  out.reliability().kind = qos.reliable ? dds::RELIABLE_RELIABILITY_QOS : dds::BEST_EFFORT_RELIABILITY_QOS;
  out.durability().kind = qos.latched ? dds::TRANSIENT_LOCAL_DURABILITY_QOS : dds::VOLATILE_DURABILITY_QOS;
  out.history().kind = qos.depth == 0 ? dds::KEEP_ALL_HISTORY_QOS : dds::KEEP_LAST_HISTORY_QOS;
  out.history().depth = qos.depth == 0 ? 1 : qos.depth;
  out.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  out.data_sharing().off();
}

rtps::Locator_t address(const std::string& ip) {
  rtps::Locator_t locator;
  rtps::IPLocator::setIPv4(locator, ip);
  return locator;
}

dds::DomainParticipantQos participant_qos(const FastPeer::Options& options) {
  dds::DomainParticipantQos qos;
  auto udp = std::make_shared<transport::UDPv4TransportDescriptor>();
  udp->maxInitialPeersRange = 32;
  auto& builtin = qos.wire_protocol().builtin;
  for (const std::string& peer : options.peers) builtin.initialPeersList.push_back(address(peer));
  if (options.reach == Reach::loopback) {
    udp->interfaceWhiteList = {"127.0.0.1"};
    builtin.metatrafficUnicastLocatorList.push_back(address("127.0.0.1"));
  } else if (options.reach == Reach::localhost) {
    builtin.metatrafficUnicastLocatorList.push_back(
        rtps::Locator_t());  // without one, Fast DDS adds multicast
  }
  if (options.reach != Reach::subnet) {
    builtin.initialPeersList.push_back(address("127.0.0.1"));
  } else if (!options.peers.empty()) {
    builtin.initialPeersList.push_back(address("239.255.0.1"));
  }
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports = {udp};
  builtin.readerHistoryMemoryPolicy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  builtin.writerHistoryMemoryPolicy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  builtin.discovery_config.leaseDuration = PeerDuration(options.lease_seconds);
  builtin.discovery_config.leaseDuration_announcementperiod = PeerDuration(options.announce_seconds);
  const std::string enclave = "enclave=/;";
  qos.user_data().assign(enclave.begin(), enclave.end());
  qos.user_data().push_back(0);
  qos.name("/");
  return qos;
}

std::vector<int> ports_of(const ParticipantData& participant) {
  std::set<int> ports;
  for (const auto* locators : {&participant.metatraffic_locators, &participant.default_locators})
    for (const rtps::Locator_t& locator : locators->unicast) ports.insert(static_cast<int>(locator.port));
  return {ports.begin(), ports.end()};
}

}  // namespace

class FastPeer::Discovery : public PeerListener {
 public:
  mutable std::mutex mutex;
  std::map<GUID_t, SeenEndpoint> endpoints;
  std::map<GUID_t, SeenParticipant> participants;

 private:
  void participant_changed(const ParticipantData& data, bool removed) override {
    const std::lock_guard lock(mutex);
    if (removed)
      participants.erase(guid_of(data));
    else
      participants[guid_of(data)] = {name_of(data), text(user_data_of(data)), ports_of(data)};
  }
  void endpoint_changed(const EndpointData& data, bool is_writer, bool removed) override {
    const std::lock_guard lock(mutex);
    if (removed)
      endpoints.erase(data.guid);
    else
      endpoints[data.guid] = {data.guid,     is_writer,   data.topic, data.type, text(data.user_data),
                              data.reliable, data.latched};
  }
};

FastPeer::FastPeer(int domain, const Options& options) : discovery_(std::make_unique<Discovery>()) {
  // Fast DDS's intraprocess delivery accesses participants of the process that are being destroyed.
  turn_off_intraprocess();
  participant_ = dds::DomainParticipantFactory::get_instance()->create_participant(
      static_cast<dds::DomainId_t>(domain), participant_qos(options), discovery_.get(),
      dds::StatusMask::none());
  if (participant_ == nullptr) throw std::runtime_error("Fast DDS cannot create a participant");
  publisher_ = participant_->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
  subscriber_ = participant_->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
}

FastPeer::~FastPeer() {
  participant_->set_listener(nullptr);
  participant_->delete_contained_entities();
  dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
}

dds::Topic* FastPeer::topic(const std::string& name, dds::TypeSupport& type) {
  if (auto* known = participant_->lookup_topicdescription(name)) return dynamic_cast<dds::Topic*>(known);
  type.register_type(participant_);
  return participant_->create_topic(name, type.get_type_name(), dds::TOPIC_QOS_DEFAULT);
}

dds::DataReader* FastPeer::reader(const std::string& name, dds::TypeSupport type, const TopicQos& qos) {
  dds::DataReaderQos reader_qos;
  set_qos(reader_qos, qos);
  auto* reader = subscriber_->create_datareader(topic(name, type), reader_qos);
  if (reader == nullptr) throw std::runtime_error("Fast DDS cannot create a reader of " + name);
  return reader;
}

dds::DataWriter* FastPeer::writer(const std::string& name, dds::TypeSupport type, const TopicQos& qos) {
  dds::DataWriterQos writer_qos;
  set_qos(writer_qos, qos);
  writer_qos.publish_mode().kind = dds::SYNCHRONOUS_PUBLISH_MODE;
  auto* writer = publisher_->create_datawriter(topic(name, type), writer_qos);
  if (writer == nullptr) throw std::runtime_error("Fast DDS cannot create a writer of " + name);
  return writer;
}

std::vector<SeenEndpoint> FastPeer::endpoints() const {
  const std::lock_guard lock(discovery_->mutex);
  std::vector<SeenEndpoint> all;
  for (const auto& [guid, endpoint] : discovery_->endpoints) all.push_back(endpoint);
  return all;
}

std::map<GUID_t, SeenParticipant> FastPeer::participants() const {
  const std::lock_guard lock(discovery_->mutex);
  return discovery_->participants;
}

GUID_t FastPeer::guid() const {
  return participant_->guid();
}

}  // namespace doppel::ros2_testing
