#pragma once
// What bodies that move and weigh nothing are taken to weigh. A guess, but one with proportions: each from
// what it looks like, or from how long it is, and together no more than the drives can hold.

#include <vector>

#include "doppel/core/diagnostic.h"
#include "doppel/kinematics/model.h"

namespace doppel {

// A body is what fixed joints join; only its topmost link is weighed. In this order:
//   shapes   the solids of its collision shapes, else of its visual ones, at 1000 kg/m^3 (printed plastic
//   with its
//            screws and servos); a mesh that is not closed counts as three tenths of its box;
//   length   without any shape that can be read, a bar from its joint to the farthest joint that it carries,
//   three
//            tenths as thick as long. A body that carries none, or whose joints meet in a point, is half as
//            long as the way to its own joint, and no bar is shorter than a tenth of the longest.
// Where no body of the robot has a mass of its own, all are scaled down together until each drive holds twice
// what gravity asks of it (at most to a ten-thousandth). One warning "model.no_inertial" names them all.
// `sources`: the description's link of each of model.links; null: none. Leaves model.total_mass alone.
void assume_masses(Model& model, const std::vector<const Link*>& sources, Diagnostics& diagnostics);

}  // namespace doppel
