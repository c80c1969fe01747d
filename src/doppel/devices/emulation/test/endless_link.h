#pragma once
// A link whose partner sends the same bytes again and again, faster than they are read.

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "doppel/devices/emulation/emulated_link.h"

namespace doppel::test {

class EndlessLink final : public EmulatedLink {
 public:
  using EmulatedLink::EmulatedLink;

  // The partner sends these bytes from now on. Empty: the devices answer.
  void begin(std::vector<std::uint8_t> bytes) {
    bytes_ = std::move(bytes);
    next_ = 0;
    left_ = kMaxReads;
  }
  std::size_t read(std::span<std::uint8_t> out, Time deadline) override {
    if (bytes_.empty() || left_ == 0) return EmulatedLink::read(out, deadline);
    constexpr Duration kReadTime{100'000};
    wait_until(now() + kReadTime);
    --left_;
    for (std::uint8_t& byte : out) {
      byte = bytes_[next_];
      next_ = (next_ + 1) % bytes_.size();
    }
    return out.size();
  }

 private:
  // A host that reads without end fails its test, and does not hang it.
  static constexpr int kMaxReads = 50'000;

  std::vector<std::uint8_t> bytes_;
  std::size_t next_ = 0;
  int left_ = 0;
};

}  // namespace doppel::test
