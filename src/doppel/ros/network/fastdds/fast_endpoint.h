#pragma once
// Shared by writers and readers: the matched peers, and a type of raw bytes.

#include <fastdds/rtps/common/InstanceHandle.h>

#include <atomic>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <mutex>
#include <set>
#include <span>

#include "doppel/ros/network/participant.h"

namespace doppel::ros2::fast {

class FastParticipant;

// The matched endpoints of other participants.
class Matches {
 public:
  explicit Matches(const Gid& own) : own_(own) {}
  void update(const eprosima::fastrtps::rtps::InstanceHandle_t& peer, int change);
  [[nodiscard]] std::size_t count() const { return count_.load(std::memory_order_acquire); }
  [[nodiscard]] bool contains(const Gid& peer) const;

 private:
  const Gid own_;  // the participant
  std::atomic<std::size_t> count_{0};
  mutable std::mutex mutex_;
  std::set<Gid> peers_;
};

// Fast DDS serialises and deserialises samples by the type. Here both sides are bytes already: a written
// sample is a span, a received one is stored in a Bytes.
class BytesType : public eprosima::fastdds::dds::TopicDataType {
 public:
  using Written = std::span<const std::byte>;
  using Payload = eprosima::fastrtps::rtps::SerializedPayload_t;

  explicit BytesType(const std::string& name);
  bool serialize(void* written, Payload* payload) override;
  bool deserialize(Payload* payload, void* bytes) override;
  std::function<std::uint32_t()> getSerializedSizeProvider(void* written) override;
  void* createData() override;
  void deleteData(void* bytes) override;
  bool getKey(void*, eprosima::fastrtps::rtps::InstanceHandle_t*, bool) override { return false; }
};

std::unique_ptr<Writer> make_fast_writer(FastParticipant& participant, const EndpointSpec& spec);
std::unique_ptr<Reader> make_fast_reader(FastParticipant& participant, const EndpointSpec& spec);

}  // namespace doppel::ros2::fast
