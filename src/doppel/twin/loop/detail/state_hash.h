#pragma once
// A hash over the bits of numbers, in order.

#include <bit>
#include <cstdint>
#include <span>

#include "doppel/base/core/fnv_hash.h"

namespace doppel {

inline std::uint64_t mixed(std::uint64_t hash, std::uint64_t bits) {
  hash = (hash ^ bits) * 0x9E3779B97F4A7C15ull;
  return hash ^ (hash >> 29);
}
// Three independent chains, so that the processor does not wait for each product before the next one.
inline std::uint64_t mixed(std::uint64_t hash, std::span<const double> values) {
  std::uint64_t second = kEmptyHash, third = kEmptyHash;
  std::size_t i = 0;
  for (; i + 3 <= values.size(); i += 3) {
    hash = mixed(hash, std::bit_cast<std::uint64_t>(values[i]));
    second = mixed(second, std::bit_cast<std::uint64_t>(values[i + 1]));
    third = mixed(third, std::bit_cast<std::uint64_t>(values[i + 2]));
  }
  for (; i < values.size(); ++i) hash = mixed(hash, std::bit_cast<std::uint64_t>(values[i]));
  return mixed(mixed(hash, second), third);
}

}  // namespace doppel
