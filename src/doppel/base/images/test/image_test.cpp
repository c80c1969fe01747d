#include "doppel/base/images/image.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include "doppel/base/core/diagnostic.h"

namespace doppel {
namespace {

Bitmap gradient(int width, int height, int channels) {
  Bitmap image{width, height, channels, {}};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < channels; ++c)
        image.pixels.push_back(static_cast<std::uint8_t>((3 * x + 5 * y + 40 * c) & 255));
  return image;
}

TEST(ImageFiles, PngKeepsEveryBitWithOneToFourChannels) {
  for (int channels = 1; channels <= 4; ++channels)
    for (const PngSpeed speed : {PngSpeed::small, PngSpeed::fast}) {
      const Bitmap image = gradient(33, 17, channels);
      const Bitmap again = decode_image(encode_png(image, speed), "a.png");
      EXPECT_EQ(again.width, 33);
      EXPECT_EQ(again.height, 17);
      EXPECT_EQ(again.channels, channels);
      EXPECT_EQ(again.pixels, image.pixels) << channels;
    }
}

TEST(ImageFiles, JpegIsCloseToItsOriginal) {
  for (const int channels : {1, 3}) {
    Bitmap image{64, 48, channels, std::vector<std::uint8_t>(std::size_t(64 * 48 * channels), 90)};
    const Bitmap again = decode_image(encode_jpeg(image, 90), "a.jpg");
    ASSERT_EQ(again.pixels.size(), image.pixels.size());
    for (const std::uint8_t value : again.pixels) EXPECT_LE(std::abs(value - 90), 2);
  }
}

TEST(ImageFiles, DamagedFileIsRefusedByNameAndReason) {
  const std::string whole = encode_png(gradient(40, 40, 3));
  for (const std::string& bytes : {std::string("BM not a png"), std::string(), whole.substr(0, 60)}) {
    try {
      (void)decode_image(bytes, "textures/wood.png");
      ADD_FAILURE() << bytes.size();
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr("textures/wood.png"));
      EXPECT_THAT(error.what(), testing::HasSubstr("image.unreadable"));
    }
  }
}

TEST(ImageFiles, RandomDamageIsReadOrRefused) {
  const unsigned seed = 20261124;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  for (const std::string& whole : {encode_png(gradient(20, 20, 4)), encode_jpeg(gradient(20, 20, 3), 80)})
    for (int round = 0; round < 300; ++round) {
      std::string bytes = whole;
      for (int i = 0; i < 3; ++i) bytes[random() % bytes.size()] = static_cast<char>(random());
      try {
        const Bitmap image = decode_image(bytes, "damaged");
        EXPECT_EQ(image.pixels.size(),
                  std::size_t(image.width) * std::size_t(image.height) * std::size_t(image.channels));
      } catch (const InputError&) {
      }
    }
}

}  // namespace
}  // namespace doppel
