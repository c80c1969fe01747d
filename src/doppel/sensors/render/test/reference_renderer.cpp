#include "reference_renderer.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace doppel {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector4d;

constexpr int kTransparentLayers = 6;
constexpr double kShadowOffset = 1e-6;  // m
constexpr std::uint32_t kLeaf = 4;      // triangles

double decoded(double srgb) {
  return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
}
std::uint8_t encoded(double linear) {
  const double value = linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
  return static_cast<std::uint8_t>(std::lround(255 * value));
}
Vector3d decoded(const Vector3d& srgb) {
  return srgb.unaryExpr([](double value) { return decoded(std::clamp(value, 0.0, 1.0)); });
}

// Linear light and opacity at a corner of the grid of texels, repeated.
Vector4d texel(const Bitmap& image, int x, int y) {
  const std::uint8_t* at = image.at((x % image.width + image.width) % image.width,
                                    (y % image.height + image.height) % image.height);
  return {decoded(at[0] / 255.0), decoded(at[1] / 255.0), decoded(at[2] / 255.0),
          image.channels == 4 ? at[3] / 255.0 : 1.0};
}
Vector4d bilinear(const Bitmap& image, double x, double y) {
  const double x0 = std::floor(x - 0.5), y0 = std::floor(y - 0.5), fx = x - 0.5 - x0, fy = y - 0.5 - y0;
  const int u = static_cast<int>(x0), v = static_cast<int>(y0);
  return (1 - fy) * ((1 - fx) * texel(image, u, v) + fx * texel(image, u + 1, v)) +
         fy * ((1 - fx) * texel(image, u, v + 1) + fx * texel(image, u + 1, v + 1));
}
// The mean over a square of `texels` texels around a point.
Vector4d mean(const Bitmap& image, const Vector2d& uv, double texels) {
  const int steps = std::clamp(static_cast<int>(std::ceil(texels)), 1, 32);
  Vector4d sum = Vector4d::Zero();
  for (int i = 0; i < steps; ++i)
    for (int j = 0; j < steps; ++j)
      sum += bilinear(image, uv.x() * image.width + ((i + 0.5) / steps - 0.5) * texels,
                      uv.y() * image.height + ((j + 0.5) / steps - 0.5) * texels);
  return sum / (steps * steps);
}

bool reaches(const Eigen::AlignedBox3d& box, const Vector3d& from, const Vector3d& along, double far) {
  double begin = 0, end = far;
  for (int axis = 0; axis < 3; ++axis) {
    // Flat boxes must not be missed because of rounding.
    const double low = (box.min()[axis] - 1e-9 - from[axis]) / along[axis],
                 high = (box.max()[axis] + 1e-9 - from[axis]) / along[axis];
    if (std::isnan(low) || std::isnan(high)) continue;
    begin = std::max(begin, std::min(low, high));
    end = std::min(end, std::max(low, high));
  }
  return begin <= end;
}

}  // namespace

void ReferenceRenderer::set_poses(std::span<const Pose> bodies) {
  poses_.assign(bodies.begin(), bodies.end());
  triangles_.clear();
  nodes_.clear();
  for (std::uint32_t i = 0; i < scene_->items.size(); ++i) {
    const SceneItem& item = scene_->items[i];
    const SurfaceMesh& mesh = *scene_->meshes[static_cast<std::size_t>(item.mesh)];
    const Pose X_WM = poses_[static_cast<std::size_t>(item.body)] * item.X_BM;
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
      const auto at = [&](std::size_t corner) -> Vector3d {
        return X_WM * mesh.positions[mesh.triangles[t][corner]].cast<double>();
      };
      const Vector3d a = at(0);
      triangles_.push_back({a, at(1) - a, at(2) - a, i, t});
    }
  }
  if (!triangles_.empty()) build(0, static_cast<std::uint32_t>(triangles_.size()));
}

int ReferenceRenderer::build(std::uint32_t begin, std::uint32_t end) {
  const int self = static_cast<int>(nodes_.size());
  Node node{{}, begin, end};
  for (std::uint32_t i = begin; i < end; ++i) {
    const Triangle& t = triangles_[i];
    node.box.extend(t.a).extend(t.a + t.ab).extend(t.a + t.ac);
  }
  nodes_.push_back(node);
  if (end - begin <= kLeaf) return self;
  Eigen::Index axis = 0;
  node.box.sizes().maxCoeff(&axis);
  const auto centre = [axis](const Triangle& t) { return 3 * t.a[axis] + t.ab[axis] + t.ac[axis]; };
  const std::uint32_t middle = begin + (end - begin) / 2;
  std::nth_element(triangles_.begin() + begin, triangles_.begin() + middle, triangles_.begin() + end,
                   [&](const Triangle& a, const Triangle& b) { return centre(a) < centre(b); });
  const int left = build(begin, middle), right = build(middle, end);
  nodes_[static_cast<std::size_t>(self)].left = left;
  nodes_[static_cast<std::size_t>(self)].right = right;
  return self;
}

