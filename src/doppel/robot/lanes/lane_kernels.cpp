#include "doppel/robot/lanes/lane_kernels.h"

#include "doppel/base/core/plugin_module.h"

namespace doppel {
namespace {

const char* module_for_processor() {
#ifdef __x86_64__
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl") &&
      plugin_module_exists("doppel_lane_kernels_avx512"))
    return "doppel_lane_kernels_avx512";
  if (__builtin_cpu_supports("avx2") && plugin_module_exists("doppel_lane_kernels_avx2"))
    return "doppel_lane_kernels_avx2";
#endif
  return "doppel_lane_kernels";
}

}  // namespace

std::size_t clearance_memory(const LaneTree& tree) {
  constexpr std::size_t kMaxLanes = 16;
  const auto joints = static_cast<std::size_t>(tree.joint_count);
  const auto bodies = static_cast<std::size_t>(tree.body_count);
  const auto spheres = static_cast<std::size_t>(tree.sphere_count);
  // A joint has its pose there, a body and a sphere its centre, a body two flags besides.
  return kMaxLanes * (joints * 12 + (bodies + spheres) * 3) * sizeof(float) + bodies * kCoverLevels + 64;
}

const LaneKernels& lane_kernels(const char* module) {
  using Kernels = const LaneKernels* (*)();
  return *reinterpret_cast<Kernels>(plugin_symbol(module, "doppel_lane_kernels"))();
}

const LaneKernels& lane_kernels() {
  static const LaneKernels& kernels = lane_kernels(module_for_processor());
  return kernels;
}

}  // namespace doppel
