#pragma once
// A RenderScene in Embree: what stands still as triangles in the world, what moves as instances of its meshes, so that
// a new pose rebuilds only a tree over the moving items. Both trees are searched one after the other.

#include <embree3/rtcore.h>

#include <memory>
#include <span>
#include <vector>

#include "doppel/rays/ray_caster.h"

namespace doppel::embree {

inline constexpr unsigned kLanes = 8;

struct Release {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};
using DevicePtr = std::unique_ptr<RTCDeviceTy, Release>;
using ScenePtr = std::unique_ptr<RTCSceneTy, Release>;

class EmbreeScene {
 public:
  explicit EmbreeScene(std::shared_ptr<const RenderScene> scene);

  void set_poses(std::span<const Pose> bodies);
  [[nodiscard]] const RenderScene& scene() const { return *scene_; }
  // R_WM and p_WM of an item.
  [[nodiscard]] const Eigen::Matrix3f& rotation(std::size_t item) const { return rotations_[item]; }

  // The nearest surface of the lanes whose `valid` is -1: geomID is the item, also where an instance is hit.
  void intersect(const int* valid, RTCRayHit8& rays, bool coherent) const;
  // tfar becomes -infinity where something is in the way.
  void occlude(const int* valid, RTCRay8& rays, bool coherent) const;

 private:
  void add_still(std::size_t item);
  void add_moving(std::size_t item);
  void place(std::size_t item, const Pose& X_WB);
  RTCScene mesh_scene(int mesh);

  std::shared_ptr<const RenderScene> scene_;
  DevicePtr device_;
  std::vector<ScenePtr> meshes_;  // of a mesh that moves somewhere; null: of none
  ScenePtr still_, moving_;
  std::vector<Pose> poses_;  // of bodies, as they are now
  std::vector<bool> body_moves_;
  std::vector<RTCGeometry> instances_;  // of items that move; owned by moving_
  std::vector<Eigen::Matrix3f> rotations_;
  bool placed_ = false;
  std::size_t moving_items_ = 0;
};

}  // namespace doppel::embree
