#pragma once
// The covers of a robot's links as few spheres for other programs: an SRDF has a place for them.

#include <vector>

#include "doppel/export.h"
#include "doppel/robot/clearance/instance_covers.h"

namespace doppel {

inline constexpr double kWrittenStep = 1e-6;  // m: centres and radii are whole numbers of it

struct LinkSpheres {
  int link = 0;                      // index into Model::links
  std::vector<CoverSphere> spheres;  // in the link's frame
  double excess = 0;                 // m: how far they stick out of the shapes (SphereCover::excess)
  // Every shape of the body could be read, and the spheres cover them (covers()).
  bool proven = false;
};

// The spheres of level 1 of each link with shapes, in ascending order. `covers` are those of the instance,
// with the same detail. Throws InputError: a mesh cannot be read.
[[nodiscard]] DOPPEL_API std::vector<LinkSpheres> link_spheres(
    const SceneInstance& instance, const InstanceCovers& covers,
    CollisionDetail detail = CollisionDetail::triangles);

}  // namespace doppel
