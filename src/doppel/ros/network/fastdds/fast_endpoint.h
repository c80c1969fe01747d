#pragma once
// Shared by writers and readers: the matched peers, and a type of raw bytes.

#include <atomic>
#include <mutex>
#include <set>
#include <span>

#include "doppel/ros/network/fastdds/fast_dds.h"
#include "doppel/ros/network/participant.h"

namespace doppel::ros2::fast {

class FastParticipant;

// The matched endpoints of other participants.
class Matches {
 public:
  explicit Matches(const Gid& own) : own_(own) {}
  void update(const rtps::InstanceHandle_t& peer, int change);
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
class BytesType : public TypeOfBytes {
 public:
  using Written = std::span<const std::byte>;

  explicit BytesType(const std::string& name);

 private:
  [[nodiscard]] std::uint32_t size_of(const void* written) const override;
  bool put(const void* written, Payload& payload) const override;
  bool get(const Payload& payload, void* sample) const override;
  [[nodiscard]] void* make() const override { return new Bytes; }
  void destroy(void* sample) const override { delete static_cast<Bytes*>(sample); }
};

std::unique_ptr<Writer> make_fast_writer(FastParticipant& participant, const EndpointSpec& spec);
std::unique_ptr<Reader> make_fast_reader(FastParticipant& participant, const EndpointSpec& spec);

}  // namespace doppel::ros2::fast
