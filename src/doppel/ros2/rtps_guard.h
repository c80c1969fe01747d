#pragma once
// A look at a datagram before Fast DDS believes it.

#include <cstddef>
#include <cstdint>
#include <span>

namespace doppel::ros2 {

// Memory for a whole sample is taken when its first fragment comes, on the word of whoever sent it.
constexpr std::uint32_t kLargestSample = 256u * 1024 * 1024;

// False for what is no RTPS message and for fragments of nothing or of more than kLargestSample. Allocates
// nothing.
bool is_acceptable(std::span<const std::uint8_t> datagram);

}  // namespace doppel::ros2
