#pragma once
// Textures as pyramids of halved pictures, so that what is far away does not flicker. Source: L. Williams, "Pyramidal
// parametrics", 1983.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "doppel/sensors/render/render_scene.h"

namespace doppel::embree {

// sRGB's 8 bits to linear light, 0..1.
const std::array<float, 256>& linear_of_srgb();
float linear_of_srgb(float value);
// Linear light, 0..1, to sRGB's 8 bits: entry round(kSrgbSteps sqrt(value)), because it is finer where it is dark.
inline constexpr int kSrgbSteps = 4096;
const std::array<std::uint8_t, kSrgbSteps + 1>& srgb_of_root();
std::uint8_t srgb_of_linear(float value);

class TexturePyramid {
 public:
  explicit TexturePyramid(const Bitmap& image);
  // Linear light and opacity. u to the right, v downwards, repeated; texels: how many of the picture one pixel covers.
  [[nodiscard]] Eigen::Vector4f sample(float u, float v, float texels) const;
  [[nodiscard]] int width() const { return levels_.empty() ? 0 : levels_.front().width; }
  [[nodiscard]] int height() const { return levels_.empty() ? 0 : levels_.front().height; }

 private:
  struct Level {
    int width, height;
    std::vector<std::uint8_t> rgba;
  };
  std::vector<Level> levels_;
};

}  // namespace doppel::embree
