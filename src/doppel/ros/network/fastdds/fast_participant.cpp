#include "doppel/ros/network/fastdds/fast_participant.h"

#include <cstdlib>

#include "doppel/export.h"
#include "doppel/ros/network/detail/participant.h"
#include "doppel/ros/network/environment.h"
#include "doppel/ros/network/fastdds/fast_convert.h"
#include "doppel/ros/network/fastdds/fast_endpoint.h"
#include "doppel/ros/network/fastdds/fast_log.h"
#include "doppel/ros/network/fastdds/fast_transport.h"

namespace doppel::ros2::fast {
namespace {

// Participants of one process also communicate by the network, so that tests exercise the code
// that users run.
void prepare_library() {
  if (std::getenv("FASTDDS_STATISTICS") != nullptr)
    throw NetworkError(
        "FASTDDS_STATISTICS is set, which lets peers crash this process; unset it, or call "
        "ros2::forget_statistics() before threads are started");
  turn_off_intraprocess();
  catch_log();
}

dds::DomainParticipant* create(const ParticipantOptions& options, Discovery& discovery,
                               const std::shared_ptr<ReceiveGate>& receive_gate) {
  // Locked, because no other thread may search between the search for free ports and their use.
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  prepare_library();
  dds::DomainParticipant* const participant =
      dds::DomainParticipantFactory::get_instance()->create_participant(
          options.domain, participant_qos(options, receive_gate), &discovery, dds::StatusMask::none());
  receive_gate->open();
  if (participant != nullptr) return participant;
  throw NetworkError(
      "no connection to ROS 2 nodes is possible: Fast DDS cannot create a participant in domain " +
      std::to_string(options.domain) + " (" + middleware_log().latest + ")");
}

void destroy(dds::DomainParticipant* participant) {
  participant->set_listener(nullptr);
  participant->delete_contained_entities();
  dds::DomainParticipantFactory::get_instance()->delete_participant(participant);
}

}  // namespace

FastParticipant::FastParticipant(const ParticipantOptions& options, std::function<void()> on_activity)
    : on_activity_(std::move(on_activity)),
      discovery_(on_activity_, announced_endpoints_),
      participant_(create(options, discovery_, receive_gate_)) {
  publisher_ = participant_->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
  subscriber_ = participant_->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
  if (publisher_ == nullptr || subscriber_ == nullptr) {
    destroy(participant_);
    throw NetworkError(
        "no connection to ROS 2 nodes is possible: the participant of Fast DDS can neither send nor receive "
        "(" +
        middleware_log().latest + ")");
  }
  gid_ = gid_of(participant_->guid());
  discovery_.add(ParticipantInfo{gid_, options.enclave, options.enclave});
}

FastParticipant::~FastParticipant() {
  destroy(participant_);
}

std::unique_ptr<Writer> FastParticipant::make_writer(const EndpointSpec& spec) {
  return make_fast_writer(*this, spec);
}

std::unique_ptr<Reader> FastParticipant::make_reader(const EndpointSpec& spec) {
  return make_fast_reader(*this, spec);
}

MiddlewareLog FastParticipant::middleware_log() const {
  return fast::middleware_log();
}

std::uint64_t FastParticipant::refused_datagrams() const {
  return receive_gate_->refused();
}

dds::Topic* FastParticipant::acquire_topic(const EndpointSpec& spec) {
  const std::lock_guard lock(topics_mutex_);
  UsedTopic& used = topics_[spec.topic];
  if (used.topic == nullptr) {
    dds::TypeSupport type = participant_->find_type(spec.type);
    if (type.empty()) {
      type.reset(new BytesType(spec.type));
      type.register_type(participant_);
    }
    used.topic = participant_->create_topic(spec.topic, spec.type, dds::TOPIC_QOS_DEFAULT);
  }
  if (used.topic == nullptr || used.topic->get_type_name() != spec.type) {
    const std::string other = used.topic == nullptr ? "" : ": it carries " + used.topic->get_type_name();
    if (used.users == 0) topics_.erase(spec.topic);
    throw NetworkError("the topic '" + spec.topic + "' cannot be created with the type " + spec.type + other);
  }
  ++used.users;
  return used.topic;
}

void FastParticipant::release_topic(dds::Topic* topic) {
  const std::lock_guard lock(topics_mutex_);
  const auto at = topics_.find(topic->get_name());
  if (at == topics_.end() || --at->second.users > 0) return;
  participant_->delete_topic(topic);
  topics_.erase(at);
}

void FastParticipant::announce(const Gid& gid, bool is_writer, const EndpointSpec& spec) {
  discovery_.add(EndpointInfo{.gid = gid,
                              .is_writer = is_writer,
                              .topic = spec.topic,
                              .type = spec.type,
                              .type_hash = spec.type_hash,
                              .qos = spec.qos,
                              .is_own = true});
}

}  // namespace doppel::ros2::fast

extern "C" DOPPEL_API doppel::ros2::Participant* doppel_make_fast_participant(
    const doppel::ros2::ParticipantOptions& options, std::function<void()> on_activity) {
  return new doppel::ros2::fast::FastParticipant(options, std::move(on_activity));
}

extern "C" DOPPEL_API const char* doppel_fast_dds_version() {
  return doppel::ros2::fast::kVersion;
}
