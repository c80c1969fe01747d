#include "doppel/sensors/render/embree/textures.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace doppel::embree {
namespace {

std::array<std::uint8_t, kSrgbSteps + 1> make_srgb_table() {
  std::array<std::uint8_t, kSrgbSteps + 1> table{};
  for (int i = 0; i <= kSrgbSteps; ++i) {
    const double linear = std::pow(static_cast<double>(i) / kSrgbSteps, 2);
    const double value = linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
    table[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(std::lround(255 * value));
  }
  return table;
}

int wrapped(int i, int size) {
  const int rest = i % size;
  return rest < 0 ? rest + size : rest;
}

}  // namespace

float linear_of_srgb(float value) {
  return value <= 0.04045F ? value / 12.92F : std::pow((value + 0.055F) / 1.055F, 2.4F);
}

const std::array<float, 256>& linear_of_srgb() {
  static const std::array<float, 256> table = [] {
    std::array<float, 256> out{};
    for (std::size_t i = 0; i < 256; ++i) out[i] = linear_of_srgb(static_cast<float>(i) / 255.0F);
    return out;
  }();
  return table;
}

const std::array<std::uint8_t, kSrgbSteps + 1>& srgb_of_root() {
  static const auto table = make_srgb_table();
  return table;
}

std::uint8_t srgb_of_linear(float value) {
  const float root = std::sqrt(std::clamp(value, 0.0F, 1.0F));
  return srgb_of_root()[static_cast<std::size_t>(root * kSrgbSteps + 0.5F)];
}

TexturePyramid::TexturePyramid(const Bitmap& image) {
  if (image.empty()) return;
  Level level{image.width, image.height, {}};
  level.rgba.reserve(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) * 4);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const std::uint8_t* from = image.at(x, y);
      level.rgba.insert(level.rgba.end(), from, from + 3);
      level.rgba.push_back(image.channels == 4 ? from[3] : 255);
    }
  levels_.push_back(std::move(level));
  while (levels_.back().width > 1 || levels_.back().height > 1) {
    const Level& fine = levels_.back();
    Level coarse{std::max(1, fine.width / 2), std::max(1, fine.height / 2), {}};
    const auto& linear = linear_of_srgb();
    for (int y = 0; y < coarse.height; ++y)
      for (int x = 0; x < coarse.width; ++x) {
        float sum[4] = {0, 0, 0, 0};
        for (const int dy : {0, 1})
          for (const int dx : {0, 1}) {
            const int sx = std::min(2 * x + dx, fine.width - 1), sy = std::min(2 * y + dy, fine.height - 1);
            const std::uint8_t* from =
                &fine.rgba[4 * (static_cast<std::size_t>(sy) * static_cast<std::size_t>(fine.width) +
                                static_cast<std::size_t>(sx))];
            for (int c = 0; c < 3; ++c) sum[c] += linear[from[c]];
            sum[3] += from[3];
          }
        for (int c = 0; c < 3; ++c) coarse.rgba.push_back(srgb_of_linear(sum[c] / 4));
        coarse.rgba.push_back(static_cast<std::uint8_t>(sum[3] / 4));
      }
    levels_.push_back(std::move(coarse));
  }
}

Eigen::Vector4f TexturePyramid::sample(float u, float v, float texels) const {
  if (levels_.empty()) return Eigen::Vector4f::Ones();
  const auto chosen = static_cast<std::size_t>(std::max(0.0F, std::log2(std::max(texels, 1e-6F)) + 0.3F));
  const Level& level = levels_[std::min(chosen, levels_.size() - 1)];
  const float x = (u - std::floor(u)) * static_cast<float>(level.width) - 0.5F;
  const float y = (v - std::floor(v)) * static_cast<float>(level.height) - 0.5F;
  const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
  const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
  Eigen::Vector4f sum = Eigen::Vector4f::Zero();
  const auto& linear = linear_of_srgb();
  for (const int dy : {0, 1})
    for (const int dx : {0, 1}) {
      const auto at =
          static_cast<std::size_t>(wrapped(y0 + dy, level.height)) * static_cast<std::size_t>(level.width) +
          static_cast<std::size_t>(wrapped(x0 + dx, level.width));
      const std::uint8_t* from = &level.rgba[4 * at];
      const float weight = (dx == 1 ? fx : 1 - fx) * (dy == 1 ? fy : 1 - fy);
      sum += weight * Eigen::Vector4f(linear[from[0]], linear[from[1]], linear[from[2]],
                                      static_cast<float>(from[3]) / 255.0F);
    }
  return sum;
}

}  // namespace doppel::embree
