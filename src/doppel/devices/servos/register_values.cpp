#include <cstddef>

#include "doppel/devices/servos/servo_model.h"

namespace doppel {
namespace {

// The sign bit of a register whose lower bits are the magnitude; 0: it has none.
std::int64_t sign_bit(RegisterSign sign) {
  switch (sign) {
    case RegisterSign::bit_10:
      return std::int64_t{1} << 10;
    case RegisterSign::bit_11:
      return std::int64_t{1} << 11;
    case RegisterSign::bit_15:
      return std::int64_t{1} << 15;
    case RegisterSign::none:
    case RegisterSign::twos_complement:
      break;
  }
  return 0;
}

}  // namespace

std::int64_t decode_register(const ServoRegister& which, std::span<const std::uint8_t> bytes) {
  std::int64_t value = 0;
  for (std::size_t i = 0; i < which.size; ++i) value |= static_cast<std::int64_t>(bytes[i]) << (8 * i);
  if (const std::int64_t bit = sign_bit(which.sign); bit != 0)
    return (value & bit) != 0 ? -(value & (bit - 1)) : value & (bit - 1);
  const std::int64_t range = std::int64_t{1} << (8 * which.size);
  if (which.sign == RegisterSign::twos_complement && value >= range / 2) value -= range;
  return value;
}

void encode_register(const ServoRegister& which, std::int64_t value, std::span<std::uint8_t> bytes) {
  std::int64_t raw = value;
  if (const std::int64_t bit = sign_bit(which.sign); bit != 0) {
    const std::int64_t magnitude = (value < 0 ? -value : value) & (bit - 1);
    raw = value < 0 ? magnitude | bit : magnitude;
  }
  for (std::size_t i = 0; i < which.size; ++i) bytes[i] = static_cast<std::uint8_t>(raw >> (8 * i));
}

}  // namespace doppel
