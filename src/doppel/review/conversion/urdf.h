#pragma once
// The description as one plain URDF: expanded, corrected, with mesh paths that are valid at its place.

#include <string>

#include "doppel/conversion/mesh_files.h"
#include "doppel/description/robot_description.h"
#include "doppel/export.h"

namespace doppel {

DOPPEL_API std::string to_urdf(const RobotDescription& robot, MeshFiles& meshes);

}  // namespace doppel
