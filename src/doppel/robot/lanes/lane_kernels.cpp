#include "doppel/robot/lanes/lane_kernels.h"

#include "doppel/base/core/plugin_module.h"

namespace doppel {

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
  static const LaneKernels& kernels = lane_kernels(widest_module("doppel_lane_kernels").c_str());
  return kernels;
}

}  // namespace doppel
