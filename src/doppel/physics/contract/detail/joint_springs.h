#pragma once
// The springs of a model's joints, the same in every engine: one for each drive, and one for each limit stop
// with a stiffness.

#include <span>
#include <vector>

#include "doppel/physics/contract/detail/drive.h"
#include "doppel/physics/contract/detail/joint_spring.h"

namespace doppel {

// Drives of the scalar joints that mimic nothing, in the model's order. Throws InputError
// ("physics.ideal_scheme") where ideal servos meet an integrator of higher order.
std::vector<Drive> make_drives(const ModelInstance& instance, const WorldSettings& settings);

// A spring on a scalar joint that is still off.
JointSpring spring_of_joint(const Model& model, int joint);

// The stops at finite limits of joints with a stop_stiffness: lower then upper, in the model's order.
std::vector<JointSpring> make_stops(const Model& model);

// Switches the stop on while the joint is beyond it, else off. True: the joint has just reached it, and
// hit_stop() has to follow.
bool meet_stop(JointSpring& stop, double q);
// Sets the damping that gives `restitution` to an impact with the inertia that the joint moves, kg m^2 or kg
// (including its mimics and the joints that drives hold), in steps of `h` seconds.
void hit_stop(JointSpring& stop, double restitution, double inertia, double h);

// After a step in which the unbounded laws gave the efforts `asked`. True: a spring has met or left a bound,
// and the step has to be repeated; `pass` counts the repetitions. Changing all springs at once may not
// terminate, for example with the many stiff drives of a robot that falls on its feet; then only the first
// one on the wrong side changes (K. G. Murty, Note on a Bard-type scheme for solving the complementarity
// problem, Opsearch 11, 1974).
bool rebound(std::span<JointSpring> springs, std::span<const double> asked, int pass);

}  // namespace doppel
