#pragma once
// Masses of links that the description does not have, given instead of estimated.

#include <map>
#include <string>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/math/mass_properties.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel {

using LinkMasses = std::map<std::string, MassProperties>;  // by link, in its frame

// compile_model() (model.h) with these masses instead of written or estimated ones. Throws InputError also
// for a mass of a link that the robot does not have ("model.unknown_link").
DOPPEL_API Model compile_model(const RobotDescription& robot, BaseKind base, const LinkMasses& masses,
                               Diagnostics& diagnostics);

// The masses of a compiled model that its description does not have.
DOPPEL_API LinkMasses masses_not_written(const RobotDescription& robot, const Model& model);

}  // namespace doppel
