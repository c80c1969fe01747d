#pragma once
// A ring of byte records from the loop to one edge: one thread writes, one reads, neither waits. A record
// that does not fit is dropped and counted, so that a slow reader loses records and never delays the loop.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "doppel/export.h"

namespace doppel {

class DOPPEL_API ByteRing {
 public:
  // capacity in bytes, rounded up to a power of two.
  explicit ByteRing(std::size_t capacity);

  // Writer: room for a record of `size` bytes (8-byte aligned), or an empty span (counted as dropped).
  std::span<std::byte> begin_write(std::size_t size);
  // Writer: makes the record begun last visible; `size` may be smaller than what was requested.
  void commit(std::size_t size);

  // Reader: the oldest record, or an empty span with nullptr data; valid until pop().
  [[nodiscard]] std::span<const std::byte> front();
  void pop();

  // The bytes of the records that wait, with their headers. Any thread.
  [[nodiscard]] std::size_t used() const {
    const std::size_t read = read_.load(std::memory_order_acquire);
    return written_.load(std::memory_order_acquire) - read;
  }
  [[nodiscard]] std::uint64_t dropped() const { return dropped_.load(std::memory_order_relaxed); }

 private:
  static constexpr std::size_t kHeader = 8;
  std::size_t mask_;
  std::unique_ptr<std::byte[]> bytes_;
  std::size_t begun_ = 0;                // writer: position of the record being written
  std::atomic<std::size_t> written_{0};  // total bytes ever written
  std::atomic<std::size_t> read_{0};     // total bytes ever read
  std::atomic<std::uint64_t> dropped_{0};
};

}  // namespace doppel
