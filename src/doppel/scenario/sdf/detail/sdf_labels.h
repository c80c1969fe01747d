#pragma once
// Gazebo's Label plugins of a link and of its visuals.

#include <optional>
#include <string>

#include "doppel/description/urdf/robot_description.h"
#include "doppel/scenario/sdf/detail/sdf_elements.h"

namespace doppel::sdf {

// In the form that a URDF has for them: <gazebo reference> with the plugins of the link, and for those of a visual a
// <visual> with its name. nullopt: there are none. Other plugins are reported as without effect.
std::optional<GazeboExtension> labels_of(const XmlNode& link, const std::string& name, Elements& elements);

}  // namespace doppel::sdf
