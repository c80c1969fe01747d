#include "doppel/sensors/render/embree/embree_caster.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

namespace doppel::embree {
namespace {

constexpr int kLayers = 6;  // of transparent surfaces, one behind the other
constexpr float kOpaque = 0.995F;

// Calls `each` for the tiles of a grid.
template <std::uint32_t kWidth, class Each>
void for_each_tile(std::uint32_t columns, std::uint32_t rows, Each each) {
  constexpr std::uint32_t kHeight = kLanes / kWidth;
  Tile tile;
  tile.line = kWidth == kLanes;
  for (std::uint32_t y = 0; y < rows; y += kHeight)
    for (std::uint32_t x = 0; x < columns; x += kWidth) {
      tile.whole = x + kWidth <= columns && y + kHeight <= rows;
      tile.inside = ~Ints{};
      for (std::uint32_t i = 0; i < kLanes; ++i) tile.at[i] = (y + i / kWidth) * columns + x + i % kWidth;
      for (std::uint32_t i = 0; !tile.whole && i < kLanes; ++i) {
        const std::uint32_t u = x + i % kWidth, v = y + i / kWidth;
        tile.inside[i] = u < columns && v < rows ? -1 : 0;
        tile.at[i] = std::min(v, rows - 1) * columns + std::min(u, columns - 1);
      }
      each(tile);
    }
}

Floats gathered(const std::vector<float>& values, const Tile& tile) {
  float out[kLanes];
  if (tile.whole && tile.line) return load(&values[tile.at[0]]);
  if (tile.whole)
    for (int i = 0; i < kLanes; i += kTileWidth)
      std::memcpy(out + i, &values[tile.at[i]], kTileWidth * sizeof(float));
  else
    for (int i = 0; i < kLanes; ++i) out[i] = values[tile.at[i]];
  return load(out);
}

// The lanes of a tile into their places of a grid; those outside of it into none.
template <class Value, class Lanes>
void scatter(const Lanes& lanes, const Tile& tile, std::vector<Value>& values) {
  static_assert(sizeof lanes == kLanes * sizeof(Value));
  Value from[kLanes];
  std::memcpy(from, &lanes, sizeof from);
  if (tile.whole)
    for (int i = 0; i < kLanes; i += kTileWidth)
      std::memcpy(&values[tile.at[i]], from + i, kTileWidth * sizeof(Value));
  else
    for (int i = 0; i < kLanes; ++i)
      if (tile.inside[i] != 0) values[tile.at[i]] = from[i];
}

void clear_hits(RayHitPacket& rays) {
  store(~Ints{}, rays.hit.geomID);  // RTC_INVALID_GEOMETRY_ID
  store(~Ints{}, rays.hit.instID[0]);
}

// With what stays for all tiles of a scan.
struct Packet : RayHitPacket {
  Packet() {
    store(Floats{}, ray.time);
    store(~Ints{}, ray.mask);
    store(Ints{}, ray.id);
    store(Ints{}, ray.flags);
    for (float* unset : {hit.Ng_x, hit.Ng_y, hit.Ng_z, hit.u, hit.v})
      store(Floats{}, unset);  // lanes without a hit are computed, too: not with slow denormal numbers
    store(Ints{}, hit.primID);
  }
};

void aim(const Floats3& from, const Floats3& along, float near, float far, RayHitPacket& rays) {
  store(from.x, rays.ray.org_x);
  store(from.y, rays.ray.org_y);
  store(from.z, rays.ray.org_z);
  store(along.x, rays.ray.dir_x);
  store(along.y, rays.ray.dir_y);
  store(along.z, rays.ray.dir_z);
  store(broadcast(near), rays.ray.tnear);
  store(broadcast(far), rays.ray.tfar);
  clear_hits(rays);
}

Ints hits(const RayHitPacket& rays) {
  return load(rays.hit.geomID) != -1;
}

float longest(const PixelRays& pixels) {
  float squares = 0;
  for (std::size_t i = 0; i < pixels.x.size(); ++i)
    squares =
        std::max(squares, pixels.x[i] * pixels.x[i] + pixels.y[i] * pixels.y[i] + pixels.z[i] * pixels.z[i]);
  return std::sqrt(squares);
}

}  // namespace

struct EmbreeCaster::Target {
  const CameraView& view;
  CameraPicture& out;
  std::vector<float>& sums;  // linear colour of all samples so far, if there are several
  Eigen::Matrix3f R_WC;
  Floats3 p_WC;
  bool first = true;  // of several samples
  bool near_surfaces = false;

