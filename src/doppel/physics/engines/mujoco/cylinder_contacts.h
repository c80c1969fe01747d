#pragma once
// Private to the MuJoCo back end: contacts of a cylinder that lies on a face of a box. MuJoCo 2.2 searches
// them by moving one of the two a little; the points that it finds move along the cylinder from step to step,
// which takes a hundredth of the acceleration from one that rolls. Here they are the ends of the line of
// contact, as on a plane.

namespace doppel {

// Replaces MuJoCo's function for this pair of shapes, for all models of the process.
void install_cylinder_contacts();

}  // namespace doppel