// Source: T. Möller and B. Trumbore, "Fast, minimum storage ray-triangle intersection", 1997.
std::optional<ReferenceRenderer::Hit> ReferenceRenderer::nearest(const Ray& ray, double near,
                                                                 double far) const {
  std::optional<Hit> best;
  std::vector<int> open;
  if (!nodes_.empty()) open.push_back(0);
  while (!open.empty()) {
    const Node& node = nodes_[static_cast<std::size_t>(open.back())];
    open.pop_back();
    if (!reaches(node.box, ray.from, ray.along, best ? best->distance : far)) continue;
    if (node.left >= 0) {
      open.push_back(node.left);
      open.push_back(node.right);
      continue;
    }
    for (std::uint32_t i = node.begin; i < node.end; ++i) {
      const Triangle& t = triangles_[i];
      const Vector3d p = ray.along.cross(t.ac), s = ray.from - t.a, q = s.cross(t.ab);
      const double determinant = t.ab.dot(p);
      if (determinant == 0) continue;
      const double u = s.dot(p) / determinant, v = ray.along.dot(q) / determinant,
                   d = t.ac.dot(q) / determinant;
      if (u >= 0 && v >= 0 && u + v <= 1 && d >= near && d <= (best ? best->distance : far))
        best = Hit{d, u, v, &t};
    }
  }
  return best;
}

Vector3d ReferenceRenderer::backdrop(const Vector3d& along) const {
  if (!scene_->environment.sky) return decoded(Vector3d(scene_->environment.background.head<3>()));
  const double up = std::max(0.0, along.z() / along.norm());
  const Vector3d zenith = decoded(Vector3d(0.32, 0.52, 0.82)), horizon = decoded(Vector3d(0.80, 0.87, 0.94));
  return horizon + (zenith - horizon) * std::pow(up, 0.6);
}

void ReferenceRenderer::paint(const Ray& ray, const Hit& hit, const SurfaceMaterial& material,
                              double pixel_angle, Surface& out) const {
  const SceneItem& item = scene_->items[hit.triangle->item];
  const SurfaceMesh& mesh = *scene_->meshes[static_cast<std::size_t>(item.mesh)];
  out.colour = decoded(Vector3d(material.rgba.head<3>().cast<double>()));
  out.emissive = decoded(Vector3d(material.emissive.cast<double>()));
  out.opacity = static_cast<double>(material.rgba[3]);
  out.specular = static_cast<double>(material.specular);
  out.shininess = static_cast<double>(material.shininess);
  if (material.texture < 0 || mesh.uvs.empty()) return;
  const Bitmap& image = scene_->textures[static_cast<std::size_t>(material.texture)];
  const auto& t = mesh.triangles[hit.triangle->index];
  const Vector2d a = mesh.uvs[t[0]].cast<double>(), b = mesh.uvs[t[1]].cast<double>(),
                 c = mesh.uvs[t[2]].cast<double>(), ab = b - a, ac = c - a;
  const double area = hit.triangle->ab.cross(hit.triangle->ac).norm(),
               texel_area = std::abs(ab.x() * ac.y() - ab.y() * ac.x()) * image.width * image.height;
  const double length = ray.along.norm(), cosine = std::abs(out.ng.dot(ray.along)) / length;
  const double pixel = hit.distance * length * pixel_angle / std::sqrt(std::max(cosine, 0.15));  // m
  const Vector4d sample = mean(image, a + hit.u * ab + hit.v * ac, pixel * std::sqrt(texel_area / area));
  out.colour = out.colour.cwiseProduct(sample.head<3>());
  out.opacity *= sample[3];
}

ReferenceRenderer::Surface ReferenceRenderer::surface(const Ray& ray, const Hit& hit,
                                                      double pixel_angle) const {
  const Triangle& triangle = *hit.triangle;
  const SceneItem& item = scene_->items[triangle.item];
  const SurfaceMesh& mesh = *scene_->meshes[static_cast<std::size_t>(item.mesh)];
  const auto& t = mesh.triangles[triangle.index];
  Surface out;
  out.p = ray.from + ray.along * hit.distance;
  out.ng = triangle.ab.cross(triangle.ac).normalized();
  const Vector3d mixed = (1 - hit.u - hit.v) * mesh.normals[t[0]].cast<double>() +
                         hit.u * mesh.normals[t[1]].cast<double>() +
                         hit.v * mesh.normals[t[2]].cast<double>();
  const Pose X_WM = poses_[static_cast<std::size_t>(item.body)] * item.X_BM;
  out.n = mixed.norm() > 1e-6 ? Vector3d((X_WM.linear() * mixed).normalized()) : out.ng;
  if (out.ng.dot(ray.along) > 0) {
    out.ng = -out.ng;
    out.n = -out.n;
  }
  if (out.n.dot(ray.along) > 0) out.n = out.ng;
  int material = item.material;
  for (const SurfaceMesh::Part& part : mesh.parts)
    if (part.begin <= triangle.index && triangle.index < part.end && part.material >= 0)
      material = part.material;
  paint(ray, hit, scene_->materials[static_cast<std::size_t>(material)], pixel_angle, out);
  return out;
}

