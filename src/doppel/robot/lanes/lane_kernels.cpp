#include "doppel/robot/lanes/lane_kernels.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <map>

#include "doppel/base/core/plugin_module.h"

namespace doppel {

std::size_t clearance_memory(const LaneTree& tree) {
  constexpr std::size_t kMaxLanes = 16;
  const auto joints = static_cast<std::size_t>(tree.joint_count);
  const auto bodies = static_cast<std::size_t>(tree.body_count);
  const auto spheres = static_cast<std::size_t>(tree.sphere_count);
  const auto groups = static_cast<std::size_t>(tree.group_count);
  // A joint has its pose there, a group, body and sphere its centre, a body three flags besides.
  const std::size_t numbers = kMaxLanes * (joints * 12 + (groups + bodies + spheres) * 3);
  return numbers * sizeof(float) + bodies * (kCoverLevels + 1) + 64;
}

namespace {

// Bodies of one joint have its index; those that stand still are numbered downwards from -1.
int group_key(std::span<const LaneBody> bodies, int body) {
  const int joint = bodies[static_cast<std::size_t>(body)].joint;
  return joint >= 0 ? joint : -1 - body;
}

// A sphere around the bounds of a group's bodies, about the middle of their boxes.
LaneSphere sphere_around(const std::vector<LaneSphere>& bounds) {
  constexpr double kRoundingUp = 1 + 1e-6;
  Eigen::AlignedBox3d box;
  for (const LaneSphere& s : bounds) {
    if (s.radius < 0) return {0, 0, 0, -1};
    const Eigen::Vector3d centre(s.x, s.y, s.z);
    box.extend(Eigen::Vector3d(centre.array() - s.radius));
    box.extend(Eigen::Vector3d(centre.array() + s.radius));
  }
  const Eigen::Vector3f middle = box.center().cast<float>();
  double radius = 0;
  for (const LaneSphere& s : bounds) {
    const Eigen::Vector3d away(double{s.x} - middle.x(), double{s.y} - middle.y(), double{s.z} - middle.z());
    radius = std::max(radius, away.norm() + s.radius);
  }
  return {middle.x(), middle.y(), middle.z(), static_cast<float>(radius * kRoundingUp)};
}

}  // namespace

std::pair<int, int> run_order(std::span<const LaneBody> bodies, const LanePair& pair) {
  return {group_key(bodies, pair.a), group_key(bodies, pair.b)};
}

LaneRuns lane_runs(std::span<const LaneBody> bodies, std::span<const LanePair> pairs) {
  LaneRuns out;
  std::map<int, int> group_of;
  std::vector<std::vector<LaneSphere>> bounds;
  for (int body = 0; body < static_cast<int>(bodies.size()); ++body) {
    const auto [found, is_new] =
        group_of.try_emplace(group_key(bodies, body), static_cast<int>(bounds.size()));
    if (is_new) {
      bounds.emplace_back();
      out.groups.push_back({bodies[static_cast<std::size_t>(body)].joint, {}});
    }
    bounds[static_cast<std::size_t>(found->second)].push_back(bodies[static_cast<std::size_t>(body)].bound);
  }
  for (std::size_t i = 0; i < bounds.size(); ++i) out.groups[i].bound = sphere_around(bounds[i]);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto [key_a, key_b] = run_order(bodies, pairs[i]);
    const int a = group_of.at(key_a), b = group_of.at(key_b);
    if (out.runs.empty() || out.runs.back().a != a || out.runs.back().b != b)
      out.runs.push_back({a, b, static_cast<int>(i), 0});
    ++out.runs.back().count;
  }
  return out;
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
