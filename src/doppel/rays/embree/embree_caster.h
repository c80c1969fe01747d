#pragma once
// RayCaster by Embree, in packets of eight rays.

#include <atomic>

#include "doppel/rays/embree/embree_scene.h"
#include "doppel/rays/embree/shading.h"
#include "doppel/rays/ray_caster.h"

namespace doppel::embree {

class EmbreeCaster : public RayCaster {
 public:
  explicit EmbreeCaster(std::shared_ptr<const RenderScene> scene)
      : scene_(std::move(scene)), shading_(scene_) {
    for (const SceneItem& item : scene_.scene().items) bodies_of_items_.push_back(item.body);
  }

  void set_poses(std::span<const Pose> bodies) override { scene_.set_poses(bodies); }
  void render(const CameraView& view, CameraPicture& out) const override;
  void cast(const RayBatch& rays, HitBatch& out) const override;
  [[nodiscard]] bool sees(const Eigen::Vector3d& a_W, const Eigen::Vector3d& b_W) const override;
  [[nodiscard]] std::span<const int> bodies_of_items() const override { return bodies_of_items_; }
  [[nodiscard]] std::uint64_t rays_cast() const override { return rays_; }

 private:
  struct Target;
  // Eight pixels from column x of row y: their colours, and with `first` depths and labels.
  std::uint64_t render_packet(const Target& to, const PixelRays& pixels, bool first, int x, int y) const;
  // Marks depths of pixels before which something is nearer than `near`.
  std::uint64_t mark_near(const Target& to, const PixelRays& pixels, int x, int y) const;
  std::uint64_t add_colours(const Target& to, int* valid, RTCRayHit8& rays, float pixel_angle,
                            std::size_t at) const;

  EmbreeScene scene_;
  Shading shading_;
  std::vector<int> bodies_of_items_;
  mutable std::atomic<std::uint64_t> rays_{0};
};

}  // namespace doppel::embree
