#pragma once
// A picture of a world as it is now, without a twin around it.

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/images/image.h"
#include "doppel/description/gazebo/sensor_description.h"
#include "doppel/export.h"
#include "doppel/physics/contract/engine.h"

namespace doppel {

// X_WS: the camera in the world, x forward and z up. RGB. What cannot be shown is a warning.
DOPPEL_API Bitmap take_picture(const Engine& engine, const CameraDescription& camera, const Pose& X_WS,
                               Diagnostics& diagnostics);

// A camera at `from_W` that looks at `at_W`, upright; m, world.
DOPPEL_API Pose looking_at(const Eigen::Vector3d& from_W, const Eigen::Vector3d& at_W);

// The box around everything with a surface but the ground, as the engine has it now; m, world.
DOPPEL_API Eigen::AlignedBox3d bounds_of(const Engine& engine, Diagnostics& diagnostics);

}  // namespace doppel
