#pragma once
// Gazebo's Label plugin: the class of a model in pictures of labels and boxes. Source: gz-sim 8, systems/label.

#include <cstdint>
#include <optional>

#include "doppel/core/diagnostic.h"
#include "doppel/description/robot_description.h"
#include "doppel/export.h"

namespace doppel {

// The <label> of a plugin of the whole model, from 1 to 255; nullopt: it has none, or 0, which is the background. What
// cannot be read is a warning ("sensor.value").
DOPPEL_API std::optional<std::uint16_t> label_of(const RobotDescription& robot, Diagnostics& diagnostics);

}  // namespace doppel
