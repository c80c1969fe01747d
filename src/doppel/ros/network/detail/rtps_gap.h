#pragma once
// A sample left out of a datagram.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace doppel::ros2 {

// The datagram with each sample of `writer` (its entity), whole or a fragment, replaced by a GAP (RTPS's
// submessage for irrelevant samples), so that no reader requests it. Empty if there is no such sample, or the
// datagram cannot be read.
std::vector<std::uint8_t> without_samples(std::span<const std::uint8_t> datagram,
                                          const std::array<std::uint8_t, 4>& writer);

}  // namespace doppel::ros2
