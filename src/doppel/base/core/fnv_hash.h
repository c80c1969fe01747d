#pragma once
// FNV-1a of 64 bits. Source: G. Fowler, L. C. Noll, K.-P. Vo and D. Eastlake, "The FNV non-cryptographic hash algorithm".

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace doppel {

inline constexpr std::uint64_t kEmptyHash = 0xCBF29CE484222325ull;  // of no bytes

// One step of the hash, with a byte, or with a whole word as if it were one.
constexpr std::uint64_t fnv_mixed(std::uint64_t hash, std::uint64_t bits) {
  return (hash ^ bits) * 0x100000001B3ull;
}
constexpr std::uint64_t fnv_hash(std::string_view text, std::uint64_t hash = kEmptyHash) {
  for (const char c : text) hash = fnv_mixed(hash, static_cast<unsigned char>(c));
  return hash;
}
constexpr std::uint64_t fnv_hash(std::span<const std::byte> bytes) {
  std::uint64_t hash = kEmptyHash;
  for (const std::byte byte : bytes) hash = fnv_mixed(hash, static_cast<std::uint64_t>(byte));
  return hash;
}

}  // namespace doppel
