#pragma once
// The description as an SDF 1.11 model for Gazebo (gz). Links keep their names and their frames:
// each link is placed at its joint (relative_to), fixed joints are kept and links are not lumped.
// Two differences are required by SDF: a root link "world" is SDF's world, and a fixed link
// without mass and shape (tool0) becomes a <frame>, because a <link> without <inertial> has a mass
// of 1 kg. Source: sdformat.org/spec?ver=1.11.

#include <string>

#include "doppel/base/core/diagnostic.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"
#include "doppel/review/conversion/mesh_files.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel {

// `model` is compiled from `robot` with a fixed base. Warnings: "sdf.no_mass" (a link with a shape and no
// mass: 1 g is written), "sdf.joint_type" (planar and floating joints have no counterpart: the link is free),
// "sdf.renamed" (names are unique in SDF), "sdf.dropped" (a <gazebo> element without a counterpart in SDF).
DOPPEL_API std::string to_sdf(const RobotDescription& robot, const Model& model, MeshFiles& meshes,
                              Diagnostics& diagnostics);

}  // namespace doppel
