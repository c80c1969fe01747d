#pragma once
// Ray casting shared by cameras, lidars and range sensors: rays into a RenderScene, by Embree, which is
// loaded with the first caster. Frames: W world; C camera, optical: x to the right, y down, z forward (REP
// 103).

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "doppel/base/math/pose.h"
#include "doppel/export.h"
#include "doppel/sensors/render/render_scene.h"

namespace doppel {

// Rays in arrays of structure, as they are cast. A direction need not be unit: distances are its multiples.
struct DOPPEL_API RayBatch {
  std::vector<float> origin_x, origin_y, origin_z;           // m, world; one for all, or one a ray
  std::vector<float> direction_x, direction_y, direction_z;  // world axes
  float near = 0, far = 0;                                   // multiples of the direction
  std::size_t columns =
      0;  // of a grid in which neighbours in rows and columns are close together; 0: only those in line

  void resize(std::size_t rays, std::size_t origins);
  [[nodiscard]] std::size_t size() const { return direction_x.size(); }
};

struct DOPPEL_API HitBatch {
  std::vector<float> distance;     // multiples of the direction; infinite: nothing
  std::vector<std::int32_t> item;  // into RenderScene::items; -1: nothing
  std::vector<float> cosine;       // between ray and normal, 0..1
  std::vector<float> brightness;   // of the material, 0..1, without its texture
};

// One ray through the centre of each pixel, in C; rows from the top. A pixel that the lens does not reach has the
// direction 0 and sees nothing.
struct DOPPEL_API PixelRays {
  int width = 0, height = 0;
  bool planar = true;     // z is 1: distances are depths along z; else directions are unit, distances ranges
  float pixel_angle = 0;  // rad, of a pixel in the centre; chooses the size of textures
  std::vector<float> x, y, z;  // [width * height]
};

struct CameraView {
  // One table, or one for each sample of a pixel; the first is that of the pixels' centres and gives depth and labels.
  std::span<const PixelRays> samples;
  Pose X_WC = Pose::Identity();
  double near = 0.01, far = 100;  // m: along z if planar, else of the range
  bool colour = true, depth = false, labels = false;
  int own_body = -1;  // which may be nearer than near: the housing of the camera
};

struct CameraPicture {
  std::vector<std::uint8_t> rgb;      // [3 * pixels], sRGB
  std::vector<float> depth;           // m; +infinity: nothing before far; -infinity: nearer than near
  std::vector<std::uint32_t> labels;  // SceneItem::label; 0: nothing
};

// A renderer of pictures of a scene: the caster below; in tests and benchmarks also a plain one in double
// precision and one on OpenGL. What a picture shows does not depend on how it is made:
//  - Depth and label are those of the nearest surface between near and far on the ray of the first table.
//  - Light is linear; each sample is limited to 0..1 before they are averaged. A surface sends back its emissive
//    colour + its colour * ambient * (0.775 + 0.225 n_z) + of each lamp that no surface hides and that both the
//    normal n and the triangle face: lamp * (colour * cos + specular * cos_half^shininess) (Lambert, Blinn-Phong).
//  - Transparent surfaces (opacity below 0.995) add to what is behind them, up to six; they cast whole shadows.
//  - Behind them is Environment::background; with a sky, a gradient from sRGB (0.80, 0.87, 0.94) at the horizon
//    and below to (0.32, 0.52, 0.82) at the zenith, by the sine of the elevation to the power of 0.6.
class DOPPEL_API CameraRenderer {
 public:
  virtual ~CameraRenderer() = default;
  // Poses of all bodies, X_WB. Nothing is seen before the first call.
  virtual void set_poses(std::span<const Pose> bodies) = 0;
  // Not while poses are set. Throws std::runtime_error: this renderer has no such lens.
  virtual void render(const CameraView& view, CameraPicture& out) const = 0;
};

// Its lens may be any table. set_poses() costs nothing for bodies that have not moved since the first call.
// render() allocates only where the picture grows; several threads may be in it and in cast() at once.
class DOPPEL_API RayCaster : public CameraRenderer {
 public:
  // The nearest surface of each ray. A surface is hit from both sides.
  virtual void cast(const RayBatch& rays, HitBatch& out) const = 0;
  // True if no surface is on the segment from a to b (m, world): the line of sight.
  [[nodiscard]] virtual bool sees(const Eigen::Vector3d& a_W, const Eigen::Vector3d& b_W) const = 0;
  // false: no surface, other than those of `except_body`, is within `radius` of p (m, world).
  [[nodiscard]] virtual bool may_be_near(const Eigen::Vector3d& p_W, double radius,
                                         int except_body) const = 0;
  [[nodiscard]] virtual const RenderScene& scene() const = 0;
  // Rays cast so far, of all kinds.
  [[nodiscard]] virtual std::uint64_t rays_cast() const = 0;
};

// Throws std::runtime_error: Embree cannot be loaded.
DOPPEL_API std::unique_ptr<RayCaster> make_ray_caster(std::shared_ptr<const RenderScene> scene);

}  // namespace doppel
