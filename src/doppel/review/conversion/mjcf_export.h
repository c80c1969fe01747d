#pragma once
// The description as MJCF for use in MuJoCo: every link is a body and every joint a joint with its own name,
// drives are position actuators (rad, m), mimic joints are equalities. The engine uses another document
// (physics/engines/mujoco/engine_model.h), which names by index and includes the world; bodies, joints, shapes and couplings
// of both are written by physics/mjcf/mjcf.h. Source: mujoco.readthedocs.io/en/2.2.2/XMLreference.html.

#include <string>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/xml/xml.h"
#include "doppel/description/urdf/robot_description.h"
#include "doppel/export.h"
#include "doppel/review/conversion/mesh_files.h"
#include "doppel/robot/kinematics/model.h"

namespace doppel {

// `model` is compiled from `robot`; a root link "world" becomes MuJoCo's world. Meshes that MuJoCo cannot
// read (COLLADA, glTF, text STL) are written as OBJ next to the document. Warnings: "mjcf.shape" (it is left
// out), "physics.flat_mesh" (replaced by a box), "mjcf.renamed".
DOPPEL_API std::string to_mjcf(const RobotDescription& robot, const Model& model, MeshFiles& meshes,
                               Diagnostics& diagnostics);

// The <default> of such a document for a step, s.
DOPPEL_API XmlNode mjcf_defaults(double step);

}  // namespace doppel
