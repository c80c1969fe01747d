#pragma once
// Bounds of input from files and the network.

#include <cstddef>

namespace doppel::messages_detail {

// Bytes of one message: aliases can expand a short YAML text to a huge message, and a description from the
// network can declare an array of any size.
inline constexpr std::size_t kMaxMessageSize = std::size_t{64} << 20;

}  // namespace doppel::messages_detail
