#pragma once
// Gazebo's Label plugin: the class of a model in pictures of labels and boxes. Source: gz-sim 8, systems/label.

#include <cstdint>
#include <optional>

#include "doppel/description/robot_description.h"
#include "doppel/export.h"

namespace doppel {

// The <label> of a plugin of the whole model; nullopt: it has none from 0 to 255.
DOPPEL_API std::optional<std::uint16_t> label_of(const RobotDescription& robot);

}  // namespace doppel
