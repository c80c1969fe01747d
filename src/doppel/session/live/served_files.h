#pragma once
// The files that clients may fetch: those that the robots' descriptions refer to, and the meshes of objects.

#include <vector>

#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"
#include "doppel/physics/contract/model_instance.h"
#include "doppel/ros/server/asset_library.h"

namespace doppel {

// The files that a description refers to.
DOPPEL_API RobotFiles files_of(const RobotDescription& robot);

// Those of all instances of a world.
DOPPEL_API RobotFiles served_files(const std::vector<ModelInstance>& instances);

// The files of `next` and of `present`: clients are notified of a replacement, and fetch its files, while the
// former machine is still running.
DOPPEL_API RobotFiles both(RobotFiles next, const RobotFiles& present);

}  // namespace doppel
