#pragma once
// SHA-256. Source: FIPS 180-4.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "doppel/export.h"

namespace doppel {

using Sha256 = std::array<std::uint8_t, 32>;

DOPPEL_API Sha256 sha256(std::span<const std::byte> bytes);
DOPPEL_API std::string sha256_hex(std::string_view text);  // 64 lower-case digits

}  // namespace doppel
