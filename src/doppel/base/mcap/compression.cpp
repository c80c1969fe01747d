#include "doppel/base/mcap/detail/compression.h"

#include <fmt/format.h>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/names.h"
#include "doppel/base/core/plugin_module.h"
#include "doppel/base/mcap/detail/codec_functions.h"

namespace doppel {
namespace {

// nullptr: no compression.
const CodecFunctions* codec_named(std::string_view name) {
  static const std::vector<std::string> kNames{"zstd", "lz4"};
  if (name.empty()) return nullptr;
  if (name != kNames[0] && name != kNames[1]) {
    const std::string text(name.substr(0, 40));
    throw InputError("mcap.compression", {},
                     fmt::format("there is no compression '{}'{}", text, did_you_mean(text, kNames)),
                     "it is zstd, lz4 or none");
  }
  using Entry = const Codecs* (*)();
  static const Codecs* const codecs = reinterpret_cast<Entry>(plugin_symbol(kCodecsModule, kCodecsEntry))();
  return name == kNames[0] ? &codecs->zstd : &codecs->lz4;
}

}  // namespace

void compress(std::string_view name, int level, std::span<const std::byte> bytes,
              std::vector<std::byte>& out) {
  const CodecFunctions* const codec = codec_named(name);
  if (codec == nullptr) {
    out.insert(out.end(), bytes.begin(), bytes.end());
    return;
  }
  const std::size_t start = out.size(), bound = codec->bound(bytes.size());
  out.resize(start + bound);
  const char* reason = "";
  const std::size_t size = codec->compress(bytes.data(), bytes.size(), &out[start], bound, level, &reason);
  if (size == kCodecFailed)
    throw std::runtime_error(fmt::format("compression by {} failed: {}", name, reason));
  out.resize(start + size);
}

std::vector<std::byte> decompress(std::string_view name, std::span<const std::byte> bytes, std::size_t size) {
  const auto refuse = [&](const std::string& why) {
    throw InputError("mcap.damaged", {}, fmt::format("the data compressed by {} are damaged: {}", name, why));
  };
  const CodecFunctions* const codec = codec_named(name);
  std::vector<std::byte> out;
  if (codec == nullptr) {
    if (bytes.size() != size)
      throw InputError("mcap.damaged", {}, fmt::format("{} bytes are said to be {}", bytes.size(), size));
    out.assign(bytes.begin(), bytes.end());
    return out;
  }
  // Neither compresses to less than a few thousandths, so that a damaged size reserves no memory.
  constexpr std::size_t kMaxExpansion = 200'000;
  if (size / kMaxExpansion > bytes.size()) refuse(fmt::format("{} bytes cannot be {}", bytes.size(), size));
  out.resize(size);
  const char* reason = "";
  const std::size_t written = codec->decompress(bytes.data(), bytes.size(), out.data(), size, &reason);
  if (written == kCodecFailed) refuse(reason);
  if (written != size) refuse(fmt::format("they are {} bytes, not {}", written, size));
  return out;
}

}  // namespace doppel
