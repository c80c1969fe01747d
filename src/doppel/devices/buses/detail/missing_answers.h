#pragma once
// The answers that did not come in time, and may still come: behind a network, an adapter that holds bytes
// back, or a busy machine. Neither protocol numbers its answers, so that their sizes take the place of
// numbers: a request after a loss asks for more bytes than it needs, so that no missing answer has its size.
// A link keeps the order of its bytes, so that the first answer that can be no missing one ends the doubt.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace doppel {

class MissingAnswers {
 public:
  static constexpr std::size_t kMaxExtra = 15;  // bytes, of a request

  [[nodiscard]] bool empty() const { return empty_; }
  [[nodiscard]] bool has(int id, std::size_t size) const { return (sizes_of(id) & bit(size)) != 0; }
  void add(int id, std::size_t size) {
    sizes_[static_cast<std::uint8_t>(id)] |= bit(size);
    empty_ = false;
  }
  void forget() {
    if (!empty_) sizes_.fill(0);
    empty_ = true;
  }
  // The fewest bytes that make an answer of `size` bytes unlike the missing ones of these servos; nullopt:
  // kMaxExtra are too few.
  [[nodiscard]] std::optional<std::size_t> extra(std::span<const std::uint8_t> ids, std::size_t size) const {
    if (empty_) return 0;
    std::uint64_t all = 0;
    for (const std::uint8_t id : ids) all |= sizes_of(id);
    for (std::size_t extra = 0; extra <= kMaxExtra; ++extra) {
      if ((all & bit(size + extra)) == 0) return extra;
    }
    return {};
  }

 private:
  static constexpr std::size_t kLastBit = 63;  // of all larger answers, too
  static std::uint64_t bit(std::size_t size) { return std::uint64_t{1} << std::min(size, kLastBit); }
  [[nodiscard]] std::uint64_t sizes_of(int id) const { return sizes_[static_cast<std::uint8_t>(id)]; }

  std::array<std::uint64_t, 256> sizes_{};  // by id, a bit for each size
  bool empty_ = true;
};

}  // namespace doppel
