#pragma once
// Pictures in memory, and their files: PNG by libpng, JPEG by libjpeg-turbo. Both libraries are loaded when the first
// picture is read or written. Any thread.

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/export.h"

namespace doppel {

// Rows from the top, pixels from the left, channels interleaved; 8 bits a channel, as in the file (sRGB where colour).
struct DOPPEL_API Bitmap {
  int width = 0, height = 0;
  int channels = 0;  // 1 grey, 2 grey and alpha, 3 RGB, 4 RGBA
  std::vector<std::uint8_t> pixels;

  [[nodiscard]] bool empty() const { return pixels.empty(); }
  [[nodiscard]] const std::uint8_t* at(int x, int y) const {
    return &pixels[(static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                    static_cast<std::size_t>(x)) *
                   static_cast<std::size_t>(channels)];
  }
};

inline constexpr std::size_t kMaxImagePixels = std::size_t{1} << 26;

// The format is recognised by its first bytes. `name` is the file in messages. Throws InputError "image.unreadable":
// neither PNG nor JPEG, damaged, or of more than kMaxImagePixels.
DOPPEL_API Bitmap decode_image(std::string_view bytes, const std::string& name);

enum class PngSpeed { small, fast };  // fast: three times as quick, a fifth larger
// Precondition: 1 to 4 channels and that many pixels.
DOPPEL_API std::string encode_png(const Bitmap& image, PngSpeed speed = PngSpeed::small);
// Precondition: 1 or 3 channels. quality: 1 to 100.
DOPPEL_API std::string encode_jpeg(const Bitmap& image, int quality);

}  // namespace doppel
