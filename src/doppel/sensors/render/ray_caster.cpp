#include "doppel/sensors/render/ray_caster.h"

#include "doppel/base/core/plugin_module.h"

namespace doppel {

void RayBatch::resize(std::size_t rays, std::size_t origins) {
  for (std::vector<float>* values : {&origin_x, &origin_y, &origin_z}) values->resize(origins);
  for (std::vector<float>* values : {&direction_x, &direction_y, &direction_z}) values->resize(rays);
}

// All modules compute the same, in registers of different width.
std::unique_ptr<RayCaster> make_ray_caster(std::shared_ptr<const RenderScene> scene) {
  using Make = RayCaster* (*)(std::shared_ptr<const RenderScene>);
  static const auto make =
      reinterpret_cast<Make>(plugin_symbol(widest_module("doppel_embree"), "doppel_make_ray_caster"));
  return std::unique_ptr<RayCaster>(make(std::move(scene)));
}

}  // namespace doppel
