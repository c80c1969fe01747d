#pragma once
// Surfaces that FCL holds, behind functions of a module that is loaded late.

#include <memory>

#include "doppel/description/mesh.h"
#include "doppel/description/robot_description.h"

namespace doppel {

struct SurfaceFunctions {
  // `mesh` is the geometry's, where it is one.
  void* (*make)(const Geometry& geometry, const TriangleMesh* mesh);
  void (*discard)(void* surface);
  bool (*touch)(const void* a, const Pose& X_WA, const void* b, const Pose& X_WB);
};

// The module's one entry: const SurfaceFunctions* doppel_surface_functions().
inline constexpr const char* kSurfaceModule = "doppel_fcl";
inline constexpr const char* kSurfaceEntry = "doppel_surface_functions";

}  // namespace doppel
