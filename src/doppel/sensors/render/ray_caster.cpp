#include "doppel/sensors/render/ray_caster.h"

#include "doppel/base/core/plugin_module.h"

namespace doppel {

void RayBatch::resize(std::size_t rays, std::size_t origins) {
  for (std::vector<float>* values : {&origin_x, &origin_y, &origin_z}) values->resize(origins);
  for (std::vector<float>* values : {&direction_x, &direction_y, &direction_z}) values->resize(rays);
}

namespace {

// All compute the same, in registers of different width. A checkout that was just built has only the plain
// one.
const char* module_for_processor() {
#ifdef __x86_64__
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl") &&
      plugin_module_exists("doppel_embree_avx512"))
    return "doppel_embree_avx512";
  if (__builtin_cpu_supports("avx2") && plugin_module_exists("doppel_embree_avx2"))
    return "doppel_embree_avx2";
#endif
  return "doppel_embree";
}

}  // namespace

std::unique_ptr<RayCaster> make_ray_caster(std::shared_ptr<const RenderScene> scene) {
  using Make = RayCaster* (*)(std::shared_ptr<const RenderScene>);
  static const auto make =
      reinterpret_cast<Make>(plugin_symbol(module_for_processor(), "doppel_make_ray_caster"));
  return std::unique_ptr<RayCaster>(make(std::move(scene)));
}

}  // namespace doppel
