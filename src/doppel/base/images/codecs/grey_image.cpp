// PNG by libpng and JPEG by libjpeg-turbo.
#include "doppel/base/images/grey_image.h"

#include <jpeglib.h>
#include <png.h>

#include <algorithm>
#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string_view>

#include "doppel/export.h"

namespace doppel {
namespace {

struct Close {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, Close>;

bool accept_size(std::size_t width, std::size_t height, int most, std::string& problem) {
  const auto limit = static_cast<std::size_t>(most);
  if (width >= 2 && height >= 2 && width <= limit && height <= limit) return true;
  problem = "it has " + std::to_string(width) + " x " + std::to_string(height) + " pixels; from 2 x 2 to " +
            std::to_string(most) + " x " + std::to_string(most) + " are read";
  return false;
}

// -- PNG

[[noreturn]] void on_png_error(png_structp png, png_const_charp text) {
  *static_cast<std::string*>(png_get_error_ptr(png)) = text;
  png_longjmp(png, 1);
}
void on_png_warning(png_structp /*png*/, png_const_charp /*text*/) {}

class PngReader {
 public:
  explicit PngReader(std::string& problem)
      : png_(png_create_read_struct(PNG_LIBPNG_VER_STRING, &problem, &on_png_error, &on_png_warning)),
        info_(png_ == nullptr ? nullptr : png_create_info_struct(png_)) {}
  ~PngReader() { png_destroy_read_struct(&png_, &info_, nullptr); }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;

  // libpng reports errors by longjmp: nothing with a destructor is created after setjmp.
  bool read(std::FILE* file, int most, GreyImage& out, std::string& problem) {
    if (info_ == nullptr) return false;
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    png_init_io(png_, file);
    png_read_info(png_, info_);
    if (!accept_size(png_get_image_width(png_, info_), png_get_image_height(png_, info_), most, problem))
      return false;
    out.width = static_cast<int>(png_get_image_width(png_, info_));
    out.height = static_cast<int>(png_get_image_height(png_, info_));
    png_set_expand(png_);  // palettes, and fewer than 8 bits
    if (png_get_bit_depth(png_, info_) == 16) png_set_swap(png_);
    const int passes = png_set_interlace_handling(png_);
    png_read_update_info(png_, info_);
    bytes_.resize(png_get_rowbytes(png_, info_) * static_cast<std::size_t>(out.height));
    for (int pass = 0; pass < passes; ++pass) {
      for (int y = 0; y < out.height; ++y) png_read_row(png_, row(y), nullptr);
    }
    take(out);
    return true;
  }

 private:
  png_bytep row(int y) { return bytes_.data() + png_get_rowbytes(png_, info_) * static_cast<std::size_t>(y); }
  void take(GreyImage& out) {
    const int channels = png_get_channels(png_, info_);
    const bool wide = png_get_bit_depth(png_, info_) == 16;
    const int seen = (png_get_color_type(png_, info_) & PNG_COLOR_MASK_ALPHA) != 0 ? channels - 1 : channels;
    out.brightest = wide ? 65535 : 255;
    out.values.reserve(static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height));
    for (int y = 0; y < out.height; ++y) {
      for (int x = 0; x < out.width; ++x) {
        for (int k = 0; k < seen; ++k) {
          std::uint16_t value = 0;
          const auto at = static_cast<std::size_t>(x * channels + k);
          if (wide) {
            std::memcpy(&value, row(y) + 2 * at, sizeof value);
          } else {
            value = row(y)[at];
          }
          if (k == 0) out.values.push_back(value);
          out.brightest_of_all = std::max<int>(out.brightest_of_all, value);
        }
      }
    }
  }

  png_structp png_;
  png_infop info_;
  std::vector<png_byte> bytes_;
};

// -- JPEG

struct JpegErrors {
  jpeg_error_mgr manager;  // the first member: libjpeg has a pointer to it
  std::jmp_buf exit;
  char text[JMSG_LENGTH_MAX];
};

[[noreturn]] void on_jpeg_error(j_common_ptr jpeg) {
  auto* const errors = reinterpret_cast<JpegErrors*>(jpeg->err);
  errors->manager.format_message(jpeg, errors->text);
  std::longjmp(errors->exit, 1);
}
void on_jpeg_message(j_common_ptr /*jpeg*/) {}

class JpegReader {
 public:
  JpegReader() {
    jpeg_.err = jpeg_std_error(&errors_.manager);
    errors_.manager.error_exit = &on_jpeg_error;
    errors_.manager.output_message = &on_jpeg_message;
    errors_.text[0] = '\0';
  }
  ~JpegReader() { jpeg_destroy_decompress(&jpeg_); }
  JpegReader(const JpegReader&) = delete;
  JpegReader& operator=(const JpegReader&) = delete;

  bool read(std::FILE* file, int most, GreyImage& out, std::string& problem) {
    if (setjmp(errors_.exit) != 0) {
      problem = errors_.text;
      return false;
    }
    jpeg_create_decompress(&jpeg_);
    jpeg_stdio_src(&jpeg_, file);
    jpeg_read_header(&jpeg_, TRUE);
    if (!accept_size(jpeg_.image_width, jpeg_.image_height, most, problem)) return false;
    jpeg_start_decompress(&jpeg_);
    out.width = static_cast<int>(jpeg_.output_width);
    out.height = static_cast<int>(jpeg_.output_height);
    const auto channels = static_cast<std::size_t>(jpeg_.output_components);
    row_.resize(channels * jpeg_.output_width);
    while (jpeg_.output_scanline < jpeg_.output_height) {
      JSAMPROW rows[] = {row_.data()};
      jpeg_read_scanlines(&jpeg_, rows, 1);
      for (std::size_t i = 0; i < row_.size(); i += channels) out.values.push_back(row_[i]);
      out.brightest_of_all = std::max<int>(out.brightest_of_all, *std::max_element(row_.begin(), row_.end()));
    }
    return true;
  }

 private:
  jpeg_decompress_struct jpeg_{};
  JpegErrors errors_{};
  std::vector<JSAMPLE> row_;
};

}  // namespace
}  // namespace doppel

// False: the bytes of a file are no picture, for the reason in `problem`. `most`: pixels in a row or column.
extern "C" DOPPEL_API bool doppel_read_grey_image(std::string_view bytes, int most, doppel::GreyImage& out,
                                                  std::string& problem) {
  const doppel::File file(fmemopen(const_cast<char*>(bytes.data()), bytes.size(), "rb"));
  unsigned char head[8] = {};
  if (file == nullptr || std::fread(head, 1, sizeof head, file.get()) != sizeof head) {
    problem = "it is empty";
    return false;
  }
  std::rewind(file.get());
  if (png_sig_cmp(head, 0, sizeof head) == 0)
    return doppel::PngReader(problem).read(file.get(), most, out, problem);
  if (head[0] == 0xff && head[1] == 0xd8) return doppel::JpegReader().read(file.get(), most, out, problem);
  problem = "it is neither a PNG nor a JPEG image";
  return false;
}
