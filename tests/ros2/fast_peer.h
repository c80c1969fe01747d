#pragma once
// A ROS 2 process like those of rmw_fastrtps, from Fast DDS and fastddsgen's types alone: nothing here is
// doppel's. It uses UDP on 127.0.0.1 only, without multicast.

#include <cxxabi.h>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <typeinfo>
#include <vector>

#include "eventually.h"
#include "fast_api.h"

namespace doppel::ros2_testing {

using dds::SampleInfo;
using rtps::GUID_t;
using rtps::SampleIdentity;

// One of fastddsgen's types on a topic, under its IDL name: "sensor_msgs::msg::dds_::JointState_".
template <class T>
class GeneratedType : public PeerType {
  static constexpr std::uint32_t kHeader = 4, kFirstSize = 1024;

 public:
  static std::string name() {
    const std::unique_ptr<char, void (*)(void*)> text(
        abi::__cxa_demangle(typeid(T).name(), nullptr, nullptr, nullptr), std::free);
    return text.get();
  }
  GeneratedType() : PeerType(name(), kFirstSize) {}

 private:
  bool put(const void* data, Payload& payload) const override {
    eprosima::fastcdr::FastBuffer buffer(reinterpret_cast<char*>(payload.data), payload.max_size);
    eprosima::fastcdr::Cdr cdr = cdr_of(buffer);
    payload.encapsulation = CDR_LE;
    cdr.serialize_encapsulation();
    put_value(cdr, *static_cast<const T*>(data));
    payload.length = length_of(cdr);
    return true;
  }
  bool get(const Payload& payload, void* data) const override {
    eprosima::fastcdr::FastBuffer buffer(reinterpret_cast<char*>(payload.data), payload.length);
    eprosima::fastcdr::Cdr cdr = cdr_of(buffer);
    try {
      cdr.read_encapsulation();
      get_value(cdr, *static_cast<T*>(data));
    } catch (const eprosima::fastcdr::exception::Exception&) {
      return false;
    }
    return true;
  }
  [[nodiscard]] std::uint32_t size_of(const void* data) const override {
    return size_of_value(*static_cast<const T*>(data)) + kHeader;
  }
  [[nodiscard]] void* make() const override { return new T; }
  void destroy(void* data) const override { delete static_cast<T*>(data); }
};

struct TopicQos {
  bool reliable = true;
  bool latched = false;  // transient local
  int depth = 10;        // 0: all
};

// A writer or reader of another participant, as discovered.
struct SeenEndpoint {
  GUID_t guid;
  bool is_writer = false;
  std::string topic, type, user_data;
  bool reliable = false, latched = false;
};
struct SeenParticipant {
  std::string name, user_data;
  std::vector<int> ports;  // where it receives datagrams, in ascending order
};

template <class T>
class Subscription;
template <class T>
class Publisher;

// loopback: the interface 127.0.0.1 alone. localhost and subnet: ROS_AUTOMATIC_DISCOVERY_RANGE as
// rmw_fastrtps reads it; both use every interface, only subnet announces itself by multicast.
enum class Reach { loopback, localhost, subnet };

class FastPeer {
 public:
  struct Options {
    Reach reach = Reach::loopback;
    std::vector<std::string> peers;  // addresses for discovery in addition to those of `reach`
    double lease_seconds = 20;       // after which others may remove this peer
    double announce_seconds = 3;     // period of the announcements
  };
  explicit FastPeer(int domain) : FastPeer(domain, Options()) {}
  FastPeer(int domain, const Options& options);
  ~FastPeer();

  // Topics by their DDS names: "rt/joint_states".
  template <class T>
  Subscription<T> subscribe(const std::string& topic, const TopicQos& qos = {}) {
    return Subscription<T>(reader(topic, dds::TypeSupport(new GeneratedType<T>), qos));
  }
  template <class T>
  Publisher<T> advertise(const std::string& topic, const TopicQos& qos = {}) {
    return Publisher<T>(writer(topic, dds::TypeSupport(new GeneratedType<T>), qos));
  }

  [[nodiscard]] std::vector<SeenEndpoint> endpoints() const;
  [[nodiscard]] std::map<GUID_t, SeenParticipant> participants() const;
  [[nodiscard]] GUID_t guid() const;

  dds::DataReader* reader(const std::string& topic, dds::TypeSupport type, const TopicQos& qos);
  dds::DataWriter* writer(const std::string& topic, dds::TypeSupport type, const TopicQos& qos);

