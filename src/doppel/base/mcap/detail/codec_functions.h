#pragma once
// The functions of the module doppel_compression.

#include <cstddef>

namespace doppel {

// Each returns the number of bytes written, or kCodecFailed with a reason of the library's.
inline constexpr std::size_t kCodecFailed = static_cast<std::size_t>(-1);
struct CodecFunctions {
  std::size_t (*bound)(std::size_t size);  // of compressed bytes
  std::size_t (*compress)(const void* source, std::size_t size, void* result, std::size_t capacity, int level,
                          const char** reason);
  std::size_t (*decompress)(const void* source, std::size_t size, void* result, std::size_t capacity,
                            const char** reason);
};
struct Codecs {
  CodecFunctions zstd, lz4;
};
inline constexpr const char* kCodecsModule = "doppel_compression";
inline constexpr const char* kCodecsEntry = "doppel_codecs";  // const Codecs* doppel_codecs()

}  // namespace doppel
