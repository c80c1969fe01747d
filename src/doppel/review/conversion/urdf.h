#pragma once
// The description as one plain URDF: expanded, corrected, with mesh paths that are valid at its place.

#include <string>

#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"
#include "doppel/review/conversion/mesh_files.h"

namespace doppel {

DOPPEL_API std::string to_urdf(const RobotDescription& robot, MeshFiles& meshes);

}  // namespace doppel
