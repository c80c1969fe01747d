#pragma once
// The files that clients may fetch: those that the robots' descriptions refer to, and the meshes of objects.

#include <vector>

#include "doppel/export.h"
#include "doppel/physics/model_instance.h"
#include "doppel/server/asset_library.h"

namespace doppel {

DOPPEL_API RobotFiles served_files(const std::vector<ModelInstance>& instances);

// The files of `next` and of `present`: clients are notified of a replacement, and fetch its files, while the
// former machine is still running.
DOPPEL_API RobotFiles both(RobotFiles next, const RobotFiles& present);

}  // namespace doppel
