#pragma once
// Estimated masses of movable bodies without mass: each from its shapes or its length, and together no more
// than the drives can hold.

#include <vector>

#include "doppel/base/core/diagnostic.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel {

// A body is a set of links that fixed joints join; the mass is assigned to its topmost link. In this order:
//
// - shapes: the solids of its collision shapes, else of its visual ones, at 1000 kg/m^3 (printed plastic with
//   its screws and servos); a mesh that is not closed has three tenths of the volume of its bounding box;
// - length: without a readable shape, a bar from its joint to the farthest joint that it carries, three
//   tenths as thick as long. The bar of a body that carries no joint, or whose joints coincide, has half the
//   distance to its own joint, and no bar is shorter than a tenth of the longest.
//
// If no body of the robot has a written mass, all are scaled down together until gravity loads each drive
// with at most half of its effort (the scale is at least a ten-thousandth). One warning "model.no_inertial"
// lists them all.
//
// `sources`: the description's link of each of model.links; nullptr: none. Does not set model.total_mass.
void assume_masses(Model& model, const std::vector<const Link*>& sources, Diagnostics& diagnostics);

}  // namespace doppel