 private:
  class Discovery;
  dds::Topic* topic(const std::string& name, dds::TypeSupport& type);

  std::unique_ptr<Discovery> discovery_;
  dds::DomainParticipant* participant_ = nullptr;
  dds::Publisher* publisher_ = nullptr;
  dds::Subscriber* subscriber_ = nullptr;
};

// Its reader lives as long as the peer.
template <class T>
class Subscription {
 public:
  struct Received {
    T value;
    SampleInfo info;
  };
  explicit Subscription(dds::DataReader* reader) : reader_(reader) {}

  [[nodiscard]] int matched() const {
    dds::SubscriptionMatchedStatus status;
    reader_->get_subscription_matched_status(status);
    return status.current_count;
  }
  // The next message, if there is one.
  std::optional<Received> take() {
    Received received;
    while (is_ok(reader_->take_next_sample(&received.value, &received.info)))
      if (received.info.valid_data) return received;
    return std::nullopt;
  }
  // The first message from now on for which `wanted` holds; nothing after a minute.
  std::optional<T> next(const std::function<bool(const T&)>& wanted = [](const T&) { return true; }) {
    std::optional<T> found;
    eventually([&] {
      while (auto received = take()) {
        if (!wanted(received->value)) continue;
        found = std::move(received->value);
        return true;
      }
      return false;
    });
    return found;
  }
  void forget_all() {
    while (take()) {
    }
  }
  [[nodiscard]] GUID_t guid() const { return reader_->guid(); }

 private:
  dds::DataReader* reader_;
};

template <class T>
class Publisher {
 public:
  explicit Publisher(dds::DataWriter* writer) : writer_(writer) {}

  [[nodiscard]] int matched() const {
    dds::PublicationMatchedStatus status;
    writer_->get_publication_matched_status(status);
    return status.current_count;
  }
  void publish(T value) { writer_->write(&value); }
  void publish(T value, rtps::WriteParams& with) { writer_->write(&value, with); }
  [[nodiscard]] GUID_t guid() const { return writer_->guid(); }

 private:
  dds::DataWriter* writer_;
};

// A service client with rmw_fastrtps's request identity: the request names the reader of the responses as
// related writer; the response names that reader, or the request's writer, with the request's sequence
// number.
template <class Request, class Response>
class ServiceClient {
 public:
  ServiceClient(FastPeer& peer, const std::string& service)  // "/controller_manager/list_controllers"
      : requests_(peer.advertise<Request>("rq" + service + "Request")),
        answers_(peer.subscribe<Response>("rr" + service + "Reply")) {}

  bool wait_for_service() {
    return eventually([&] { return requests_.matched() > 0 && answers_.matched() > 0; });
  }
  [[nodiscard]] bool is_available() const { return requests_.matched() > 0 && answers_.matched() > 0; }

  std::int64_t send(const Request& request) {
    rtps::WriteParams with;
    with.related_sample_identity().writer_guid() = answers_.guid();
    requests_.publish(request, with);
    return number(with.sample_identity());
  }
  // The response to the request with the number that `send` returned, if there is one; responses to others
  // are skipped and counted.
  std::optional<Response> answer(std::int64_t request) {
    while (auto received = answers_.take()) {
      const SampleIdentity& to = received->info.related_sample_identity;
      if (to.writer_guid() != answers_.guid() && to.writer_guid() != requests_.guid()) {
        ++foreign_;
      } else {
        own_[number(to)] = std::move(received->value);
      }
    }
    const auto found = own_.find(request);
    return found == own_.end() ? std::nullopt : std::optional(found->second);
  }
  std::optional<Response> call(const Request& request) {
    if (!wait_for_service()) return std::nullopt;
    const std::int64_t sent = send(request);
    std::optional<Response> response;
    eventually([&] { return (response = answer(sent)).has_value(); });
    return response;
  }
  [[nodiscard]] int foreign() const { return foreign_; }
  [[nodiscard]] std::size_t own() const { return own_.size(); }

 private:
  static std::int64_t number(const SampleIdentity& identity) {
    return static_cast<std::int64_t>(identity.sequence_number().to64long());
  }
  Publisher<Request> requests_;
  Subscription<Response> answers_;
  std::map<std::int64_t, Response> own_;
  int foreign_ = 0;
};

}  // namespace doppel::ros2_testing
