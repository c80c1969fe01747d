#pragma once
// A RenderScene in Embree: what stands still as triangles in the world, what moves as instances of its meshes, so that
// a new pose rebuilds only a tree over the moving items. Both trees are searched one after the other.

#include <memory>
#include <span>
#include <vector>

#include "doppel/rays/embree/packet.h"
#include "doppel/rays/ray_caster.h"

namespace doppel::embree {

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
  // X_WM of an item, and its R_WM.
  [[nodiscard]] Pose pose(std::size_t item) const {
    const SceneItem& it = scene_->items[item];
    return poses_[static_cast<std::size_t>(it.body)] * it.X_BM;
  }
  [[nodiscard]] const Eigen::Matrix3f& rotation(std::size_t item) const { return rotations_[item]; }

  // The nearest surface of each lane of `active`: geomID is the item, also where an instance is hit.
  void intersect(Ints active, RayHitPacket& rays) const;
  // tfar becomes -infinity where something is in the way.
  void occlude(Ints active, RayPacket& rays) const;
  [[nodiscard]] bool occluded(RTCRay ray) const;
  // RayCaster::may_be_near().
  [[nodiscard]] bool may_be_near(const Eigen::Vector3d& p_W, double radius, int except_body) const;

 private:
  void add_still(std::size_t item);
  void add_moving(std::size_t item);
  void place(std::size_t item, const Pose& X_WB);
  void place_sphere(std::size_t item, const Pose& X_WM);
  // Whether one of the rays may meet an item that moves: by spheres around these, and a cone around the rays.
  [[nodiscard]] bool may_meet_moving(Ints active, const RayPacket& rays) const;
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
  struct Sphere {
    Eigen::Vector3d centre_M = Eigen::Vector3d::Zero();
    double radius = 0;
    std::size_t place = 0;  // in spheres_: packet and lane
  };
  struct Spheres {
    Floats3 centre;  // world
    Floats radius;   // -infinity: none
  };
  std::vector<Sphere> bounds_;    // [items], of those that move
  std::vector<Spheres> spheres_;  // of all moving items, by packets
};

}  // namespace doppel::embree
