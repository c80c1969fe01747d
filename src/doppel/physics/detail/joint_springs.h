#pragma once
// The springs of a model's joints, as every engine has them: one for each drive, and one for each limit stop
// that has a stiffness.

#include <span>
#include <vector>

#include "doppel/physics/detail/drive.h"
#include "doppel/physics/detail/joint_spring.h"

namespace doppel {

// Drives of the scalar joints that mimic nothing, in the model's order. Throws InputError
// ("physics.ideal_scheme") where ideal servos meet an integrator of higher order.
std::vector<Drive> make_drives(const ModelInstance& instance, const WorldSettings& settings);

// The spring of a scalar joint, which exerts nothing yet.
JointSpring spring_of_joint(const Model& model, int joint);

// The stops at finite limits of joints with a stop_stiffness: lower then upper, in the model's order.
std::vector<JointSpring> make_stops(const Model& model);

// Whether the joint is beyond the stop now, which turns it on or off. True: it has just come there, so that
// hit_stop() is to follow.
bool meet_stop(JointSpring& stop, double q);
// The damping that gives back `restitution` to the inertia that the joint moves (its mimics with it, and what
// drives hold stiff), kg m^2 or kg, in steps of `h` seconds.
void hit_stop(JointSpring& stop, double restitution, double inertia, double h);

// After a step in which the unbounded laws asked for `asked`. True: a spring has met or left a bound, and the
// step is to be taken again; `pass` counts how often it was. Where changing all at once leads to no end, as
// with the many stiff drives of a robot that falls on its feet, the first one on the wrong side changes alone
// (K. G. Murty, Note on a Bard-type scheme for solving the complementarity problem, Opsearch 11, 1974).
bool rebound(std::span<JointSpring> springs, std::span<const double> asked, int pass);

}  // namespace doppel
