#pragma once
// A hash over the bits of numbers, in order.

#include <bit>
#include <cstdint>
#include <span>

namespace doppel {

inline constexpr std::uint64_t kEmptyHash = 0xCBF29CE484222325ull;

inline std::uint64_t mixed(std::uint64_t hash, std::uint64_t bits) {
  hash = (hash ^ bits) * 0x9E3779B97F4A7C15ull;
  return hash ^ (hash >> 29);
}
inline std::uint64_t mixed(std::uint64_t hash, std::span<const double> values) {
  for (const double value : values) hash = mixed(hash, std::bit_cast<std::uint64_t>(value));
  return hash;
}

}  // namespace doppel
