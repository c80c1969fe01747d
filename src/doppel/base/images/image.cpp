#include "doppel/base/images/image.h"

#include <stdexcept>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/plugin_module.h"

namespace doppel {
namespace {

template <typename Function>
Function codec(const char* symbol) {
  return reinterpret_cast<Function>(plugin_symbol("doppel_image_codecs", symbol));
}

}  // namespace

Bitmap decode_image(std::string_view bytes, const std::string& name) {
  using Decode = bool (*)(std::string_view, Bitmap&, std::string&);
  static const auto decode = codec<Decode>("doppel_decode_image");
  Bitmap image;
  std::string problem;
  if (!decode(bytes, image, problem)) {
    throw InputError("image.unreadable", make_location(name), "the picture cannot be read: " + problem,
                     "PNG and JPEG are read; convert it to one of them");
  }
  return image;
}

std::string encode_png(const Bitmap& image, PngSpeed speed) {
  using Encode = bool (*)(const Bitmap&, bool, std::string&);
  static const auto encode = codec<Encode>("doppel_encode_png");
  std::string out;
  if (!encode(image, speed == PngSpeed::fast, out))
    throw std::runtime_error("libpng could not encode a picture");
  return out;
}

std::string encode_jpeg(const Bitmap& image, int quality) {
  using Encode = bool (*)(const Bitmap&, int, std::string&);
  static const auto encode = codec<Encode>("doppel_encode_jpeg");
  std::string out;
  if (!encode(image, quality, out)) throw std::runtime_error("libjpeg-turbo could not encode a picture");
  return out;
}

}  // namespace doppel
