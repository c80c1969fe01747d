#include "doppel/base/core/byte_ring.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace doppel {
namespace {

constexpr std::uint64_t kSkip =
    ~std::uint64_t{0};  // header of the unused tail before the ring continues at its front

constexpr std::size_t kInUse = std::size_t{4} << 20;  // bytes, while nothing waits

constexpr std::size_t padded(std::size_t size) {
  return (size + 7) & ~std::size_t{7};
}

}  // namespace

ByteRing::ByteRing(std::size_t capacity)
    : mask_(std::bit_ceil(capacity < 64 ? std::size_t{64} : capacity) - 1),
      bytes_(new std::byte[mask_ + 1]) {}

std::span<std::byte> ByteRing::begin_write(std::size_t size) {
  const std::size_t need = kHeader + padded(size);
  const std::size_t capacity = mask_ + 1;
  const std::size_t written = written_.load(std::memory_order_relaxed);
  const std::size_t used = written - read_.load(std::memory_order_acquire);
  const std::size_t at = written & mask_;
  const std::size_t to_end = capacity - at;
  // An empty ring continues at its front: otherwise a large ring whose reader keeps up would in the end touch
  // all of its memory. Until the reader has passed the skip there is room for `at` bytes.
  const bool begins_anew = used == 0 && at >= std::max(need, kInUse);
  const std::size_t skip = to_end < need || begins_anew ? to_end : 0;
  if (need > capacity || used + skip + need > capacity) {
    dropped_.fetch_add(1, std::memory_order_relaxed);
    return {};
  }
  if (skip > 0) std::memcpy(&bytes_[written & mask_], &kSkip, kHeader);
  begun_ = written + skip;
  return {&bytes_[(begun_ & mask_) + kHeader], size};
}

void ByteRing::commit(std::size_t size) {
  const std::uint64_t header = size;
  std::memcpy(&bytes_[begun_ & mask_], &header, kHeader);
  written_.store(begun_ + kHeader + padded(size), std::memory_order_release);
}

std::span<const std::byte> ByteRing::front() {
  std::size_t read = read_.load(std::memory_order_relaxed);
  while (read != written_.load(std::memory_order_acquire)) {
    std::uint64_t header = 0;
    std::memcpy(&header, &bytes_[read & mask_], kHeader);
    if (header != kSkip) return {&bytes_[(read & mask_) + kHeader], static_cast<std::size_t>(header)};
    read += mask_ + 1 - (read & mask_);
    read_.store(read, std::memory_order_release);
  }
  return {};
}

void ByteRing::pop() {
  const auto record = front();
  if (record.data() == nullptr) return;
  read_.store(read_.load(std::memory_order_relaxed) + kHeader + padded(record.size()),
              std::memory_order_release);
}

}  // namespace doppel
