#pragma once
// The appearance of a mesh file in a scene.

#include "doppel/description/meshes/imported_mesh.h"
#include "doppel/sensors/render/scene_builder.h"

namespace doppel {

// At its scale, the part that it names. Throws InputError "mesh.empty" without triangles, "mesh.unreadable" where a corner
// is not finite.
MeshAppearance appearance_of(const ImportedMesh& file, const MeshGeometry& mesh);

}  // namespace doppel
