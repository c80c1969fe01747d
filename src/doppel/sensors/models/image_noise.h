#pragma once
// Noise of pictures and depths: a function of the sample's number, pixel by pixel.

#include <cstdint>
#include <vector>

#include "doppel/description/gazebo/sensor_description.h"
#include "doppel/export.h"
#include "doppel/sensors/models/counter_random.h"

namespace doppel {

// Adds noise in parts of full scale to 8-bit values, each by itself. Allocates only where `scratch` grows.
DOPPEL_API void add_colour_noise(const NoiseDescription& noise, const CounterRandom& random,
                                 std::uint64_t sample, std::vector<std::uint8_t>& values,
                                 std::vector<float>& scratch);

// Depths in m: noise that grows with the distance, missing values (NaN), and mixing at edges, where a depth is
// somewhere between those on both sides. Infinite depths stay.
DOPPEL_API void add_depth_noise(const CameraDescription& camera, const CounterRandom& random,
                                std::uint64_t sample, std::vector<float>& depths,
                                std::vector<float>& scratch);

}  // namespace doppel
