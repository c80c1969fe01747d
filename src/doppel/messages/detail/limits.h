#pragma once
// Bounds of what comes from outside.

#include <cstddef>

namespace doppel::messages_detail {

// Bytes of one message: aliases can make a short YAML text mean a huge one, and a description from the
// network can declare an array of any size.
inline constexpr std::size_t kMaxMessageSize = std::size_t{64} << 20;

}  // namespace doppel::messages_detail
