#pragma once
// What clients may fetch of what is up: the files that the robot's description names, and the meshes of the
// objects around it.

#include <vector>

#include "doppel/description/robot_description.h"
#include "doppel/physics/world.h"
#include "doppel/server/asset_library.h"

namespace doppel::app {

RobotFiles offered_files(const RobotDescription& robot, const std::vector<WorldObject>& objects);

// Those of `next`, and those of `present` as well: clients ask for what they are told of, and are told of
// what comes while what was there still runs.
RobotFiles both(RobotFiles next, const RobotFiles& present);

}  // namespace doppel::app
