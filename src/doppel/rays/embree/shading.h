#pragma once
// The colours of eight rays at a time: light from everywhere, lamps with shadows, highlights, textures. Linear light
// inside; materials are converted when the scene is made. Source: Blinn and Phong's model of highlights.

#include <vector>

#include "doppel/rays/embree/embree_scene.h"
#include "doppel/rays/embree/textures.h"

namespace doppel::embree {

// Eight values of each kind, one for each ray of a packet.
struct alignas(32) Lanes {
  float v[kLanes];
};
struct Lanes3 {
  Lanes x, y, z;
};

// What is seen at the ends of eight rays.
struct SurfacePacket {
  Lanes3 p, n, ng;          // m, world; unit, towards the ray's origin: of shading and of the triangle
  Lanes3 colour, emissive;  // linear
  Lanes opacity, specular, shininess;
};

class Shading {
 public:
  explicit Shading(const EmbreeScene& scene);

  // The surfaces of the lanes that hit. pixel_angle: rad.
  void surfaces(const int* hit, const RTCRayHit8& rays, float pixel_angle, SurfacePacket& out) const;
  // Adds the light that each of the lanes sends back along its ray; returns the number of shadow rays.
  unsigned light(const int* hit, const RTCRayHit8& rays, const SurfacePacket& surface, Lanes3& out) const;
  // Where nothing is hit.
  [[nodiscard]] Eigen::Vector3f backdrop(const Eigen::Vector3f& direction_W) const;
  // Of the material, without its texture, 0..1.
  [[nodiscard]] float brightness(unsigned item, unsigned triangle) const;

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
  [[nodiscard]] const Material& material_at(unsigned item, unsigned triangle) const;
  void surface(unsigned lane, const RTCRayHit8& rays, float pixel_angle, SurfacePacket& out) const;
  unsigned add_lamp(const Lamp& lamp, const int* hit, const RTCRayHit8& rays, const SurfacePacket& surface,
                    Lanes3& out) const;

  const EmbreeScene& scene_;
  std::vector<Material> materials_;
  std::vector<std::vector<int>> material_of_triangle_;  // [meshes][triangles]; empty: one part
  std::vector<TexturePyramid> textures_;
  std::vector<Lamp> lamps_;
  Eigen::Vector3f ambient_, background_, zenith_, horizon_;
};

}  // namespace doppel::embree
