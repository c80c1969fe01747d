#pragma once
// What clients may fetch of what is up: the files that the robots' descriptions name, and the meshes of the
// objects around them.

#include <vector>

#include "doppel/export.h"
#include "doppel/physics/model_instance.h"
#include "doppel/server/asset_library.h"

namespace doppel {

DOPPEL_API RobotFiles served_files(const std::vector<ModelInstance>& instances);

// Those of `next`, and those of `present` as well: clients ask for what they are notified of, and are
// notified of what comes while what was there still runs.
DOPPEL_API RobotFiles both(RobotFiles next, const RobotFiles& present);

}  // namespace doppel
