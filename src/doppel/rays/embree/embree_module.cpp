#include "doppel/export.h"
#include "doppel/rays/embree/embree_caster.h"

extern "C" DOPPEL_API doppel::RayCaster* doppel_make_ray_caster(
    std::shared_ptr<const doppel::RenderScene> scene) {
  return new doppel::embree::EmbreeCaster(std::move(scene));
}
