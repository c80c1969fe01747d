#pragma once
// An SDF world as one document for other tools: SDF without includes, a world file in YAML, MJCF. All poses are relative
// to the world, meshes are referred to from the document's folder (MeshFiles).

#include <string>

#include "doppel/base/core/diagnostic.h"
#include "doppel/export.h"
#include "doppel/review/conversion/mesh_files.h"
#include "doppel/scenario/sdf/sdf_world.h"

namespace doppel {

// The ground, which the reader takes out of its model, is a model of its own. Lights, plugins, and the sensors of links
// are kept. Warnings: "world.lost" for sensors of links that become frames, and those of to_sdf().
DOPPEL_API std::string to_world_sdf(const SdfWorld& world, MeshFiles& meshes, Diagnostics& diagnostics);

// docs/worlds.md describes the file. An object has one shape and one coefficient of friction: of a static model each
// collision is an object, "model/collision". Warnings "world.lost" at the place of what the file cannot express: models
// with joints, moving models with several shapes, other shapes; inertias and centres of mass that are not those of the
// shape; directed friction; lights, sensors and plugins.
DOPPEL_API std::string to_world_yaml(const SdfWorld& world, MeshFiles& meshes, Diagnostics& diagnostics);

// Names are "model/name"; joints have no actuators. MuJoCo takes the larger friction of a pair and SDF the smaller, which
// is noted where coefficients differ ("world.friction_rule"). Warnings: "world.lost" for sensors, plugins and
// restitution, and those of to_mjcf().
DOPPEL_API std::string to_world_mjcf(const SdfWorld& world, MeshFiles& meshes, Diagnostics& diagnostics);

}  // namespace doppel
