#pragma once
// Bytes of devices on their way to the host, in the order of their arrival.

#include <cstdint>
#include <deque>
#include <optional>
#include <span>

#include "doppel/base/core/time.h"
#include "doppel/export.h"

namespace doppel {

struct ArrivingByte {
  Time arrival;
  std::uint8_t byte = 0;
};

class DOPPEL_API ArrivingBytes {
 public:
  [[nodiscard]] std::deque<ArrivingByte>& bytes() { return bytes_; }
  void add(Time arrival, std::uint8_t byte) { bytes_.push_back({arrival, byte}); }
  // Moves those that have arrived by `until` into `out`; how many.
  std::size_t take(std::span<std::uint8_t> out, Time until) {
    std::size_t count = 0;
    for (; count < out.size() && !bytes_.empty() && bytes_.front().arrival <= until; bytes_.pop_front())
      out[count++] = bytes_.front().byte;
    return count;
  }
  // nullopt: none is on its way.
  [[nodiscard]] std::optional<Time> next_arrival() const {
    if (bytes_.empty()) return {};
    return bytes_.front().arrival;
  }

 private:
  std::deque<ArrivingByte> bytes_;
};

}  // namespace doppel
