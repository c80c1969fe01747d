#pragma once
// RayCaster by Embree, in packets of neighbouring rays.

#include <atomic>

#include "doppel/sensors/render/embree/embree_scene.h"
#include "doppel/sensors/render/embree/shading.h"
#include "doppel/sensors/render/ray_caster.h"

namespace doppel::embree {

// Places of a packet's lanes in a grid.
struct Tile {
  std::uint32_t at
      [kLanes];  // index of the row's first place + column; of lanes outside of the grid, that of a lane inside
  Ints inside;
  bool whole;  // no lane is outside
  bool line;   // all lanes in a row; else kTileWidth of them, or a multiple
};

class EmbreeCaster : public RayCaster {
 public:
  explicit EmbreeCaster(std::shared_ptr<const RenderScene> scene)
      : scene_(std::move(scene)), shading_(scene_) {}

  void set_poses(std::span<const Pose> bodies) override { scene_.set_poses(bodies); }
  void render(const CameraView& view, CameraPicture& out) const override;
  void cast(const RayBatch& rays, HitBatch& out) const override;
  [[nodiscard]] bool sees(const Eigen::Vector3d& a_W, const Eigen::Vector3d& b_W) const override;
  [[nodiscard]] bool may_be_near(const Eigen::Vector3d& p_W, double radius, int except_body) const override {
    return scene_.may_be_near(p_W, radius, except_body);
  }
  [[nodiscard]] const RenderScene& scene() const override { return scene_.scene(); }
  [[nodiscard]] std::uint64_t rays_cast() const override { return rays_; }

 private:
  struct Target;
  // The pixels of a tile: their colours, and for the first sample depths and labels. Returns the rays that were cast.
  std::uint64_t render_tile(const Target& to, const PixelRays& pixels, const Tile& tile) const;
  // SceneItem::label of the lanes that hit.
  [[nodiscard]] Ints labels(Ints hit, const RayHitPacket& rays) const;
  // Marks depths of pixels before which something is nearer than `near`.
  std::uint64_t mark_near(const Target& to, const PixelRays& pixels, const Tile& tile) const;
  std::uint64_t add_colours(const Target& to, const Tile& tile, RayHitPacket& rays, float pixel_angle) const;
  // Into the picture, or into its sums.
  static void put_colours(const Target& to, const Tile& tile, const Floats3& colours);
  void put_hits(const Tile& tile, const RayHitPacket& rays, HitBatch& out) const;

  EmbreeScene scene_;
  Shading shading_;
  mutable std::atomic<std::uint64_t> rays_{0};
};

}  // namespace doppel::embree
