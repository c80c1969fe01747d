#pragma once
// The bytes of one frame, or of those that have been received and not read, without the heap: buses are
// used in the control loop.

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>

#include "doppel/export.h"

namespace doppel {

inline constexpr double kBitsPerByte = 10;  // on the line, with start and stop bit

// Throws std::length_error with the numbers if a part of a frame has more bytes than it may have: a length
// that does not fit its field would become another one in silence.
DOPPEL_API void refuse_frame_size(std::string_view part, std::size_t size, std::size_t limit);
inline void check_frame_size(std::string_view part, std::size_t size, std::size_t limit) {
  if (size > limit) refuse_frame_size(part, size, limit);
}

class DOPPEL_API FrameBytes {
 public:
  // A frame of 32 servos with 16 bytes each fits twice.
  static constexpr std::size_t kCapacity = 2048;

  [[nodiscard]] std::span<const std::uint8_t> bytes() const { return {bytes_.data(), size_}; }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] std::size_t room() const { return kCapacity - size_; }
  void clear() { size_ = 0; }

  // They throw std::length_error where there is no room.
  void add(std::uint8_t byte) {
    check_frame_size("the bytes of a frame", size_ + 1, kCapacity);
    bytes_[size_++] = byte;
  }
  void add_word(std::uint16_t word) {  // little endian, as in all of these protocols
    add(static_cast<std::uint8_t>(word & 0xFF));
    add(static_cast<std::uint8_t>(word >> 8));
  }
  void add(std::span<const std::uint8_t> bytes) {
    if (bytes.empty()) return;
    check_frame_size("the bytes of a frame", size_ + bytes.size(), kCapacity);
    std::memcpy(bytes_.data() + size_, bytes.data(), bytes.size());
    size_ += bytes.size();
  }
  // Precondition: index < size().
  void set(std::size_t index, std::uint8_t byte) { bytes_[index] = byte; }
  // Removes the first bytes. Precondition: count <= size().
  void drop(std::size_t count) {
    size_ -= count;
    if (size_ > 0) std::memmove(bytes_.data(), bytes_.data() + count, size_);
  }

 private:
  std::array<std::uint8_t, kCapacity> bytes_{};
  std::size_t size_ = 0;
};

// Bytes of a stream that have been received and not read: the common part of all readers of frames.
class DOPPEL_API ReceivedBytes {
 public:
  // Takes as many bytes as there is room for, and returns how many.
  std::size_t push(std::span<const std::uint8_t> bytes) {
    bytes_.drop(begin_);
    begin_ = 0;
    const std::size_t count = bytes.size() < bytes_.room() ? bytes.size() : bytes_.room();
    bytes_.add(bytes.first(count));
    return count;
  }
  void clear() {
    bytes_.clear();
    begin_ = 0;
  }
  // Valid until the next push().
  [[nodiscard]] std::span<const std::uint8_t> rest() const { return bytes_.bytes().subspan(begin_); }
  // Precondition: count <= rest().size().
  void advance(std::size_t count) { begin_ += count; }

 private:
  FrameBytes bytes_;
  std::size_t begin_ = 0;
};

// Counts of a reader: its frames, and everything else that it has met.
struct StreamCounts {
  std::uint64_t frames = 0;
  std::uint64_t noise = 0;       // bytes outside of frames
  std::uint64_t bad_checks = 0;  // frames whose check was wrong
};

}  // namespace doppel
