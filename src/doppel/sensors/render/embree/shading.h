#pragma once
// The colours of a packet's rays: light from everywhere, lamps with shadows, highlights, textures. Linear light
// inside; materials are converted when the scene is made. Source: Blinn and Phong's model of highlights.

#include <vector>

#include "doppel/sensors/render/embree/embree_scene.h"
#include "doppel/sensors/render/embree/textures.h"

namespace doppel::embree {

// The surfaces at the ends of the rays.
struct SurfacePacket {
  Floats3 p, n, ng;          // m, world; unit, towards the ray's origin: of shading and of the triangle
  Floats3 colour, emissive;  // linear
  Floats opacity, specular, shininess;
};

class Shading {
 public:
  explicit Shading(const EmbreeScene& scene);

  // The surfaces of the lanes that hit. pixel_angle: rad.
  void surfaces(Ints hit, const RayHitPacket& rays, float pixel_angle, SurfacePacket& out) const;
  // The light that each of the lanes sends back along its ray; `shadow_rays` grows by those that are cast.
  [[nodiscard]] Floats3 light(Ints hit, const RayHitPacket& rays, const SurfacePacket& surface,
                              std::uint64_t& shadow_rays) const;
  // The light from a direction in which nothing is hit.
  [[nodiscard]] Floats3 backdrop(const Floats3& direction_W) const;
  // World axes, not unit, towards the outside of the triangles that are hit.
  [[nodiscard]] Floats3 triangle_normals(Ints hit, const RayHitPacket& rays) const;
  // Of the materials of the lanes that hit, one at least, without their textures, 0..1.
  [[nodiscard]] Floats brightness(Ints hit, const RayHitPacket& rays) const;

 private:
  struct Material {
    Eigen::Vector4f rgba;  // linear, and opacity
    Eigen::Vector3f emissive;
    float specular, shininess;
    int texture;
  };
  struct Lamp {
    LightKind kind;
    Eigen::Vector3f colour, p,
        towards;  // towards the light, of a directional one; of a spot, its axis reversed
    float range, constant, linear, quadratic, cos_inner, cos_outer, falloff;
    bool shadows;
  };
  struct Mesh {
    std::vector<int> materials;            // [triangles]; empty: one part
    std::vector<float> texture_per_metre;  // [triangles], of its width and height on average; empty: no uvs
  };
  struct Incidence;
  // Neighbouring rays mostly hit the same item, and on large triangles the same of them.
  struct Sameness {
    int lane;  // one that hits
    bool item, triangle, material;
  };
  [[nodiscard]] Sameness sameness(Ints hit, const RayHitPacket& rays) const;
  [[nodiscard]] const Material& material_at(unsigned item, unsigned triangle) const;
  [[nodiscard]] Floats3 in_world(Ints hit, const RayHitPacket& rays, const Sameness& same,
                                 const Floats3& v_M) const;
  [[nodiscard]] Floats3 corner_normals(Ints hit, const RayHitPacket& rays, const Sameness& same) const;
  void materials(Ints hit, const RayHitPacket& rays, const Sameness& same, SurfacePacket& out) const;
  void textures(Ints hit, const RayHitPacket& rays, float pixel_angle, SurfacePacket& out) const;
  [[nodiscard]] static Incidence incidence(const Lamp& lamp, const SurfacePacket& surface);
  [[nodiscard]] Floats3 lamp_light(const Lamp& lamp, Ints hit, const RayHitPacket& rays,
                                   const SurfacePacket& surface, std::uint64_t& shadow_rays) const;

  const EmbreeScene& scene_;
  std::vector<Material> materials_;
  std::vector<Mesh> meshes_;
  std::vector<TexturePyramid> textures_;
  std::vector<Lamp> lamps_;
  Eigen::Vector3f ambient_, background_, zenith_, horizon_;
};

}  // namespace doppel::embree
