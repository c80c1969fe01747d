#include "doppel/rays/embree/embree_caster.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace doppel::embree {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kLayers = 6;  // of transparent surfaces, one behind the other
constexpr float kOpaque = 0.995F;

void prepare(RTCRayHit8& rays, unsigned lane, const Eigen::Vector3f& from, const Eigen::Vector3f& to,
             float near, float far) {
  rays.ray.org_x[lane] = from.x();
  rays.ray.org_y[lane] = from.y();
  rays.ray.org_z[lane] = from.z();
  rays.ray.dir_x[lane] = to.x();
  rays.ray.dir_y[lane] = to.y();
  rays.ray.dir_z[lane] = to.z();
  rays.ray.tnear[lane] = near;
  rays.ray.tfar[lane] = far;
  rays.ray.time[lane] = 0;
  rays.ray.mask[lane] = ~0U;
  rays.ray.id[lane] = lane;
  rays.ray.flags[lane] = 0;
  rays.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
  rays.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
}

bool is_hit(const RTCRayHit8& rays, unsigned lane) {
  return rays.hit.geomID[lane] != RTC_INVALID_GEOMETRY_ID;
}

}  // namespace

struct EmbreeCaster::Target {
  const CameraView& view;
  CameraPicture& out;
  std::vector<float>& sums;  // linear colour of all samples so far, if there are several
  Eigen::Matrix3f R_WC;
  Eigen::Vector3f p_WC;
};

void EmbreeCaster::render(const CameraView& view, CameraPicture& out) const {
  const PixelRays& centres = view.samples.front();
  const auto pixels = static_cast<std::size_t>(centres.width) * static_cast<std::size_t>(centres.height);
  out.rgb.resize(view.colour ? 3 * pixels : 0);
  out.depth.resize(view.depth ? pixels : 0);
  out.labels.resize(view.labels ? pixels : 0);
  thread_local std::vector<float> sums;
  const bool several = view.colour && view.samples.size() > 1;
  if (several) sums.assign(3 * pixels, 0.0F);
  const Target target{view, out, sums, view.X_WC.linear().cast<float>(),
                      view.X_WC.translation().cast<float>()};
  std::uint64_t count = 0;
  for (std::size_t sample = 0; sample < (view.colour ? view.samples.size() : 1); ++sample)
    for (int y = 0; y < centres.height; ++y)
      for (int x = 0; x < centres.width; x += static_cast<int>(kLanes))
        count += render_packet(target, view.samples[sample], sample == 0, x, y);
  if (several) {
    const float share = 1.0F / static_cast<float>(view.samples.size());
    for (std::size_t i = 0; i < sums.size(); ++i) out.rgb[i] = srgb_of_linear(sums[i] * share);
  }
  rays_ += count;
}

std::uint64_t EmbreeCaster::render_packet(const Target& to, const PixelRays& pixels, bool first, int x,
                                          int y) const {
  alignas(32) RTCRayHit8 rays;
  alignas(32) int valid[kLanes];
  const auto at =
      static_cast<std::size_t>(y) * static_cast<std::size_t>(pixels.width) + static_cast<std::size_t>(x);
  const auto used = static_cast<unsigned>(std::min<int>(kLanes, pixels.width - x));
  const auto near = static_cast<float>(to.view.near), far = static_cast<float>(to.view.far);
  for (unsigned i = 0; i < kLanes; ++i) {
    valid[i] = i < used ? -1 : 0;
    const std::size_t pixel = at + std::min(i, used - 1);
    const Eigen::Vector3f d_C(pixels.x[pixel], pixels.y[pixel], pixels.z[pixel]);
    if (d_C.isZero()) valid[i] = 0;
    prepare(rays, i, to.p_WC, to.R_WC * d_C, near, far);
  }
  scene_.intersect(valid, rays, true);
  if (first && (to.view.depth || to.view.labels)) {
    for (unsigned i = 0; i < used; ++i) {
      const bool hit = valid[i] != 0 && is_hit(rays, i);
      if (to.view.depth) to.out.depth[at + i] = hit ? rays.ray.tfar[i] : kInfinity;
      if (to.view.labels) to.out.labels[at + i] = hit ? scene_.scene().items[rays.hit.geomID[i]].label : 0;
    }
  }
  std::uint64_t count = used;
  if (first && to.view.depth && near > 0) count += mark_near(to, pixels, x, y);
  if (to.view.colour) count += add_colours(to, valid, rays, pixels.pixel_angle, at);
  return count;
}

std::uint64_t EmbreeCaster::mark_near(const Target& to, const PixelRays& pixels, int x, int y) const {
  alignas(32) RTCRayHit8 rays;
  alignas(32) int valid[kLanes];
  const auto at =
      static_cast<std::size_t>(y) * static_cast<std::size_t>(pixels.width) + static_cast<std::size_t>(x);
  const auto used = static_cast<unsigned>(std::min<int>(kLanes, pixels.width - x));
  for (unsigned i = 0; i < kLanes; ++i) {
    valid[i] = i < used ? -1 : 0;
    const std::size_t pixel = at + std::min(i, used - 1);
    const Eigen::Vector3f d_C(pixels.x[pixel], pixels.y[pixel], pixels.z[pixel]);
    if (d_C.isZero()) valid[i] = 0;
    prepare(rays, i, to.p_WC, to.R_WC * d_C, 0, static_cast<float>(to.view.near));
  }
  scene_.intersect(valid, rays, true);
  for (unsigned i = 0; i < used; ++i) {
    if (valid[i] == 0 || !is_hit(rays, i)) continue;
    if (scene_.scene().items[rays.hit.geomID[i]].body != to.view.own_body) to.out.depth[at + i] = -kInfinity;
  }
  return used;
}

