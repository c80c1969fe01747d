#include "doppel/export.h"
#include "doppel/sensors/render/embree/embree_caster.h"

// Poses are exchanged with the program, which is compiled with other options.
static_assert(alignof(doppel::Pose) == 16);

extern "C" DOPPEL_API doppel::RayCaster* doppel_make_ray_caster(
    std::shared_ptr<const doppel::RenderScene> scene) {
  return new doppel::embree::EmbreeCaster(std::move(scene));
}
