#include "doppel/rays/embree/shading.h"

#include <algorithm>
#include <cmath>

namespace doppel::embree {
namespace {

using Eigen::Vector3f;

constexpr float kOffset = 2e-4F;  // m, at 1 m: a shadow ray starts this far from its surface
constexpr float kBelow = 0.55F;   // light from below, against that from above

Vector3f linear(const Vector3f& srgb) {
  return srgb.unaryExpr([](float value) { return linear_of_srgb(std::clamp(value, 0.0F, 1.0F)); });
}

Vector3f at(const Lanes3& values, unsigned lane) {
  return {values.x.v[lane], values.y.v[lane], values.z.v[lane]};
}

void put(const Vector3f& value, unsigned lane, Lanes3& out) {
  out.x.v[lane] = value.x();
  out.y.v[lane] = value.y();
  out.z.v[lane] = value.z();
}

}  // namespace

Shading::Shading(const EmbreeScene& scene) : scene_(scene) {
  const RenderScene& from = scene.scene();
  for (const Bitmap& image : from.textures) textures_.emplace_back(image);
  for (const SurfaceMaterial& m : from.materials) {
    Material out{m.rgba, linear(m.emissive), m.specular, m.shininess, m.texture};
    out.rgba.head<3>() = linear(m.rgba.head<3>());
    materials_.push_back(out);
  }
  for (const auto& mesh : from.meshes) {
    std::vector<int> of_triangle;
    if (mesh->parts.size() > 1) {
      of_triangle.resize(mesh->triangles.size());
      for (const SurfaceMesh::Part& part : mesh->parts)
        std::fill(of_triangle.begin() + part.begin, of_triangle.begin() + part.end, part.material);
    }
    material_of_triangle_.push_back(std::move(of_triangle));
  }
  for (const Light& light : from.lights) {
    if (!light.on) continue;
    const Vector3f colour =
        linear(light.diffuse.head<3>().cast<float>()) * static_cast<float>(light.intensity);
    lamps_.push_back(
        {light.kind, colour, light.X_WL.translation().cast<float>(),
         -light.direction_W.normalized().cast<float>(), static_cast<float>(light.range),
         static_cast<float>(light.attenuation_constant), static_cast<float>(light.attenuation_linear),
         static_cast<float>(light.attenuation_quadratic), static_cast<float>(std::cos(light.inner_angle / 2)),
         static_cast<float>(std::cos(light.outer_angle / 2)), static_cast<float>(light.falloff),
         light.cast_shadows && from.environment.shadows});
  }
  ambient_ = linear(from.environment.ambient.head<3>().cast<float>());
  background_ = linear(from.environment.background.head<3>().cast<float>());
  zenith_ = linear({0.32F, 0.52F, 0.82F});
  horizon_ = linear({0.80F, 0.87F, 0.94F});
}

Vector3f Shading::backdrop(const Vector3f& direction_W) const {
  if (!scene_.scene().environment.sky) return background_;
  const float up = std::clamp(direction_W.normalized().z(), 0.0F, 1.0F);
  return horizon_ + (zenith_ - horizon_) * std::pow(up, 0.6F);
}

const Shading::Material& Shading::material_at(unsigned item, unsigned triangle) const {
  const SceneItem& it = scene_.scene().items[item];
  const auto mesh = static_cast<std::size_t>(it.mesh);
  const int of_part = material_of_triangle_[mesh].empty()
                          ? scene_.scene().meshes[mesh]->parts.front().material
                          : material_of_triangle_[mesh][triangle];
  return materials_[static_cast<std::size_t>(of_part >= 0 ? of_part : it.material)];
}

float Shading::brightness(unsigned item, unsigned triangle) const {
  const Eigen::Vector4f& c = material_at(item, triangle).rgba;
  return 0.2126F * c[0] + 0.7152F * c[1] + 0.0722F * c[2];
}

void Shading::surface(unsigned lane, const RTCRayHit8& rays, float pixel_angle, SurfacePacket& out) const {
  const unsigned item = rays.hit.geomID[lane], triangle = rays.hit.primID[lane];
  const SceneItem& it = scene_.scene().items[item];
  const SurfaceMesh& mesh = *scene_.scene().meshes[static_cast<std::size_t>(it.mesh)];
  const auto& t = mesh.triangles[triangle];
  const float u = rays.hit.u[lane], v = rays.hit.v[lane], w = 1 - u - v;
  const Eigen::Matrix3f& R = scene_.rotation(item);
  const Vector3f d(rays.ray.dir_x[lane], rays.ray.dir_y[lane], rays.ray.dir_z[lane]);
  const Vector3f ng =
      (R * (mesh.positions[t[1]] - mesh.positions[t[0]]).cross(mesh.positions[t[2]] - mesh.positions[t[0]]))
          .normalized();
  Vector3f n = R * (w * mesh.normals[t[0]] + u * mesh.normals[t[1]] + v * mesh.normals[t[2]]);
  const bool from_behind = ng.dot(d) > 0;
  const float length = n.norm();
  n = length > 1e-6F ? Vector3f(n / length) : ng;
  if (from_behind != (n.dot(d) > 0))
    n = from_behind ? Vector3f(-ng) : ng;  // smoothed over the edge of what is seen
  put(from_behind ? Vector3f(-n) : n, lane, out.n);
  put(from_behind ? Vector3f(-ng) : ng, lane, out.ng);

  const Material& material = material_at(item, triangle);
  Eigen::Vector4f colour = material.rgba;
  if (material.texture >= 0 && !mesh.uvs.empty()) {
    const TexturePyramid& texture = textures_[static_cast<std::size_t>(material.texture)];
    const Eigen::Vector2f &a = mesh.uvs[t[0]], &b = mesh.uvs[t[1]], &c = mesh.uvs[t[2]];
    const Eigen::Vector2f uv = w * a + u * b + v * c, e1 = b - a, e2 = c - a;
    const float texels =
        std::abs(e1.x() * e2.y() - e1.y() * e2.x()) * static_cast<float>(texture.width() * texture.height());
    const float area = (mesh.positions[t[1]] - mesh.positions[t[0]])
                           .cross(mesh.positions[t[2]] - mesh.positions[t[0]])
                           .norm();
    const float footprint = rays.ray.tfar[lane] * d.norm() * pixel_angle /
                            std::sqrt(std::max(0.15F, std::abs(ng.dot(d)) / d.norm()));
    colour = colour.cwiseProduct(
        texture.sample(uv.x(), uv.y(), footprint * std::sqrt(texels / std::max(area, 1e-12F))));
  }
  put(colour.head<3>(), lane, out.colour);
  put(material.emissive, lane, out.emissive);
  out.opacity.v[lane] = colour[3];
  out.specular.v[lane] = material.specular;
  out.shininess.v[lane] = material.shininess;
}

void Shading::surfaces(const int* hit, const RTCRayHit8& rays, float pixel_angle, SurfacePacket& out) const {
  for (unsigned i = 0; i < kLanes; ++i) {
    const float t = rays.ray.tfar[i];
    out.p.x.v[i] = rays.ray.org_x[i] + t * rays.ray.dir_x[i];
    out.p.y.v[i] = rays.ray.org_y[i] + t * rays.ray.dir_y[i];
    out.p.z.v[i] = rays.ray.org_z[i] + t * rays.ray.dir_z[i];
  }
  for (unsigned lane = 0; lane < kLanes; ++lane)
    if (hit[lane] != 0) surface(lane, rays, pixel_angle, out);
}

unsigned Shading::add_lamp(const Lamp& lamp, const int* hit, const RTCRayHit8& rays, const SurfacePacket& s,
                           Lanes3& out) const {
  alignas(32) RTCRay8 shadow;
  Lanes diffuse, shine;
  alignas(32) int lit[kLanes];
  unsigned count = 0;
  for (unsigned i = 0; i < kLanes; ++i) {
    lit[i] = 0;
    shadow.tfar[i] = -1;
    if (hit[i] == 0) continue;
    const Vector3f p = at(s.p, i), n = at(s.n, i), ng = at(s.ng, i);
    Vector3f l = lamp.towards;
    float distance = 1e6F, strength = 1;
    if (lamp.kind != LightKind::directional) {
      l = lamp.p - p;
      distance = l.norm();
      if (distance > lamp.range || distance < 1e-6F) continue;
      l /= distance;
      strength =
          1 / std::max(1e-3F, lamp.constant + lamp.linear * distance + lamp.quadratic * distance * distance);
      if (lamp.kind == LightKind::spot) {
        const float c = l.dot(lamp.towards);
        if (c <= lamp.cos_outer) continue;
        if (c < lamp.cos_inner)
          strength *=
              std::pow((c - lamp.cos_outer) / std::max(1e-6F, lamp.cos_inner - lamp.cos_outer), lamp.falloff);
      }
    }
    const float facing = n.dot(l);
    if (facing <= 0 || ng.dot(l) <= 0) continue;
    lit[i] = -1;
    ++count;
    diffuse.v[i] = facing * strength;
    shine.v[i] = 0;
    if (s.specular.v[i] > 0) {
      const Vector3f d(rays.ray.dir_x[i], rays.ray.dir_y[i], rays.ray.dir_z[i]);
      const Vector3f half = (l - d.normalized()).normalized();
      shine.v[i] = s.specular.v[i] * strength * std::pow(std::max(0.0F, n.dot(half)), s.shininess.v[i]);
    }
    const Vector3f from = p + ng * (kOffset * std::max(1.0F, rays.ray.tfar[i] * 0.1F));
    shadow.org_x[i] = from.x();
    shadow.org_y[i] = from.y();
    shadow.org_z[i] = from.z();
    shadow.dir_x[i] = l.x();
    shadow.dir_y[i] = l.y();
    shadow.dir_z[i] = l.z();
    shadow.tnear[i] = 0;
    shadow.tfar[i] = distance;
    shadow.time[i] = 0;
    shadow.mask[i] = ~0U;
    shadow.id[i] = 0;
    shadow.flags[i] = 0;
  }
  if (count == 0) return 0;
  if (lamp.shadows) scene_.occlude(lit, shadow, true);
  for (unsigned i = 0; i < kLanes; ++i) {
    if (lit[i] == 0 || shadow.tfar[i] < 0) continue;
    out.x.v[i] += lamp.colour.x() * (s.colour.x.v[i] * diffuse.v[i] + shine.v[i]);
    out.y.v[i] += lamp.colour.y() * (s.colour.y.v[i] * diffuse.v[i] + shine.v[i]);
    out.z.v[i] += lamp.colour.z() * (s.colour.z.v[i] * diffuse.v[i] + shine.v[i]);
  }
  return lamp.shadows ? count : 0;
}

unsigned Shading::light(const int* hit, const RTCRayHit8& rays, const SurfacePacket& s, Lanes3& out) const {
  for (unsigned i = 0; i < kLanes; ++i) {
    if (hit[i] == 0) continue;
    const float sky = kBelow + (1 - kBelow) * 0.5F * (1 + s.n.z.v[i]);
    out.x.v[i] = s.colour.x.v[i] * ambient_.x() * sky + s.emissive.x.v[i];
    out.y.v[i] = s.colour.y.v[i] * ambient_.y() * sky + s.emissive.y.v[i];
    out.z.v[i] = s.colour.z.v[i] * ambient_.z() * sky + s.emissive.z.v[i];
  }
  unsigned count = 0;
  for (const Lamp& lamp : lamps_) count += add_lamp(lamp, hit, rays, s, out);
  return count;
}

}  // namespace doppel::embree
