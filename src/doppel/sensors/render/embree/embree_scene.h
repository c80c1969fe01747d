#pragma once
// A RenderScene in Embree: what stands still as one tree of triangles in the world, what moves as a tree for each mesh,
// in its own axes. A new pose rebuilds nothing: a packet's rays are compared with a sphere around each moving item, and
// are cast into the mesh, in its axes, where they may meet.

#include <memory>
#include <span>
#include <vector>

#include "doppel/sensors/render/embree/packet.h"
#include "doppel/sensors/render/ray_caster.h"

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

  // The nearest surface of each lane of `active`: geomID is the item. Ng is in the axes of the world where instID is
  // RTC_INVALID_GEOMETRY_ID, and of the mesh, because the item moves, where it is 0.
  void intersect(Ints active, RayHitPacket& rays) const;
  // tfar becomes -infinity where something is in the way.
  void occlude(Ints active, RayPacket& rays) const;
  [[nodiscard]] bool occluded(RTCRay ray) const;
  // RayCaster::may_be_near().
  [[nodiscard]] bool may_be_near(const Eigen::Vector3d& p_W, double radius, int except_body) const;

 private:
  struct Cone;  // that holds the rays of a packet
  struct Moving {
    std::size_t item;
    RTCScene mesh;             // owned by meshes_
    Eigen::Vector3d centre_M;  // of the sphere
    double radius;             // m
    Eigen::Matrix3f R_WM;
    Eigen::Vector3f p_WM;
  };
  struct Spheres {
    Floats3 centre;  // world
    Floats radius;   // -infinity: none
  };

  void add_still(std::size_t item);
  void add_moving(std::size_t item);
  void place(std::size_t item, const Pose& X_WB);
  static Ints meeting(Ints active, const RayPacket& rays, const Spheres& spheres, std::size_t lane);
  // Calls `cast(lanes, moving)` for each moving item that a ray may meet, in the order of moving_, with these rays.
  template <class Cast>
  void for_each_met(Ints active, const RayPacket& rays, Cast cast) const;
  RTCScene mesh_scene(int mesh);

  std::shared_ptr<const RenderScene> scene_;
  DevicePtr device_;
  std::vector<ScenePtr> meshes_;  // of a mesh that moves somewhere; null: of none
  ScenePtr still_;
  std::vector<Pose> poses_;  // of bodies, as they are now
  std::vector<bool> body_moves_;
  std::vector<Eigen::Matrix3f> rotations_;  // [items]
  std::vector<int> place_of_;               // [items], in moving_; -1: stands still
  std::vector<Moving> moving_;
  std::vector<Spheres> spheres_;  // of moving_, by packets
  bool placed_ = false;
};

}  // namespace doppel::embree
