#pragma once
// From the surfaces that a description gives to links and collisions to the friction of a collision shape.

#include <optional>
#include <string>

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/robot/collision/friction.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel {

// `above`, with the values that `below` has.
ContactSurface overlaid(ContactSurface above, const ContactSurface& below);

// That of the <gazebo> extensions of a URDF.
ContactSurface surface_of(const RobotDescription& robot, const std::string& link);

// The friction of a collision with this surface. An unknown link of fdir1 is a warning at the collision's place.
Friction friction_of(const ContactSurface& surface, const Model& model, const Collision& collision,
                     Diagnostics& diagnostics);

// The restitution of a collision with this surface; nullopt: it has none. One that is not from 0 to 1 is a
// warning and without effect.
std::optional<double> restitution_of(const ContactSurface& surface, const Collision& collision,
                                     Diagnostics& diagnostics);

// <doppel:contact> of a link or of one of its collisions; empty: there is none.
std::string contact_shape_of(const RobotDescription& robot, const Link& link);

}  // namespace doppel