std::uint64_t EmbreeCaster::add_colours(const Target& to, int* valid, RTCRayHit8& rays, float pixel_angle,
                                        std::size_t at) const {
  Lanes3 sum{}, light{};
  Lanes left;  // of what is behind the surfaces so far, the part that is seen
  for (float& part : left.v) part = 1;
  alignas(32) int open[kLanes], hit[kLanes];
  std::copy(valid, valid + kLanes, open);
  std::uint64_t count = 0;
  SurfacePacket surface;
  for (int layer = 0; layer < kLayers; ++layer) {
    bool any = false, more = false;
    for (unsigned i = 0; i < kLanes; ++i) {
      hit[i] = open[i] != 0 && is_hit(rays, i) ? -1 : 0;
      any |= hit[i] != 0;
      if (open[i] == 0 || hit[i] != 0) continue;
      const Eigen::Vector3f behind =
          shading_.backdrop({rays.ray.dir_x[i], rays.ray.dir_y[i], rays.ray.dir_z[i]});
      sum.x.v[i] += left.v[i] * behind.x();
      sum.y.v[i] += left.v[i] * behind.y();
      sum.z.v[i] += left.v[i] * behind.z();
    }
    if (!any) break;
    shading_.surfaces(hit, rays, pixel_angle, surface);
    count += shading_.light(hit, rays, surface, light);
    for (unsigned i = 0; i < kLanes; ++i) {
      open[i] = 0;
      if (hit[i] == 0) continue;
      const bool last = surface.opacity.v[i] >= kOpaque || layer + 1 == kLayers;
      const float part = left.v[i] * (last ? 1.0F : surface.opacity.v[i]);
      sum.x.v[i] += part * light.x.v[i];
      sum.y.v[i] += part * light.y.v[i];
      sum.z.v[i] += part * light.z.v[i];
      if (last) continue;
      left.v[i] -= part;
      open[i] = -1;
      more = true;
      rays.ray.tnear[i] = rays.ray.tfar[i] * 1.00001F + 1e-5F;
      rays.ray.tfar[i] = static_cast<float>(to.view.far);
      rays.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
      rays.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
      ++count;
    }
    if (!more) break;
    scene_.intersect(open, rays, true);
  }
  const bool several = to.view.samples.size() > 1;
  const auto used =
      std::min<std::size_t>(kLanes, static_cast<std::size_t>(to.view.samples.front().width) -
                                        at % static_cast<std::size_t>(to.view.samples.front().width));
  for (std::size_t i = 0; i < used; ++i) {
    const float colour[3] = {sum.x.v[i], sum.y.v[i], sum.z.v[i]};
    for (std::size_t c = 0; c < 3; ++c) {
      if (several)
        to.sums[3 * (at + i) + c] += std::min(colour[c], 1.0F);
      else
        to.out.rgb[3 * (at + i) + c] = srgb_of_linear(colour[c]);
    }
  }
  return count;
}

void EmbreeCaster::cast(const RayBatch& batch, HitBatch& out) const {
  const std::size_t n = batch.size();
  out.distance.resize(n);
  out.item.resize(n);
  out.cosine.resize(n);
  out.brightness.resize(n);
  const bool one_origin = batch.origin_x.size() == 1;
  for (std::size_t at = 0; at < n; at += kLanes) {
    alignas(32) RTCRayHit8 rays;
    alignas(32) int valid[kLanes];
    for (unsigned i = 0; i < kLanes; ++i) {
      valid[i] = at + i < n ? -1 : 0;
      const std::size_t ray = std::min(at + i, n - 1), o = one_origin ? 0 : ray;
      prepare(rays, i, {batch.origin_x[o], batch.origin_y[o], batch.origin_z[o]},
              {batch.direction_x[ray], batch.direction_y[ray], batch.direction_z[ray]}, batch.near,
              batch.far);
    }
    scene_.intersect(valid, rays, true);
    for (unsigned i = 0; i < kLanes && at + i < n; ++i) {
      const bool hit = is_hit(rays, i);
      const unsigned item = rays.hit.geomID[i];
      out.distance[at + i] = hit ? rays.ray.tfar[i] : kInfinity;
      out.item[at + i] = hit ? static_cast<std::int32_t>(item) : -1;
      out.cosine[at + i] = out.brightness[at + i] = 0;
      if (!hit) continue;
      Eigen::Vector3f ng(rays.hit.Ng_x[i], rays.hit.Ng_y[i], rays.hit.Ng_z[i]);
      if (rays.hit.instID[0][i] != RTC_INVALID_GEOMETRY_ID) ng = scene_.rotation(item) * ng;
      const Eigen::Vector3f d(rays.ray.dir_x[i], rays.ray.dir_y[i], rays.ray.dir_z[i]);
      out.cosine[at + i] = std::min(1.0F, std::abs(ng.dot(d)) / (ng.norm() * d.norm()));
      out.brightness[at + i] = shading_.brightness(item, rays.hit.primID[i]);
    }
  }
  rays_ += n;
}

bool EmbreeCaster::sees(const Eigen::Vector3d& a_W, const Eigen::Vector3d& b_W) const {
  alignas(32) RTCRayHit8 rays;
  alignas(32) int valid[kLanes] = {-1, 0, 0, 0, 0, 0, 0, 0};
  for (unsigned i = 0; i < kLanes; ++i) prepare(rays, i, a_W.cast<float>(), (b_W - a_W).cast<float>(), 0, 1);
  scene_.occlude(valid, rays.ray, false);
  ++rays_;
  return rays.ray.tfar[0] >= 0;
}

}  // namespace doppel::embree
