#pragma once
// The participant of Fast DDS, as its endpoints use it.

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <functional>
#include <map>
#include <mutex>

#include "doppel/ros/network/fastdds/fast_discovery.h"
#include "doppel/ros/network/fastdds/fast_transport.h"
#include "doppel/ros/network/participant.h"

namespace doppel::ros2::fast {

class FastParticipant : public Participant {
 public:
  FastParticipant(const ParticipantOptions& options, std::function<void()> on_activity);
  ~FastParticipant() override;
  FastParticipant(const FastParticipant&) = delete;
  FastParticipant& operator=(const FastParticipant&) = delete;

  [[nodiscard]] const Gid& gid() const override { return gid_; }
  std::unique_ptr<Writer> make_writer(const EndpointSpec& spec) override;
  std::unique_ptr<Reader> make_reader(const EndpointSpec& spec) override;
  [[nodiscard]] std::uint64_t discovery_version() const override { return discovery_.version(); }
  [[nodiscard]] std::vector<EndpointInfo> endpoints() const override { return discovery_.endpoints(); }
  [[nodiscard]] std::vector<ParticipantInfo> participants() const override {
    return discovery_.participants();
  }
  [[nodiscard]] MiddlewareLog middleware_log() const override;
  [[nodiscard]] std::uint64_t refused_datagrams() const override;

  // One topic serves all endpoints of its name; each acquire needs a release. Throws NetworkError where the
  // name is in use with another type.
  dds::Topic* acquire_topic(const EndpointSpec& spec);
  void release_topic(dds::Topic* topic);
  // Adds an endpoint of this participant to the discovery results.
  void announce(const Gid& gid, bool is_writer, const EndpointSpec& spec);
  void withdraw(const Gid& gid) { discovery_.remove(gid); }

  [[nodiscard]] dds::Publisher& publisher() const { return *publisher_; }
  [[nodiscard]] dds::Subscriber& subscriber() const { return *subscriber_; }
  [[nodiscard]] const ReaderPlaces& reply_readers() const { return discovery_.reply_readers(); }
  [[nodiscard]] Acknowledgements& acknowledgements() const { return *acknowledgements_; }
  void on_activity() const { on_activity_(); }

 private:
  struct UsedTopic {
    dds::Topic* topic = nullptr;
    std::size_t users = 0;
  };

  const std::function<void()> on_activity_;
  const std::shared_ptr<AnnouncedEndpoints> announced_endpoints_ = std::make_shared<AnnouncedEndpoints>();
  Discovery discovery_;
  const std::shared_ptr<Acknowledgements> acknowledgements_ =
      std::make_shared<Acknowledgements>(on_activity_);
  const std::shared_ptr<ReceiveGate> receive_gate_ =
      std::make_shared<ReceiveGate>(acknowledgements_, announced_endpoints_);
  dds::DomainParticipant* participant_ = nullptr;
  dds::Publisher* publisher_ = nullptr;
  dds::Subscriber* subscriber_ = nullptr;
  Gid gid_;
  std::mutex topics_mutex_;
  std::map<std::string, UsedTopic> topics_;
};

}  // namespace doppel::ros2::fast
