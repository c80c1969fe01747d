#pragma once
// The springs of a model's joints, as every engine has them: one for each drive, and one for each limit stop
// that has a stiffness.

#include <vector>

#include "doppel/physics/drive.h"
#include "doppel/physics/joint_spring.h"

namespace doppel {

// Drives of the scalar joints that mimic nothing, in the model's order. Throws InputError
// ("physics.ideal_scheme") where ideal servos meet an integrator of higher order.
std::vector<Drive> make_drives(const ModelInstance& instance, const WorldSettings& settings);

// The spring of a scalar joint, which exerts nothing yet.
JointSpring spring_of_joint(const Model& model, int joint);

// The stops at finite limits of joints with a stop_stiffness: lower then upper, in the model's order.
std::vector<JointSpring> make_stops(const Model& model);

}  // namespace doppel
