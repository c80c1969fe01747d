#pragma once
// FCL's surfaces, behind the functions of a plugin module that is loaded at first use.

#include <memory>

#include "doppel/description/meshes/mesh.h"
#include "doppel/description/urdf/robot_description.h"

namespace doppel {

struct SurfaceFunctions {
  // `mesh`: the triangles of a mesh, ellipsoid, cone or extrusion, else nullptr.
  void* (*make)(const Geometry& geometry, const TriangleMesh* mesh);
  void (*discard)(void* surface);
  // Any thread. Allocates for a mesh that it is given for the first time.
  bool (*touch)(void* a, const Pose& X_WA, void* b, const Pose& X_WB);
};

// Throws std::runtime_error if the module cannot be loaded.
const SurfaceFunctions& surface_functions();

// The module's one entry: const SurfaceFunctions* doppel_surface_functions().
inline constexpr const char* kSurfaceModule = "doppel_fcl";
inline constexpr const char* kSurfaceEntry = "doppel_surface_functions";

}  // namespace doppel
