#pragma once
// The description as MJCF for people who work in MuJoCo: every link a body and every joint a joint by its own
// name, drives as actuators that take positions in rad or m, mimic joints as equalities. It is another
// document than the one doppel simulates by (physics/mujoco/mjcf.h), which names things by index and has the
// world around it; bodies, joints, shapes and couplings of both are written by mjcf/mjcf.h.
// Source: mujoco.readthedocs.io/en/2.2.2/XMLreference.html.

#include <string>

#include "doppel/conversion/mesh_files.h"
#include "doppel/core/diagnostic.h"
#include "doppel/description/robot_description.h"
#include "doppel/export.h"
#include "doppel/kinematics/model.h"

namespace doppel {

// `model` is compiled from `robot`; its root's own name "world" is MuJoCo's world. Meshes that MuJoCo cannot
// read (COLLADA, glTF, text STL) are written as OBJ beside the document. Warnings: "mjcf.shape" (one that is
// left out), "physics.flat_mesh" (a box stands in), "mjcf.renamed".
DOPPEL_API std::string to_mjcf(const RobotDescription& robot, const Model& model, MeshFiles& meshes,
                               Diagnostics& diagnostics);

}  // namespace doppel
