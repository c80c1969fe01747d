#include "doppel/devices/frames/checksums.h"

#include <array>
#include <cstddef>

namespace doppel {
namespace {

using Table = std::array<std::uint16_t, 256>;

// The remainder of each byte in the upper half of the register.
constexpr Table table_of(std::uint16_t polynomial) {
  Table out{};
  for (std::size_t byte = 0; byte < out.size(); ++byte) {
    auto crc = static_cast<std::uint16_t>(byte << 8);
    for (int bit = 0; bit < 8; ++bit) {
      const bool carry = (crc & 0x8000) != 0;
      crc = static_cast<std::uint16_t>(crc << 1);
      if (carry) crc = static_cast<std::uint16_t>(crc ^ polynomial);
    }
    out[byte] = crc;
  }
  return out;
}

constexpr Table kDynamixel = table_of(0x8005), kCcitt = table_of(0x1021);

std::uint16_t crc_of(std::span<const std::uint8_t> bytes, const Table& table, std::uint16_t crc) {
  for (const std::uint8_t byte : bytes)
    crc = static_cast<std::uint16_t>((crc << 8) ^ table[static_cast<std::size_t>((crc >> 8) ^ byte)]);
  return crc;
}

}  // namespace

std::uint16_t dynamixel_crc(std::span<const std::uint8_t> bytes, std::uint16_t crc) {
  return crc_of(bytes, kDynamixel, crc);
}

std::uint16_t ccitt_crc(std::span<const std::uint8_t> bytes, std::uint16_t crc) {
  return crc_of(bytes, kCcitt, crc);
}

std::uint8_t feetech_sum(std::span<const std::uint8_t> bytes) {
  std::uint8_t sum = 0;
  for (const std::uint8_t byte : bytes) sum = static_cast<std::uint8_t>(sum + byte);
  return static_cast<std::uint8_t>(~sum);
}

}  // namespace doppel
