#pragma once
// Compression of chunks by the system's libraries, in a plugin module that is loaded at first use.

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/export.h"

namespace doppel {

// "zstd", "lz4" (frames) or "", which copies. Appended to `out`. level: of zstd; 0 is its default. Throws
// MissingModule; InputError "mcap.compression" for another name, with the known ones.
DOPPEL_API void compress(std::string_view name, int level, std::span<const std::byte> bytes,
                         std::vector<std::byte>& out);
// `size`: of the result. Throws also InputError "mcap.damaged": the data are damaged, or of another size.
[[nodiscard]] DOPPEL_API std::vector<std::byte> decompress(std::string_view name,
                                                           std::span<const std::byte> bytes,
                                                           std::size_t size);

}  // namespace doppel