  // The rays of a tile and those of its lanes that see something.
  Ints rays(const PixelRays& pixels, const Tile& tile, float near, float far, RayHitPacket& to) const {
    const Floats x = gathered(pixels.x, tile), y = gathered(pixels.y, tile), z = gathered(pixels.z, tile);
    aim(p_WC, turned(R_WC, {x, y, z}), near, far, to);
    return tile.inside & ((x != 0.0F) | (y != 0.0F) | (z != 0.0F));
  }
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
  const Eigen::Vector3f p_WC = view.X_WC.translation().cast<float>();
  Target target{view, out, sums, view.X_WC.linear().cast<float>(), broadcast(p_WC)};
  target.near_surfaces = view.depth && view.near > 0 &&
                         scene_.may_be_near(view.X_WC.translation(),
                                            view.near * static_cast<double>(longest(centres)), view.own_body);
  std::uint64_t count = 0;
  for (std::size_t sample = 0; sample < (view.colour ? view.samples.size() : 1); ++sample) {
    target.first = sample == 0;
    for_each_tile<kTileWidth>(
        static_cast<std::uint32_t>(centres.width), static_cast<std::uint32_t>(centres.height),
        [&](const Tile& tile) { count += render_tile(target, view.samples[sample], tile); });
  }
  if (several) {
    const float share = 1.0F / static_cast<float>(view.samples.size());
    for (std::size_t i = 0; i < sums.size(); ++i) out.rgb[i] = srgb_of_linear(sums[i] * share);
  }
  rays_ += count;
}

Ints EmbreeCaster::labels(Ints hit, const RayHitPacket& rays) const {
  Ints out{};
  for (unsigned left = bits_of(hit); left != 0; left &= left - 1) {
    const int lane = std::countr_zero(left);
    out[lane] = static_cast<std::int32_t>(scene_.scene().items[rays.hit.geomID[lane]].label);
  }
  return out;
}

std::uint64_t EmbreeCaster::render_tile(const Target& to, const PixelRays& pixels, const Tile& tile) const {
  alignas(64) Packet rays;
  const Ints active =
      to.rays(pixels, tile, static_cast<float>(to.view.near), static_cast<float>(to.view.far), rays);
  scene_.intersect(active, rays);
  if (to.first && (to.view.depth || to.view.labels)) {
    const Ints hit = hits(rays);
    if (to.view.depth) scatter(hit ? load(rays.ray.tfar) : broadcast(kInfinity), tile, to.out.depth);
    if (to.view.labels) scatter(labels(hit, rays), tile, to.out.labels);
  }
  std::uint64_t cast = count(tile.inside);
  if (to.first && to.near_surfaces) cast += mark_near(to, pixels, tile);
  if (to.view.colour) cast += add_colours(to, tile, rays, pixels.pixel_angle);
  return cast;
}

std::uint64_t EmbreeCaster::mark_near(const Target& to, const PixelRays& pixels, const Tile& tile) const {
  alignas(64) Packet rays;
  scene_.intersect(to.rays(pixels, tile, 0, static_cast<float>(to.view.near), rays), rays);
  const Ints hit = hits(rays) & tile.inside;
  for (int i = 0; i < kLanes; ++i)
    if (hit[i] != 0 && scene_.scene().items[rays.hit.geomID[i]].body != to.view.own_body)
      to.out.depth[tile.at[i]] = -kInfinity;
  return count(tile.inside);
}

std::uint64_t EmbreeCaster::add_colours(const Target& to, const Tile& tile, RayHitPacket& rays,
                                        float pixel_angle) const {
  Floats3 sum{};
  Floats left = broadcast(1.0F);  // of what is behind the surfaces so far, the part that is seen
  // A pixel that the lens does not reach has no direction, and stays black.
  Ints open = tile.inside & ((load(rays.ray.dir_x) != 0.0F) | (load(rays.ray.dir_y) != 0.0F) |
                             (load(rays.ray.dir_z) != 0.0F));
  std::uint64_t cast = 0;
  SurfacePacket surface;
  for (int layer = 0; layer < kLayers; ++layer) {
    const Ints hit = open & hits(rays), missed = open & ~hit;
    if (any(missed)) {
      const Floats3 behind =
          shading_.backdrop({load(rays.ray.dir_x), load(rays.ray.dir_y), load(rays.ray.dir_z)});
      sum = select(missed, sum + behind * left, sum);
    }
    if (!any(hit)) break;
    shading_.surfaces(hit, rays, pixel_angle, surface);
    const Floats3 light = shading_.light(hit, rays, surface, cast);
    const Ints last = layer + 1 == kLayers ? ~Ints{} : surface.opacity >= kOpaque;
    const Floats part = left * (last ? broadcast(1.0F) : surface.opacity);
    sum = select(hit, sum + light * part, sum);
    open = hit & ~last;
    if (!any(open)) break;
    left -= part;
    cast += count(open);
    store(load(rays.ray.tfar) * 1.00001F + 1e-5F, rays.ray.tnear);
    store(broadcast(static_cast<float>(to.view.far)), rays.ray.tfar);
    clear_hits(rays);
    scene_.intersect(open, rays);
  }
  put_colours(to, tile, sum);
  return cast;
}

void EmbreeCaster::put_colours(const Target& to, const Tile& tile, const Floats3& colours) {
  const bool several = to.view.samples.size() > 1;
  const auto& srgb = srgb_of_root();
  alignas(64) float limited[3][kLanes];
  alignas(64) unsigned step[3][kLanes];
  int channel = 0;
  for (const Floats value : {colours.x, colours.y, colours.z}) {
    const Floats within = smaller(larger(value, Floats{}), broadcast(1.0F));
    store(within, limited[channel]);
    store(__builtin_convertvector(root(within) * kSrgbSteps + 0.5F, Ints), step[channel++]);
  }
  for (int i = 0; i < kLanes; ++i) {
    if (tile.inside[i] == 0) continue;
    const std::size_t at = 3 * std::size_t{tile.at[i]};
    for (std::size_t c = 0; c < 3; ++c) {
      if (several)
        to.sums[at + c] += limited[c][i];
      else
        to.out.rgb[at + c] = srgb[step[c][i]];
    }
  }
}

void EmbreeCaster::cast(const RayBatch& batch, HitBatch& out) const {
  const std::size_t n = batch.size();
  out.distance.resize(n);
  out.item.resize(n);
  out.cosine.resize(n);
  out.brightness.resize(n);
  if (n == 0) return;
  const bool one_origin = batch.origin_x.size() == 1;
  const Floats3 common{broadcast(batch.origin_x[0]), broadcast(batch.origin_y[0]),
                       broadcast(batch.origin_z[0])};
  const bool grid = batch.columns > 0 && n % batch.columns == 0;
  const auto columns = static_cast<std::uint32_t>(grid ? batch.columns : n);
  alignas(64) Packet rays;
  const auto cast_tile = [&](const Tile& tile) {
    const Floats3 from = one_origin ? common
                                    : Floats3{gathered(batch.origin_x, tile), gathered(batch.origin_y, tile),
                                              gathered(batch.origin_z, tile)};
    aim(from,
        {gathered(batch.direction_x, tile), gathered(batch.direction_y, tile),
         gathered(batch.direction_z, tile)},
        batch.near, batch.far, rays);
    scene_.intersect(tile.inside, rays);
    put_hits(tile, rays, out);
  };
  // Rings of a scan are further from each other than columns, so that its tiles have two rows.
  if (const auto rows = static_cast<std::uint32_t>(n) / columns; rows == 1)
    for_each_tile<kLanes>(columns, rows, cast_tile);
  else
    for_each_tile<kLanes / 2>(columns, rows, cast_tile);
  rays_ += n;
}

void EmbreeCaster::put_hits(const Tile& tile, const RayHitPacket& rays, HitBatch& out) const {
  const Ints hit = hits(rays);
  const Floats3 ng = shading_.triangle_normals(hit, rays),
                d{load(rays.ray.dir_x), load(rays.ray.dir_y), load(rays.ray.dir_z)};
  const Floats along = dot(ng, d), cosine = larger(along, -along) / root(dot(ng, ng) * dot(d, d));
  scatter(hit ? load(rays.ray.tfar) : broadcast(kInfinity), tile, out.distance);
  scatter(hit ? load(rays.hit.geomID) : ~Ints{}, tile, out.item);
  scatter(hit ? smaller(cosine, broadcast(1.0F)) : Floats{}, tile, out.cosine);
  scatter(any(hit) ? shading_.brightness(hit, rays) : Floats{}, tile, out.brightness);
}

bool EmbreeCaster::sees(const Eigen::Vector3d& a_W, const Eigen::Vector3d& b_W) const {
  RTCRay ray{};
  const Eigen::Vector3f from = a_W.cast<float>(), along = (b_W - a_W).cast<float>();
  ray.org_x = from.x();
  ray.org_y = from.y();
  ray.org_z = from.z();
  ray.dir_x = along.x();
  ray.dir_y = along.y();
  ray.dir_z = along.z();
  ray.tfar = 1;
  ray.mask = ~0U;
  ++rays_;
  return !scene_.occluded(ray);
}

}  // namespace doppel::embree
