#include "doppel/sensors/models/image_noise.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace doppel {
namespace {

constexpr std::uint32_t kColour = 0, kDepth = 1, kDropout = 2, kEdge = 3;  // channels
constexpr float kEdgeStep = 0.05F;  // an edge: neighbours differ by this part of the depth

void mix_edges(const CameraDescription& camera, const CounterRandom& random, std::uint64_t sample,
               std::vector<float>& depths) {
  const std::vector<float> clean = depths;
  for (std::size_t i = 0; i + 1 < clean.size(); ++i) {
    if ((i + 1) % static_cast<std::size_t>(camera.width) == 0) continue;
    const float a = clean[i], b = clean[i + 1];
    if (!std::isfinite(a) || !std::isfinite(b) || std::abs(a - b) < kEdgeStep * std::min(a, b)) continue;
    const auto index = static_cast<std::uint32_t>(i);
    if (random.uniform(sample, kEdge, index) < camera.edge_mixing)
      depths[i] = a + (b - a) * static_cast<float>(random.uniform(sample, kEdge + 1, index));
  }
}

}  // namespace

void add_colour_noise(const NoiseDescription& noise, const CounterRandom& random, std::uint64_t sample,
                      std::vector<std::uint8_t>& values, std::vector<float>& scratch) {
  if (!noise.any()) return;
  scratch.resize(values.size());
  random.normals(sample, kColour, scratch);
  const auto mean = static_cast<float>(255 * (noise.mean + noise.bias_mean)),
             stddev = static_cast<float>(255 * noise.stddev);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const float value = static_cast<float>(values[i]) + mean + stddev * scratch[i];
    values[i] = static_cast<std::uint8_t>(std::clamp(value + 0.5F, 0.0F, 255.0F));
  }
}

void add_depth_noise(const CameraDescription& camera, const CounterRandom& random, std::uint64_t sample,
                     std::vector<float>& depths, std::vector<float>& scratch) {
  if (camera.edge_mixing > 0) mix_edges(camera, random, sample, depths);
  if (!camera.depth_noise.isZero()) {
    scratch.resize(depths.size());
    random.normals(sample, kDepth, scratch);
    const Eigen::Vector3f k = camera.depth_noise.cast<float>();
    for (std::size_t i = 0; i < depths.size(); ++i)
      if (std::isfinite(depths[i])) depths[i] += (k[0] + depths[i] * (k[1] + depths[i] * k[2])) * scratch[i];
  }
  if (camera.dropout > 0)
    for (std::size_t i = 0; i < depths.size(); ++i)
      if (random.uniform(sample, kDropout, static_cast<std::uint32_t>(i)) < camera.dropout)
        depths[i] = std::numeric_limits<float>::quiet_NaN();
}

}  // namespace doppel
