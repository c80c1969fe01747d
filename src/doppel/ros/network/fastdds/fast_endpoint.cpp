#include "doppel/ros/network/fastdds/fast_endpoint.h"

#include <cstring>

#include "doppel/ros/network/fastdds/fast_convert.h"

#ifdef __SANITIZE_THREAD__
extern "C" void __tsan_acquire(void* address);
extern "C" void __tsan_release(void* address);
#endif

namespace doppel::ros2::fast {

namespace {

constexpr std::uint32_t kFirstSampleSize = 256;  // bytes

// Fast DDS passes payloads from their readers to the next writer by an atomic counter in code that is not
// instrumented for ThreadSanitizer; the synchronisation is annotated here.
void has_been_read([[maybe_unused]] const rtps::SerializedPayload_t& payload) {
#ifdef __SANITIZE_THREAD__
  __tsan_release(payload.data);
#endif
}
void is_to_be_written([[maybe_unused]] const rtps::SerializedPayload_t& payload) {
#ifdef __SANITIZE_THREAD__
  __tsan_acquire(payload.data);
#endif
}

}  // namespace

void Matches::update(const rtps::InstanceHandle_t& peer, int change) {
  const Gid gid = gid_of(rtps::iHandle2GUID(peer));
  if (is_same_participant(gid, own_)) return;
  const std::lock_guard lock(mutex_);
  if (change > 0)
    peers_.insert(gid);
  else
    peers_.erase(gid);
  count_.store(peers_.size(), std::memory_order_release);
}

bool Matches::contains(const Gid& peer) const {
  const std::lock_guard lock(mutex_);
  return peers_.contains(peer);
}

BytesType::BytesType(const std::string& name) : TypeOfBytes(name, kFirstSampleSize) {}

std::uint32_t BytesType::size_of(const void* written) const {
  return static_cast<std::uint32_t>(static_cast<const Written*>(written)->size());
}

bool BytesType::put(const void* written, Payload& payload) const {
  const Written& bytes = *static_cast<const Written*>(written);
  if (bytes.size() > payload.max_size || bytes.size() < 4) return false;
  is_to_be_written(payload);
  std::memcpy(payload.data, bytes.data(), bytes.size());
  payload.length = static_cast<std::uint32_t>(bytes.size());
  payload.encapsulation = static_cast<std::uint16_t>(std::to_integer<int>(bytes[1]));
  return true;
}

bool BytesType::get(const Payload& payload, void* sample) const {
  const auto* const data = reinterpret_cast<const std::byte*>(payload.data);
  static_cast<Bytes*>(sample)->assign(data, data + payload.length);
  has_been_read(payload);
  return true;
}

}  // namespace doppel::ros2::fast
