#include "doppel/sensors/render/embree/shading.h"

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

// Of each triangle: the square root of the texture's area on it, in pictures, over its own.
std::vector<float> texture_per_metre(const SurfaceMesh& mesh) {
  std::vector<float> out;
  if (mesh.uvs.empty()) return out;
  out.reserve(mesh.triangles.size());
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector2f &a = mesh.uvs[t[0]], e1 = mesh.uvs[t[1]] - a, e2 = mesh.uvs[t[2]] - a;
    const Vector3f& p = mesh.positions[t[0]];
    const float area = (mesh.positions[t[1]] - p).cross(mesh.positions[t[2]] - p).norm();
    out.push_back(std::sqrt(std::abs(e1.x() * e2.y() - e1.y() * e2.x()) / std::max(area, 1e-12F)));
  }
  return out;
}

Floats3 origin(const RayHitPacket& rays) {
  return {load(rays.ray.org_x), load(rays.ray.org_y), load(rays.ray.org_z)};
}
Floats3 direction(const RayHitPacket& rays) {
  return {load(rays.ray.dir_x), load(rays.ray.dir_y), load(rays.ray.dir_z)};
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
    Mesh out;
    if (mesh->parts.size() > 1) {
      out.materials.resize(mesh->triangles.size());
      for (const SurfaceMesh::Part& part : mesh->parts)
        std::fill(out.materials.begin() + part.begin, out.materials.begin() + part.end, part.material);
    }
    out.texture_per_metre = texture_per_metre(*mesh);
    meshes_.push_back(std::move(out));
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

Floats3 Shading::backdrop(const Floats3& direction_W) const {
  if (!scene_.scene().environment.sky) return broadcast(background_);
  // A sky without a picture: a gradient from the horizon to the zenith, faster near the horizon, as haze
  // is.
  const Floats up = larger(smaller(direction_W.z / norm(direction_W), broadcast(1.0F)), broadcast(0.0F));
  return broadcast(horizon_) + broadcast(Vector3f(zenith_ - horizon_)) * power(up, broadcast(0.6F));
}

const Shading::Material& Shading::material_at(unsigned item, unsigned triangle) const {
  const SceneItem& it = scene_.scene().items[item];
  const auto mesh = static_cast<std::size_t>(it.mesh);
  const int of_part = meshes_[mesh].materials.empty() ? scene_.scene().meshes[mesh]->parts.front().material
                                                      : meshes_[mesh].materials[triangle];
  return materials_[static_cast<std::size_t>(of_part >= 0 ? of_part : it.material)];
}

Floats Shading::brightness(Ints hit, const RayHitPacket& rays) const {
  const auto of_lane = [this, &rays](int lane) {
    const Eigen::Vector4f& c = material_at(rays.hit.geomID[lane], rays.hit.primID[lane]).rgba;
    // Luminance of linear sRGB (ITU-R BT.709).
    return 0.2126F * c[0] + 0.7152F * c[1] + 0.0722F * c[2];
  };
  const Sameness same = sameness(hit, rays);
  if (same.material) return hit ? broadcast(of_lane(same.lane)) : Floats{};
  Floats out{};
  for (int i = 0; i < kLanes; ++i)
    if (hit[i] != 0) out[i] = of_lane(i);
  return out;
}

Shading::Sameness Shading::sameness(Ints hit, const RayHitPacket& rays) const {
  // Neighbouring rays mostly hit one triangle or one item: its data are then read once for all lanes
  // instead of gathered for each.
  const int lane = first_of(hit);
  const Ints item = load(rays.hit.geomID), triangle = load(rays.hit.primID);
  Sameness same{lane, !any(hit & (item != item[lane])), false, false};
  same.triangle = same.item && !any(hit & (triangle != triangle[lane]));
  const auto mesh = static_cast<std::size_t>(scene_.scene().items[static_cast<std::size_t>(item[lane])].mesh);
  same.material = same.triangle || (same.item && meshes_[mesh].materials.empty());
  return same;
}

// From the axes of each lane's mesh to those of the world.
Floats3 Shading::in_world(Ints hit, const RayHitPacket& rays, const Sameness& same,
                          const Floats3& v_M) const {
  if (same.item) return turned(scene_.rotation(rays.hit.geomID[same.lane]), v_M);
  alignas(64) float R[9][kLanes] = {};
  for (int i = 0; i < kLanes; ++i) {
    if (hit[i] == 0) continue;
    const float* of_item = scene_.rotation(rays.hit.geomID[i]).data();
    for (int k = 0; k < 9; ++k) R[k][i] = of_item[k];
  }
  return {load(R[0]) * v_M.x + load(R[3]) * v_M.y + load(R[6]) * v_M.z,
          load(R[1]) * v_M.x + load(R[4]) * v_M.y + load(R[7]) * v_M.z,
          load(R[2]) * v_M.x + load(R[5]) * v_M.y + load(R[8]) * v_M.z};
}

Floats3 Shading::triangle_normals(Ints hit, const RayHitPacket& rays) const {
  const Floats3 ng{load(rays.hit.Ng_x), load(rays.hit.Ng_y), load(rays.hit.Ng_z)};
  // Fixed surfaces are in the world's axes already.
  const Ints moving = hit & (load(rays.hit.instID[0]) != -1);
  return any(moving) ? select(moving, in_world(moving, rays, sameness(moving, rays), ng), ng) : ng;
}

// Those of the corners, mixed at each hit; axes of the mesh.
Floats3 Shading::corner_normals(Ints hit, const RayHitPacket& rays, const Sameness& same) const {
  const Floats u = load(rays.hit.u), v = load(rays.hit.v), w = 1.0F - u - v;
  const auto normal = [this, &rays](int lane, std::size_t corner) {
    const SceneItem& item = scene_.scene().items[rays.hit.geomID[lane]];
    const SurfaceMesh& mesh = *scene_.scene().meshes[static_cast<std::size_t>(item.mesh)];
    return mesh.normals[mesh.triangles[rays.hit.primID[lane]][corner]].data();
  };
  if (same.triangle) {
    const float *a = normal(same.lane, 0), *b = normal(same.lane, 1), *c = normal(same.lane, 2);
    const auto mixed = [&](int axis) { return w * a[axis] + u * b[axis] + v * c[axis]; };
    return {mixed(0), mixed(1), mixed(2)};
  }
  alignas(64) float at[3][3][kLanes] = {};  // corner, axis
  for (int i = 0; i < kLanes; ++i)
    for (std::size_t corner = 0; hit[i] != 0 && corner < 3; ++corner) {
      const float* of_corner = normal(i, corner);
      for (std::size_t axis = 0; axis < 3; ++axis) at[corner][axis][i] = of_corner[axis];
    }
  const auto mixed = [&](int axis) {
    return w * load(at[0][axis]) + u * load(at[1][axis]) + v * load(at[2][axis]);
  };
  return {mixed(0), mixed(1), mixed(2)};
}

void Shading::materials(Ints hit, const RayHitPacket& rays, const Sameness& same, SurfacePacket& out) const {
  if (same.material) {
    const Material& m = material_at(rays.hit.geomID[same.lane], rays.hit.primID[same.lane]);
    out.colour = broadcast(Vector3f(m.rgba.head<3>()));
    out.opacity = broadcast(m.rgba[3]);
    out.emissive = broadcast(m.emissive);
    out.specular = broadcast(m.specular);
    out.shininess = broadcast(m.shininess);
    return;
  }
  alignas(64) float values[9][kLanes] = {};
  for (int i = 0; i < kLanes; ++i) {
    if (hit[i] == 0) continue;
    const Material& m = material_at(rays.hit.geomID[i], rays.hit.primID[i]);
    for (int k = 0; k < 4; ++k) values[k][i] = m.rgba[k];
    for (int k = 0; k < 3; ++k) values[4 + k][i] = m.emissive[k];
    values[7][i] = m.specular;
    values[8][i] = m.shininess;
  }
  out.colour = {load(values[0]), load(values[1]), load(values[2])};
  out.opacity = load(values[3]);
  out.emissive = {load(values[4]), load(values[5]), load(values[6])};
  out.specular = load(values[7]);
  out.shininess = load(values[8]);
}

void Shading::textures(Ints hit, const RayHitPacket& rays, float pixel_angle, SurfacePacket& out) const {
  const Floats3 d = direction(rays);
  const Floats length = norm(d), cosine = -dot(out.ng, d) / length;
  // The footprint of a pixel on the surface grows with the distance and with the obliqueness of the view;
  // the square root is between the two axes of the stretched pixel, and the floor bounds it at grazing
  // rays.
  const Floats footprint =
      load(rays.ray.tfar) * length * pixel_angle / root(larger(cosine, broadcast(0.15F)));
  for (int i = 0; i < kLanes; ++i) {
    if (hit[i] == 0) continue;
    const unsigned item = rays.hit.geomID[i], triangle = rays.hit.primID[i];
    const auto index = static_cast<std::size_t>(scene_.scene().items[item].mesh);
    const Material& material = material_at(item, triangle);
    const SurfaceMesh& mesh = *scene_.scene().meshes[index];
    if (material.texture < 0 || mesh.uvs.empty()) continue;
    const auto& t = mesh.triangles[triangle];
    const float u = rays.hit.u[i], v = rays.hit.v[i], w = 1 - u - v;
    const Eigen::Vector2f uv = w * mesh.uvs[t[0]] + u * mesh.uvs[t[1]] + v * mesh.uvs[t[2]];
    const TexturePyramid& texture = textures_[static_cast<std::size_t>(material.texture)];
    const float texels = footprint[i] * meshes_[index].texture_per_metre[triangle] *
                         std::sqrt(static_cast<float>(texture.width() * texture.height()));
    const Eigen::Vector4f sample = texture.sample(uv.x(), uv.y(), texels);
    out.colour.x[i] *= sample[0];
    out.colour.y[i] *= sample[1];
    out.colour.z[i] *= sample[2];
    out.opacity[i] *= sample[3];
  }
}

void Shading::surfaces(Ints hit, const RayHitPacket& rays, float pixel_angle, SurfacePacket& out) const {
  const Floats3 d = direction(rays);
  out.p = origin(rays) + d * load(rays.ray.tfar);
  const Sameness same = sameness(hit, rays);
  Floats3 ng = triangle_normals(hit, rays), n = in_world(hit, rays, same, corner_normals(hit, rays, same));
  ng = ng * (1.0F / norm(ng));
  const Floats length = norm(n);
  n = select(length > 1e-6F, n * (1.0F / length), ng);
  // Surfaces have two sides, because the triangles of CAD exports are often wound either way.
  const Ints from_behind = dot(ng, d) > 0.0F;
  const Floats side = from_behind ? broadcast(-1.0F) : broadcast(1.0F);
  out.ng = ng * side;
  n = n * side;
  out.n = select(dot(n, d) > 0.0F, out.ng, n);  // smoothed over the edge of what is seen
  materials(hit, rays, same, out);
  if (!textures_.empty()) textures(hit, rays, pixel_angle, out);
}

// The light of a lamp at the surfaces, before shadows.
struct Shading::Incidence {
  Floats3 towards;  // unit
  Floats distance, strength;
  Ints reached;
};

Shading::Incidence Shading::incidence(const Lamp& lamp, const SurfacePacket& s) {
  if (lamp.kind == LightKind::directional)
    return {broadcast(lamp.towards), broadcast(1e6F), broadcast(1.0F), ~Ints{}};
  const Floats3 to_lamp = broadcast(lamp.p) - s.p;
  Incidence out;
  out.distance = norm(to_lamp);
  out.reached = (out.distance <= lamp.range) & (out.distance >= 1e-6F);
  out.towards = to_lamp * (1.0F / out.distance);
  // Attenuation as in SDF and OpenGL: 1 / (c + l d + q d^2).
  const Floats loss = lamp.constant + out.distance * (lamp.linear + lamp.quadratic * out.distance);
  out.strength = 1.0F / larger(loss, broadcast(1e-3F));
  if (lamp.kind == LightKind::spot) {
    const Floats cosine = dot(out.towards, broadcast(lamp.towards));
    out.reached &= cosine > lamp.cos_outer;
    const Floats share = (cosine - lamp.cos_outer) / std::max(1e-6F, lamp.cos_inner - lamp.cos_outer);
    out.strength *= cosine < lamp.cos_inner ? power(share, broadcast(lamp.falloff)) : broadcast(1.0F);
  }
  return out;
}

Floats3 Shading::lamp_light(const Lamp& lamp, Ints hit, const RayHitPacket& rays, const SurfacePacket& s,
                            std::uint64_t& shadow_rays) const {
  const Incidence from = incidence(lamp, s);
  const Floats facing = dot(s.n, from.towards);
  // The true normal is tested as well as the smoothed one: light would otherwise pass through edges that
  // only the smoothing bends towards it.
  Ints lit = hit & from.reached & (facing > 0.0F) & (dot(s.ng, from.towards) > 0.0F);
  if (lamp.shadows && any(lit)) {
    shadow_rays += count(lit);
    alignas(64) RayPacket shadow;
    // The start is lifted off the surface, in proportion to the distance, because single precision would
    // let a surface shade itself.
    const Floats3 surface = s.p + s.ng * (kOffset * larger(load(rays.ray.tfar) * 0.1F, broadcast(1.0F)));
    const Floats3 start = select(lit, surface, Floats3{});  // lanes without a surface are not numbers
    store(start.x, shadow.org_x);
    store(start.y, shadow.org_y);
    store(start.z, shadow.org_z);
    store(from.towards.x, shadow.dir_x);
    store(from.towards.y, shadow.dir_y);
    store(from.towards.z, shadow.dir_z);
    store(Floats{}, shadow.tnear);
    store(from.distance, shadow.tfar);
    store(Floats{}, shadow.time);
    store(~Ints{}, shadow.mask);
    store(Ints{}, shadow.id);
    store(Ints{}, shadow.flags);
    scene_.occlude(lit, shadow);
    lit &= load(shadow.tfar) >= 0.0F;
  }
  if (!any(lit)) return Floats3{};
  Floats3 out = s.colour * (facing * from.strength);
  if (any(hit & (s.specular > 0.0F))) {
    // Blinn's highlight: the half vector between light and viewer against the normal.
    const Floats3 d = direction(rays), half = from.towards - d * (1.0F / norm(d));
    const Floats cosine = dot(s.n, half) / norm(half);
    const Floats shine = s.specular * from.strength * power(larger(cosine, Floats{}), s.shininess);
    out = out + Floats3{shine, shine, shine};
  }
  const Floats3 coloured{out.x * lamp.colour.x(), out.y * lamp.colour.y(), out.z * lamp.colour.z()};
  return select(lit, coloured, Floats3{});
}

Floats3 Shading::light(Ints hit, const RayHitPacket& rays, const SurfacePacket& s,
                       std::uint64_t& shadow_rays) const {
  // Ambient light comes from a hemisphere, so that faces that look down are darker and shapes stay visible
  // without lamps.
  const Floats sky = kBelow + (1 - kBelow) * 0.5F * (1.0F + s.n.z);
  Floats3 out =
      s.emissive +
      Floats3{s.colour.x * ambient_.x(), s.colour.y * ambient_.y(), s.colour.z * ambient_.z()} * sky;
  for (const Lamp& lamp : lamps_) out = out + lamp_light(lamp, hit, rays, s, shadow_rays);
  return out;
}

}  // namespace doppel::embree
