#include "doppel/sensors/rigs/detail/pixel_formats.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

namespace doppel {
namespace {

std::uint8_t grey_of(const std::uint8_t* rgb) {
  return static_cast<std::uint8_t>((299 * rgb[0] + 587 * rgb[1] + 114 * rgb[2] + 500) / 1000);
}

// The channel of a Bayer pattern's four pixels, by rows: 0 red, 1 green, 2 blue.
struct Bayer {
  const char *sdf, *ros;
  std::array<int, 4> channels;
};
constexpr std::array<Bayer, 4> kBayer{{{"BAYER_RGGB8", "bayer_rggb8", {0, 1, 1, 2}},
                                       {"BAYER_BGGR8", "bayer_bggr8", {2, 1, 1, 0}},
                                       {"BAYER_GBRG8", "bayer_gbrg8", {1, 2, 0, 1}},
                                       {"BAYER_GRBG8", "bayer_grbg8", {1, 0, 2, 1}}}};

void set_layout(const char* encoding, std::uint32_t bytes, sensor_msgs::msg::Image& image) {
  image.encoding = encoding;
  image.step = image.width * bytes;
  image.data.resize(std::size_t{image.step} * image.height);
}

}  // namespace

void expose(double factor, std::vector<std::uint8_t>& rgb) {
  if (factor == 1) return;
  std::array<std::uint8_t, 256> table{};
  for (std::size_t i = 0; i < 256; ++i) {
    const double s = static_cast<double>(i) / 255;
    const double linear =
        std::clamp(factor * (s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4)), 0.0, 1.0);
    const double out = linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
    table[i] = static_cast<std::uint8_t>(std::lround(255 * out));
  }
  for (std::uint8_t& value : rgb) value = table[value];
}

void encode_pixels(const std::string& format, int width, const std::vector<std::uint8_t>& rgb,
                   sensor_msgs::msg::Image& image) {
  const std::size_t pixels = rgb.size() / 3;
  if (format == "L8" || format == "L_INT8") {
    set_layout("mono8", 1, image);
    for (std::size_t i = 0; i < pixels; ++i) image.data[i] = grey_of(&rgb[3 * i]);
    return;
  }
  if (format == "L16" || format == "L_INT16" || format == "L_UINT16") {
    set_layout("mono16", 2, image);
    for (std::size_t i = 0; i < pixels; ++i) {
      const auto value = static_cast<std::uint16_t>(grey_of(&rgb[3 * i]) * 257);
      std::memcpy(&image.data[2 * i], &value, 2);
    }
    return;
  }
  for (const Bayer& bayer : kBayer) {
    if (format != bayer.sdf) continue;
    set_layout(bayer.ros, 1, image);
    for (std::size_t i = 0; i < pixels; ++i) {
      const std::size_t u = i % static_cast<std::size_t>(width), v = i / static_cast<std::size_t>(width);
      image.data[i] = rgb[3 * i + static_cast<std::size_t>(bayer.channels[2 * (v % 2) + u % 2])];
    }
    return;
  }
  const bool reversed = format == "B8G8R8" || format == "BGR_INT8";
  set_layout(reversed ? "bgr8" : "rgb8", 3, image);
  image.data = rgb;
  if (reversed)
    for (std::size_t i = 0; i < pixels; ++i) std::swap(image.data[3 * i], image.data[3 * i + 2]);
}

void encode_depths(const std::string& format, const std::vector<float>& depths,
                   sensor_msgs::msg::Image& image) {
  if (format == "L16" || format == "R_UINT16" || format == "L_UINT16") {
    set_layout("16UC1", 2, image);
    for (std::size_t i = 0; i < depths.size(); ++i) {
      const float mm = 1000 * depths[i];
      const std::uint16_t value = mm > 0 && mm < 65535.5F ? static_cast<std::uint16_t>(mm + 0.5F) : 0;
      std::memcpy(&image.data[2 * i], &value, 2);
    }
    return;
  }
  set_layout("32FC1", 4, image);
  std::memcpy(image.data.data(), depths.data(), image.data.size());
}

void encode_labels(const std::vector<std::uint32_t>& labels, sensor_msgs::msg::Image& image) {
  set_layout("mono16", 2, image);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const auto value = static_cast<std::uint16_t>(labels[i]);
    std::memcpy(&image.data[2 * i], &value, 2);
  }
}

void encode_panoptic(const std::vector<std::uint32_t>& labels, sensor_msgs::msg::Image& image) {
  set_layout("rgb8", 3, image);
  for (std::size_t i = 0; i < labels.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c)
      image.data[3 * i + c] = static_cast<std::uint8_t>(labels[i] >> (8 * c));
}

void colour_labels(const std::vector<std::uint32_t>& labels, sensor_msgs::msg::Image& image) {
  set_layout("rgb8", 3, image);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const std::uint32_t hash = labels[i] * 2654435761U;
    for (std::size_t c = 0; c < 3; ++c)
      image.data[3 * i + c] =
          labels[i] == 0 ? 0 : static_cast<std::uint8_t>(55 + (hash >> (8 * c + 4)) % 200);
  }
}

}  // namespace doppel
