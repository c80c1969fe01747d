#pragma once
// <population>: copies of a model, distributed over a region.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "doppel/scenario/sdf/detail/sdf_elements.h"

namespace doppel::sdf {

inline constexpr int kMaxPopulation = 10'000;

// The positions of the copies in the population's frame, m: `model_count` random points of its <box> or <cylinder>, about
// evenly distributed ones, or those of a grid or line that is centred there. The same file gives the same points. nullopt:
// an error that is reported. Source: SDFormat 1.11, population; Gazebo classic's Population for the order of the copies.
std::optional<std::vector<Eigen::Vector3d>> population_places(const XmlNode& node, Elements& elements);

}  // namespace doppel::sdf
