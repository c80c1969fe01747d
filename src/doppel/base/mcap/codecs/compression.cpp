// zstd and the frames of lz4.
#include <lz4frame.h>
#include <zstd.h>

#include "doppel/base/mcap/detail/codec_functions.h"
#include "doppel/export.h"

namespace doppel {
namespace {

std::size_t checked_zstd(std::size_t result, const char** reason) {
  if (ZSTD_isError(result) == 0) return result;
  *reason = ZSTD_getErrorName(result);
  return kCodecFailed;
}

std::size_t compress_zstd(const void* source, std::size_t size, void* result, std::size_t capacity, int level,
                          const char** reason) {
  return checked_zstd(ZSTD_compress(result, capacity, source, size, level), reason);
}

std::size_t decompress_zstd(const void* source, std::size_t size, void* result, std::size_t capacity,
                            const char** reason) {
  return checked_zstd(ZSTD_decompress(result, capacity, source, size), reason);
}

std::size_t bound_lz4(std::size_t size) {
  return LZ4F_compressFrameBound(size, nullptr);
}

std::size_t compress_lz4(const void* source, std::size_t size, void* result, std::size_t capacity,
                         int /*level*/, const char** reason) {
  const std::size_t written = LZ4F_compressFrame(result, capacity, source, size, nullptr);
  if (LZ4F_isError(written) == 0) return written;
  *reason = LZ4F_getErrorName(written);
  return kCodecFailed;
}

// One frame, which may not end before the result is full.
std::size_t decompress_lz4(const void* source, std::size_t size, void* result, std::size_t capacity,
                           const char** reason) {
  LZ4F_dctx* context = nullptr;
  std::size_t hint = LZ4F_createDecompressionContext(&context, LZ4F_VERSION);
  const auto* next = static_cast<const char*>(source);
  auto* out = static_cast<char*>(result);
  std::size_t left = size, room = capacity;
  while (LZ4F_isError(hint) == 0 && left > 0) {
    std::size_t written = room, consumed = left;
    hint = LZ4F_decompress(context, out, &written, next, &consumed, nullptr);
    if (LZ4F_isError(hint) == 0 && written == 0 && consumed == 0)
      break;  // more data than the result has room for
    next += consumed;
    left -= consumed;
    out += written;
    room -= written;
    if (hint == 0) break;
  }
  LZ4F_freeDecompressionContext(context);
  if (hint == 0 && left == 0) return capacity - room;
  *reason = LZ4F_isError(hint) != 0 ? LZ4F_getErrorName(hint) : "the frame does not end where its data do";
  return kCodecFailed;
}

}  // namespace
}  // namespace doppel

extern "C" DOPPEL_API const doppel::Codecs* doppel_codecs() {
  static const doppel::Codecs codecs{{ZSTD_compressBound, doppel::compress_zstd, doppel::decompress_zstd},
                                     {doppel::bound_lz4, doppel::compress_lz4, doppel::decompress_lz4}};
  return &codecs;
}
