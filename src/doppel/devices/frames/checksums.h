#pragma once
// The checks at the end of servo protocols' frames.

#include <cstdint>
#include <span>

#include "doppel/export.h"

namespace doppel {

// CRC-16 of Dynamixel's protocol 2.0: polynomial 0x8005, not reflected, initial value 0 or the CRC of the
// bytes before. Source: emanual.robotis.com, "CRC calculation".
[[nodiscard]] DOPPEL_API std::uint16_t dynamixel_crc(std::span<const std::uint8_t> bytes,
                                                     std::uint16_t crc = 0);

// CRC-16/CCITT-FALSE: polynomial 0x1021, not reflected, initial value 0xFFFF.
[[nodiscard]] DOPPEL_API std::uint16_t ccitt_crc(std::span<const std::uint8_t> bytes,
                                                 std::uint16_t crc = 0xFFFF);

// The inverted sum of Feetech's frames, from the id to the last parameter. It misses one of 256 damaged
// frames.
[[nodiscard]] DOPPEL_API std::uint8_t feetech_sum(std::span<const std::uint8_t> bytes);

}  // namespace doppel
