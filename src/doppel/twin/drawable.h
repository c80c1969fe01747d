#pragma once
// A picture can do without what physics needs: weights, axes, order in the limits, joints that couple others.

#include "doppel/core/diagnostic.h"
#include "doppel/description/robot_description.h"

namespace doppel {

// Makes compile_model take whatever can be drawn of a description as read_description made it. Errors in
// `found` that a picture can do without become warnings in `told`, which say what it shows instead; the rest
// of `found` goes there as it is. Throws InputError with the errors of `found` that leave nothing to draw (no
// tree, numbers that are none, no names).
void make_drawable(RobotDescription& robot, const Diagnostics& found, Diagnostics& told);

}  // namespace doppel
