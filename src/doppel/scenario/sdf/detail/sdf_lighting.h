#pragma once
// <light> and <scene>.

#include "doppel/description/meshes/lighting.h"
#include "doppel/scenario/sdf/detail/sdf_elements.h"

namespace doppel::sdf {

// X: the pose of the light in the world, where one is written.
Light read_light(const XmlNode& node, const Pose& X, bool posed, Elements& elements);
Environment read_environment(const XmlNode& scene, Elements& elements);

}  // namespace doppel::sdf
