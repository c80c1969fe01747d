#pragma once
// A Cyclone DDS participant with types from idlc, on loopback without multicast. `CYCLONE_TYPE(sensor_msgs,
// msg, JointState)` is such a type: its C struct and its descriptor.

#include <dds/dds.h>

#include <cstdlib>
#include <functional>
#include <stdexcept>
#include <string>

#include "eventually.h"

namespace doppel::ros2_testing {

template <class T>
struct CycloneType {
  const dds_topic_descriptor_t& descriptor;
};
#define CYCLONE_TYPE(package, kind, name)                                  \
  ::doppel::ros2_testing::CycloneType<package##_##kind##_dds__##name##_> { \
    package##_##kind##_dds__##name##__desc                                 \
  }

inline dds_entity_t must(dds_return_t result, const char* what) {
  if (result < 0) throw std::runtime_error(std::string(what) + ": " + dds_strretcode(-result));
  return result;
}

template <class T>
class CycloneReader;
template <class T>
class CycloneWriter;

class CyclonePeer {
 public:
  explicit CyclonePeer(int domain) {
    setenv("CYCLONEDDS_URI",
           "<CycloneDDS><Domain Id='any'>"
           "<General><AllowMulticast>false</AllowMulticast>"
           "<Interfaces><NetworkInterface name='lo' multicast='false'/></Interfaces></General>"
           "<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>32</"
           "MaxAutoParticipantIndex>"
           "<Peers><Peer address='127.0.0.1'/></Peers></Discovery>"
           "</Domain></CycloneDDS>",
           1);
    participant_ = must(dds_create_participant(static_cast<dds_domainid_t>(domain), nullptr, nullptr),
                        "a Cyclone DDS participant");
  }
  ~CyclonePeer() { dds_delete(participant_); }
  CyclonePeer(const CyclonePeer&) = delete;
  CyclonePeer& operator=(const CyclonePeer&) = delete;

  template <class T>
  CycloneReader<T> subscribe(CycloneType<T> type, const char* topic, bool latched = false) {
    return CycloneReader<T>(with_qos(latched, [&](const dds_qos_t* qos) {
      return dds_create_reader(participant_, topic_of(type, topic), qos, nullptr);
    }));
  }
  template <class T>
  CycloneWriter<T> advertise(CycloneType<T> type, const char* topic) {
    return CycloneWriter<T>(with_qos(false, [&](const dds_qos_t* qos) {
      return dds_create_writer(participant_, topic_of(type, topic), qos, nullptr);
    }));
  }

 private:
  template <class T>
  dds_entity_t topic_of(CycloneType<T> type, const char* topic) const {
    return must(dds_create_topic(participant_, &type.descriptor, topic, nullptr, nullptr), topic);
  }
  // ROS 2's default profile: reliable, keep last 10.
  static dds_entity_t with_qos(bool latched, const std::function<dds_entity_t(const dds_qos_t*)>& make) {
    dds_qos_t* qos = dds_create_qos();
    dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
    dds_qset_durability(qos, latched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
    dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 10);
    const dds_entity_t made = make(qos);
    dds_delete_qos(qos);
    return must(made, "an endpoint");
  }
  dds_entity_t participant_ = 0;
};

// Valid as long as the peer.
template <class T>
class CycloneReader {
 public:
  explicit CycloneReader(dds_entity_t reader) : reader_(reader) {}

  // Waits for a message for which `wanted` holds; the message is valid only during that call.
  bool next(const std::function<bool(const T&)>& wanted) {
    return eventually([&] { return take(wanted); });
  }
  // Whether `wanted` holds for one of the messages that are there.
  bool take(const std::function<bool(const T&)>& wanted) {
    void* sample = nullptr;
    dds_sample_info_t info;
    while (dds_take(reader_, &sample, &info, 1, 1) == 1) {
      const bool found = info.valid_data && wanted(*static_cast<const T*>(sample));
      dds_return_loan(reader_, &sample, 1);
      sample = nullptr;
      if (found) return true;
    }
    return false;
  }

 private:
  dds_entity_t reader_;
};

template <class T>
class CycloneWriter {
 public:
  explicit CycloneWriter(dds_entity_t writer) : writer_(writer) {}
  [[nodiscard]] int matched() const {
    dds_publication_matched_status_t status;
    must(dds_get_publication_matched_status(writer_, &status), "matched readers");
    return static_cast<int>(status.current_count);
  }
  void publish(const T& value) { must(dds_write(writer_, &value), "writing"); }

 private:
  dds_entity_t writer_;
};

}  // namespace doppel::ros2_testing
