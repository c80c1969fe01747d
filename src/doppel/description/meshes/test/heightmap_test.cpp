// Heights from images.
#include "doppel/description/meshes/heightmap.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <jpeglib.h>
#include <png.h>

#include <cstdio>
#include <filesystem>
#include <fstream>

#include "doppel/base/core/diagnostic.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

fs::path file_named(const std::string& name) {
  return fs::path(::testing::TempDir()) / ("doppel_heightmap_" + name);
}

// rows: from the top; `channels` values for each pixel.
template <class Value>
fs::path write_png(const std::string& name, int width, int channels, const std::vector<Value>& values) {
  const fs::path out = file_named(name);
  std::FILE* const file = std::fopen(out.c_str(), "wb");
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_init_io(png, file);
  const int height = static_cast<int>(values.size()) / (width * channels);
  const int colours[] = {PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA, PNG_COLOR_TYPE_RGB,
                         PNG_COLOR_TYPE_RGBA};
  png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height),
               8 * sizeof(Value), colours[channels - 1], PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, info);
  if (sizeof(Value) == 2) png_set_swap(png);
  for (int y = 0; y < height; ++y)
    png_write_row(png, reinterpret_cast<png_const_bytep>(values.data() + y * width * channels));
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  std::fclose(file);
  return out;
}

Heightmap map_of(const fs::path& file, double height) {
  Heightmap out;
  out.image = {file.filename().string(), file.string()};
  out.size = {4, 2, height};
  return out;
}

std::string refusal(const fs::path& file) {
  try {
    load_heightmap(map_of(file, 1));
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(HeightmapImage, BrightestPixelHasHeightAndFirstRowIsAtGreatestY) {
  const fs::path image = write_png<std::uint8_t>("grey.png", 3, 1, {0, 50, 100, 200, 150, 0});
  const HeightField field = load_heightmap(map_of(image, 10));
  EXPECT_EQ(field.columns, 3);
  EXPECT_EQ(field.rows, 2);
  EXPECT_THAT(field.heights, ElementsAre(10, 7.5F, 0, 0, 2.5F, 5));
  EXPECT_EQ(field.point(2, 1), Eigen::Vector3d(2, 1, 5));
  EXPECT_THAT(load_heightmap(map_of(image, -10)).heights, ElementsAre(0, 2.5F, 10, 10, 7.5F, 5));
}

TEST(HeightmapImage, SixteenBitsAreKept) {
  const fs::path image = write_png<std::uint16_t>("wide.png", 2, 1, {0, 1, 256, 65535});
  const HeightField field = load_heightmap(map_of(image, 65535));
  EXPECT_THAT(field.heights, ElementsAre(256, 65535, 0, 1));
}

TEST(HeightmapImage, ColouredImageCountsByItsFirstChannelAndOpacityIsIgnored) {
  const fs::path image =
      write_png<std::uint8_t>("rgba.png", 2, 4, {10, 0, 200, 255, 20, 0, 0, 0, 30, 0, 0, 9, 40, 0, 0, 255});
  const HeightField field = load_heightmap(map_of(image, 200));
  EXPECT_THAT(field.heights, ElementsAre(30, 40, 10, 20)) << "expected the scale of the brightest channel";
}

TEST(HeightmapImage, BlackImageIsFlat) {
  EXPECT_THAT(load_heightmap(map_of(write_png<std::uint8_t>("black.png", 2, 1, {0, 0, 0, 0}), 3)).heights,
              ElementsAre(0, 0, 0, 0));
}

TEST(HeightmapImage, JpegIsRead) {
  const fs::path out = file_named("grey.jpg");
  std::FILE* const file = std::fopen(out.c_str(), "wb");
  jpeg_compress_struct jpeg{};
  jpeg_error_mgr errors{};
  jpeg.err = jpeg_std_error(&errors);
  jpeg_create_compress(&jpeg);
  jpeg_stdio_dest(&jpeg, file);
  jpeg.image_width = jpeg.image_height = 8;
  jpeg.input_components = 1;
  jpeg.in_color_space = JCS_GRAYSCALE;
  jpeg_set_defaults(&jpeg);
  jpeg_set_quality(&jpeg, 100, TRUE);
  jpeg_start_compress(&jpeg, TRUE);
  std::vector<JSAMPLE> row(8, 128);
  for (int y = 0; y < 8; ++y) {
    JSAMPROW rows[] = {row.data()};
    jpeg_write_scanlines(&jpeg, rows, 1);
  }
  jpeg_finish_compress(&jpeg);
  jpeg_destroy_compress(&jpeg);
  std::fclose(file);
  const HeightField field = load_heightmap(map_of(out, 5));
  EXPECT_EQ(field.columns, 8);
  EXPECT_NEAR(field.height(0.3, -0.2), 5, 1e-6);
}

TEST(HeightmapImage, FileOfAnotherFormatIsRefusedWithReason) {
  const fs::path text = file_named("text.dem");
  std::ofstream(text) << "elevations in some other format";
  EXPECT_THAT(refusal(text), HasSubstr("neither a PNG nor a JPEG image"));
  EXPECT_THAT(refusal(file_named("missing.png")), HasSubstr("No such file or directory"));
  EXPECT_THAT(refusal(write_png<std::uint8_t>("row.png", 3, 1, {1, 2, 3})), HasSubstr("3 x 1 pixels"));
  const fs::path cut = write_png<std::uint8_t>("cut.png", 2, 1, {1, 2, 3, 4});
  fs::resize_file(cut, fs::file_size(cut) / 2);
  EXPECT_THAT(refusal(cut), HasSubstr("the heightmap cannot be read"));
}

}  // namespace
}  // namespace doppel