Vector3d ReferenceRenderer::lamp_light(const Light& lamp, const Ray& ray, const Surface& s) const {
  const Vector3d axis = lamp.direction_W.normalized();
  Vector3d towards = -axis;
  double distance = 1e6, strength = 1;
  if (lamp.kind != LightKind::directional) {
    towards = lamp.X_WL.translation() - s.p;
    distance = towards.norm();
    towards /= distance;
    if (distance > lamp.range) return Vector3d::Zero();
    strength = 1 / std::max(1e-3, lamp.attenuation_constant + distance * lamp.attenuation_linear +
                                      distance * distance * lamp.attenuation_quadratic);
  }
  if (lamp.kind == LightKind::spot) {
    const double cosine = -towards.dot(axis), inner = std::cos(lamp.inner_angle / 2),
                 outer = std::cos(lamp.outer_angle / 2);
    if (cosine <= outer) return Vector3d::Zero();
    if (cosine < inner) strength *= std::pow((cosine - outer) / (inner - outer), lamp.falloff);
  }
  const double facing = s.n.dot(towards);
  if (facing <= 0 || s.ng.dot(towards) <= 0) return Vector3d::Zero();
  if (lamp.cast_shadows && scene_->environment.shadows &&
      nearest({s.p + kShadowOffset * s.ng, towards}, 0, distance))
    return Vector3d::Zero();
  const Vector3d half = (towards - ray.along.normalized()).normalized();
  const double shine = s.specular * std::pow(std::max(0.0, s.n.dot(half)), s.shininess);
  const Vector3d colour = lamp.intensity * decoded(Vector3d(lamp.diffuse.head<3>()));
  return strength * colour.cwiseProduct(s.colour * facing + Vector3d::Constant(shine));
}

Vector3d ReferenceRenderer::light(const Ray& ray, const Surface& s) const {
  const Vector3d ambient = decoded(Vector3d(scene_->environment.ambient.head<3>()));
  Vector3d out = s.emissive + s.colour.cwiseProduct(ambient) * (0.775 + 0.225 * s.n.z());
  for (const Light& lamp : scene_->lights)
    if (lamp.on) out += lamp_light(lamp, ray, s);
  return out;
}

Vector3d ReferenceRenderer::colour(const Ray& ray, const CameraView& view, double pixel_angle) const {
  Vector3d sum = Vector3d::Zero();
  double left = 1, near = view.near;
  for (int layer = 1; layer <= kTransparentLayers; ++layer) {
    const std::optional<Hit> hit = nearest(ray, near, view.far);
    if (!hit) return sum + left * backdrop(ray.along);
    const Surface s = surface(ray, *hit, pixel_angle);
    const double share = layer == kTransparentLayers || s.opacity >= 0.995 ? 1 : s.opacity;
    sum += left * share * light(ray, s);
    left *= 1 - share;
    if (share == 1) break;
    near = hit->distance + 1e-7;
  }
  return sum;
}

void ReferenceRenderer::render(const CameraView& view, CameraPicture& out) const {
  const std::size_t pixels = view.samples.front().x.size();
  out.rgb.assign(view.colour ? 3 * pixels : 0, 0);
  out.depth.assign(view.depth ? pixels : 0, std::numeric_limits<float>::infinity());
  out.labels.assign(view.labels ? pixels : 0, 0);
  for (std::size_t i = 0; i < pixels; ++i) {
    Vector3d sum = Vector3d::Zero();
    for (std::size_t sample = 0; sample < view.samples.size(); ++sample) {
      const PixelRays& rays = view.samples[sample];
      const Vector3d along_C = Eigen::Vector3f(rays.x[i], rays.y[i], rays.z[i]).cast<double>();
      if (along_C.isZero(0)) continue;
      const Ray ray{view.X_WC.translation(), view.X_WC.linear() * along_C};
      if (view.colour) {
        const Vector3d linear = colour(ray, view, static_cast<double>(rays.pixel_angle));
        sum += linear.cwiseMax(0.0).cwiseMin(1.0);
      }
      if (sample > 0 || (!view.depth && !view.labels)) continue;
      if (const std::optional<Hit> hit = nearest(ray, view.near, view.far)) {
        if (view.depth) out.depth[i] = static_cast<float>(hit->distance);
        if (view.labels) out.labels[i] = scene_->items[hit->triangle->item].label;
      }
      const std::optional<Hit> close = view.depth ? nearest(ray, 0, view.near) : std::nullopt;
      if (close && scene_->items[close->triangle->item].body != view.own_body)
        out.depth[i] = -std::numeric_limits<float>::infinity();
    }
    for (std::size_t c = 0; view.colour && c < 3; ++c)
      out.rgb[3 * i + c] =
          encoded(sum[static_cast<Eigen::Index>(c)] / static_cast<double>(view.samples.size()));
  }
}

}  // namespace doppel
