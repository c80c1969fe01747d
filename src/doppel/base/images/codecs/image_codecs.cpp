// PNG and JPEG by their libraries. Functions return false with the reason in `problem`.
#include <png.h>
#include <turbojpeg.h>

#include <cstring>
#include <memory>
#include <string>
#include <string_view>

#include "doppel/base/images/image.h"
#include "doppel/export.h"

namespace doppel {
namespace {

int png_format(int channels) {
  switch (channels) {
    case 1:
      return PNG_FORMAT_GRAY;
    case 2:
      return PNG_FORMAT_GA;
    case 3:
      return PNG_FORMAT_RGB;
    default:
      return PNG_FORMAT_RGBA;
  }
}

bool refuse_size(std::size_t width, std::size_t height, std::string& problem) {
  if (width > 0 && height > 0 && width <= kMaxImagePixels / height) return false;
  problem = "it has " + std::to_string(width) + " x " + std::to_string(height) + " pixels";
  return true;
}

bool decode_png(std::string_view bytes, Bitmap& image, std::string& problem) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  const std::unique_ptr<png_image, decltype(&png_image_free)> guard(&png, &png_image_free);
  if (png_image_begin_read_from_memory(&png, bytes.data(), bytes.size()) == 0) {
    problem = png.message;
    return false;
  }
  if (refuse_size(png.width, png.height, problem)) return false;
  const bool colour = (png.format & PNG_FORMAT_FLAG_COLOR) != 0,
             alpha = (png.format & PNG_FORMAT_FLAG_ALPHA) != 0;
  image.channels = (colour ? 3 : 1) + (alpha ? 1 : 0);
  png.format = static_cast<png_uint_32>(png_format(image.channels));
  image.width = static_cast<int>(png.width);
  image.height = static_cast<int>(png.height);
  image.pixels.resize(PNG_IMAGE_SIZE(png));
  if (png_image_finish_read(&png, nullptr, image.pixels.data(), 0, nullptr) == 0) {
    problem = png.message;
    return false;
  }
  return true;
}

struct JpegHandle {
  explicit JpegHandle(tjhandle made) : handle(made) {}
  ~JpegHandle() {
    if (handle != nullptr) tjDestroy(handle);
  }
  JpegHandle(const JpegHandle&) = delete;
  JpegHandle& operator=(const JpegHandle&) = delete;
  tjhandle handle;
};

constexpr const char* kDamagedJpeg = "its JPEG data is damaged or incomplete";

bool decode_jpeg(std::string_view bytes, Bitmap& image, std::string& problem) {
  const JpegHandle jpeg(tjInitDecompress());
  const auto* data = reinterpret_cast<const unsigned char*>(bytes.data());
  int subsampling = 0, space = 0;
  if (tjDecompressHeader3(jpeg.handle, data, bytes.size(), &image.width, &image.height, &subsampling,
                          &space) != 0) {
    problem = kDamagedJpeg;
    return false;
  }
  if (refuse_size(static_cast<std::size_t>(image.width), static_cast<std::size_t>(image.height), problem))
    return false;
  image.channels = space == TJCS_GRAY ? 1 : 3;
  image.pixels.resize(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) *
                      static_cast<std::size_t>(image.channels));
  const int failed = tjDecompress2(jpeg.handle, data, bytes.size(), image.pixels.data(), image.width, 0,
                                   image.height, image.channels == 1 ? TJPF_GRAY : TJPF_RGB, 0);
  // A warning (a file with a few bytes too many) still gives the whole picture.
  if (failed != 0 && tjGetErrorCode(jpeg.handle) != TJERR_WARNING) {
    problem = kDamagedJpeg;
    return false;
  }
  return true;
}

struct PngWriter {
  PngWriter() : png(png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr)) {
    info = png == nullptr ? nullptr : png_create_info_struct(png);
  }
  ~PngWriter() { png_destroy_write_struct(&png, &info); }
  PngWriter(const PngWriter&) = delete;
  PngWriter& operator=(const PngWriter&) = delete;
  png_structp png;
  png_infop info = nullptr;
};

void append_png(png_structp png, png_bytep data, std::size_t size) {
  static_cast<std::string*>(png_get_io_ptr(png))->append(reinterpret_cast<const char*>(data), size);
}

}  // namespace
}  // namespace doppel

extern "C" DOPPEL_API bool doppel_decode_image(std::string_view bytes, doppel::Bitmap& image,
                                               std::string& problem) {
  using namespace std::string_view_literals;
  if (bytes.starts_with("\x89PNG"sv)) return doppel::decode_png(bytes, image, problem);
  if (bytes.starts_with("\xff\xd8\xff"sv)) return doppel::decode_jpeg(bytes, image, problem);
  problem = "it is neither PNG nor JPEG";
  return false;
}

extern "C" DOPPEL_API bool doppel_encode_png(const doppel::Bitmap& image, bool fast, std::string& out) {
  static constexpr int kColour[] = {0, PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA, PNG_COLOR_TYPE_RGB,
                                    PNG_COLOR_TYPE_RGB_ALPHA};
  doppel::PngWriter writer;
  if (writer.info == nullptr || setjmp(png_jmpbuf(writer.png)) != 0) return false;
  png_set_write_fn(writer.png, &out, &doppel::append_png, nullptr);
  png_set_compression_level(writer.png, fast ? 1 : 6);
  if (fast) png_set_filter(writer.png, 0, PNG_FILTER_SUB);
  png_set_IHDR(writer.png, writer.info, static_cast<png_uint_32>(image.width),
               static_cast<png_uint_32>(image.height), 8, kColour[image.channels], PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(writer.png, writer.info);
  for (int y = 0; y < image.height; ++y) png_write_row(writer.png, image.at(0, y));
  png_write_end(writer.png, writer.info);
  return true;
}

extern "C" DOPPEL_API bool doppel_encode_jpeg(const doppel::Bitmap& image, int quality, std::string& out) {
  const doppel::JpegHandle jpeg(tjInitCompress());
  unsigned char* data = nullptr;
  unsigned long size = 0;  // NOLINT(google-runtime-int): the type of the library
  const bool grey = image.channels == 1;
  const int failed =
      tjCompress2(jpeg.handle, image.pixels.data(), image.width, 0, image.height, grey ? TJPF_GRAY : TJPF_RGB,
                  &data, &size, grey ? TJSAMP_GRAY : TJSAMP_420, quality, 0);
  if (failed == 0) out.assign(reinterpret_cast<const char*>(data), size);
  tjFree(data);
  return failed == 0;
}
