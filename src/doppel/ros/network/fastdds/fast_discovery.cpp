#include "doppel/ros/network/fastdds/fast_discovery.h"

#include "doppel/ros/network/detail/participant.h"
#include "doppel/ros/network/fastdds/fast_convert.h"
#include "doppel/ros/network/fastdds/fast_log.h"

namespace doppel::ros2::fast {
namespace {

constexpr const char* kReplies = "rr/";  // what the topics of services' replies begin with

std::string text_of(const std::vector<rtps::octet>& bytes) {
  return {bytes.begin(), bytes.end()};
}

template <class Data>
EndpointInfo endpoint_of(const Data& data, bool is_writer) {
  EndpointInfo endpoint;
  endpoint.gid = gid_of(guid_of(data));
  endpoint.is_writer = is_writer;
  endpoint.topic = topic_of(data);
  endpoint.type = type_of(data);
  endpoint.type_hash = detail::type_hash_of(text_of(user_data_of(data)));
  endpoint.qos = profile_of(data);
  return endpoint;
}

void log_limit_reached(const std::string& what) {
  log_message("the maximum number of " + what +
              " on the network is reached; new ones are ignored until some leave");
}

}  // namespace

void Discovery::add(ParticipantInfo participant) {
  {
    const std::lock_guard lock(mutex_);
    const auto [known, is_new] = participants_.try_emplace(participant.gid);
    if (known->second == participant) return;  // announcements are repeated periodically
    known->second = std::move(participant);
    if (is_new && participants_.size() == kMaxParticipants) log_limit_reached("participants");
  }
  changed();
}

void Discovery::add(EndpointInfo endpoint) {
  {
    const std::lock_guard lock(mutex_);
    const bool is_writer = endpoint.is_writer;
    const bool is_new = endpoints_.insert_or_assign(endpoint.gid, std::move(endpoint)).second;
    if (is_new && is_writer) ++writers_;
    const std::size_t count = is_writer ? writers_ : endpoints_.size() - writers_;
    if (is_new && count == kMaxEndpoints) log_limit_reached(is_writer ? "writers" : "readers");
  }
  changed();
}

void Discovery::remove(const Gid& endpoint) {
  {
    const std::lock_guard lock(mutex_);
    const auto known = endpoints_.find(endpoint);
    if (known == endpoints_.end()) return;
    if (known->second.is_writer) --writers_;
    endpoints_.erase(known);
  }
  changed();
}

void Discovery::remove_participant(const Gid& gid) {
  reply_readers_.remove_participant(gid);
  {
    const std::lock_guard lock(mutex_);
    participants_.erase(gid);
    std::erase_if(endpoints_, [&](const auto& entry) {
      if (!is_same_participant(entry.first, gid)) return false;
      if (entry.second.is_writer) --writers_;
      return true;
    });
  }
  changed();
}

void Discovery::changed() {
  version_.fetch_add(1, std::memory_order_release);
  on_activity_();
}

std::vector<EndpointInfo> Discovery::endpoints() const {
  std::vector<EndpointInfo> result;
  const std::lock_guard lock(mutex_);
  result.reserve(endpoints_.size());
  for (const auto& [gid, endpoint] : endpoints_) result.push_back(endpoint);
  return result;
}

std::vector<ParticipantInfo> Discovery::participants() const {
  std::vector<ParticipantInfo> result;
  const std::lock_guard lock(mutex_);
  for (const auto& [gid, participant] : participants_) result.push_back(participant);
  return result;
}

void Discovery::participant_changed(const ParticipantData& data, bool left) {
  const Gid gid = gid_of(guid_of(data));
  if (left) {
    announced_->leave(gid);
    return remove_participant(gid);
  }
  announced_->join(gid);
  const std::string user_data = text_of(user_data_of(data));
  add(ParticipantInfo{gid, name_of(data), detail::user_data_value(user_data, "enclave")});
}

void Discovery::reader_changed(const ReaderData& data, bool left) {
  const Gid gid = gid_of(guid_of(data));
  if (left) {
    reply_readers_.remove(gid);
    return remove(gid);
  }
  EndpointInfo reader = endpoint_of(data, false);
  if (reader.topic.starts_with(kReplies)) {
    const auto& places = unicast_of(data);
    reply_readers_.put(gid, {places.begin(), places.end()});
  }
  add(std::move(reader));
}

void Discovery::writer_changed(const WriterData& data, bool left) {
  if (left) return remove(gid_of(guid_of(data)));
  add(endpoint_of(data, true));
}

}  // namespace doppel::ros2::fast
