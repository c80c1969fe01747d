#pragma once
// CameraRenderer in double precision and without packets, for comparison: it shares no code with the caster.

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "doppel/sensors/render/ray_caster.h"

namespace doppel {

class ReferenceRenderer : public CameraRenderer {
 public:
  explicit ReferenceRenderer(std::shared_ptr<const RenderScene> scene) : scene_(std::move(scene)) {}

  void set_poses(std::span<const Pose> bodies) override;
  void render(const CameraView& view, CameraPicture& out) const override;

 private:
  using Vector3 = Eigen::Vector3d;
  struct Triangle {
    Vector3 a, ab, ac;  // m, world
    std::uint32_t item, index;
  };
  // A binary tree of boxes, halved at the median of the longest axis.
  struct Node {
    Eigen::AlignedBox3d box;
    std::uint32_t begin, end;  // triangles; of an inner node, those of both children
    int left = -1, right = -1;
  };
  struct Ray {
    Vector3 from, along;
  };
  struct Hit {
    double distance, u, v;  // multiple of the ray's direction; weights of the second and the third corner
    const Triangle* triangle;
  };
  // What is seen at the end of a ray; linear light.
  struct Surface {
    Vector3 p, n, ng;  // m, world; unit, towards the ray's origin: of shading and of the triangle
    Vector3 colour, emissive;
    double opacity, specular, shininess;
  };

  int build(std::uint32_t begin, std::uint32_t end);
  [[nodiscard]] std::optional<Hit> nearest(const Ray& ray, double near, double far) const;
  [[nodiscard]] Vector3 colour(const Ray& ray, const CameraView& view, double pixel_angle) const;
  [[nodiscard]] Surface surface(const Ray& ray, const Hit& hit, double pixel_angle) const;
  [[nodiscard]] Vector3 light(const Ray& ray, const Surface& surface) const;
  [[nodiscard]] Vector3 lamp_light(const Light& lamp, const Ray& ray, const Surface& surface) const;
  [[nodiscard]] Vector3 backdrop(const Vector3& along) const;
  void paint(const Ray& ray, const Hit& hit, const SurfaceMaterial& material, double pixel_angle,
             Surface& out) const;

  std::shared_ptr<const RenderScene> scene_;
  std::vector<Pose> poses_;
  std::vector<Triangle> triangles_;
  std::vector<Node> nodes_;  // the first is the root
};

}  // namespace doppel
