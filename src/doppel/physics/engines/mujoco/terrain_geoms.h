#pragma once
// Private to the MuJoCo back end: contacts of geoms with height fields (physics/contract/detail/terrain_contacts.h). MuJoCo
// 2.2.2's own are of each prism below a triangle with the geom alone: it stops after 50 prisms, so that a box on a fine
// terrain is held at one side only, and their normals can point along the terrain, so that a wheel catches on an edge of a plane.

namespace doppel {

// In all worlds of this process. Idempotent; not thread-safe.
void install_terrain_contacts();

}  // namespace doppel
