#include "doppel/robot/clearance/detail/cover_grid.h"

#include <algorithm>
#include <cmath>

namespace doppel {
namespace {

using Eigen::Vector3d;

constexpr int kMaxSide = 160, kSplitCells = 4;
constexpr float kVeryDeep = 1e12F;

// The squared distances of a line's points from the nearest ones of `values`, which have distances of their
// own. Source: Felzenszwalb and Huttenlocher, "Distance Transforms of Sampled Functions", 2012.
void transform_line(std::vector<float>& values, std::vector<int>& parabola, std::vector<float>& begins,
                    std::vector<float>& out) {
  const int n = static_cast<int>(values.size());
  const auto value = [&](int i) { return values[static_cast<std::size_t>(i)]; };
  int last = 0;
  parabola[0] = 0;
  begins[0] = -kVeryDeep;
  for (int q = 1; q < n; ++q) {
    float crossing = 0;
    for (;; --last) {
      const int p = parabola[static_cast<std::size_t>(last)];
      crossing = ((value(q) + static_cast<float>(q * q)) - (value(p) + static_cast<float>(p * p))) /
                 static_cast<float>(2 * (q - p));
      if (last == 0 || crossing > begins[static_cast<std::size_t>(last)]) break;
    }
    if (crossing <= begins[static_cast<std::size_t>(last)]) {
      parabola[0] = q;
      continue;
    }
    ++last;
    parabola[static_cast<std::size_t>(last)] = q;
    begins[static_cast<std::size_t>(last)] = crossing;
  }
  int k = 0;
  for (int q = 0; q < n; ++q) {
    while (k < last && begins[static_cast<std::size_t>(k) + 1] < static_cast<float>(q)) ++k;
    const int p = parabola[static_cast<std::size_t>(k)];
    out[static_cast<std::size_t>(q)] = value(p) + static_cast<float>((q - p) * (q - p));
  }
  values.swap(out);
}

}  // namespace

CoverGrid::CoverGrid(const CoverGeometry& shape, double cells) {
  Eigen::AlignedBox3d box;
  for (const auto& t : shape.triangles) {
    for (const std::uint32_t corner : t) box.extend(shape.vertices[corner]);
  }
  const Vector3d sizes = box.sizes();
  const double longest = std::max(sizes.maxCoeff(), 1e-6);
  const Vector3d thick = sizes.cwiseMax(longest / kMaxSide);
  side_ = std::max(std::cbrt(thick.prod() / cells), longest / kMaxSide);
  std::size_t all = 1;
  for (int k = 0; k < 3; ++k) {
    counts_[static_cast<std::size_t>(k)] = static_cast<int>(std::ceil(sizes[k] / side_)) + 3;
    all *= static_cast<std::size_t>(counts_[static_cast<std::size_t>(k)]);
    origin_[k] = box.center()[k] - side_ * counts_[static_cast<std::size_t>(k)] / 2.0;
  }
  kinds_.assign(all, CellKind::inside);
  nearest_.assign(all, {});
  for (const auto& t : shape.triangles)
    mark({shape.vertices[t[0]], shape.vertices[t[1]], shape.vertices[t[2]]});
  flood();
  measure_depths();
  take_samples();
}

std::size_t CoverGrid::cell_of(const Index& i) const {
  return (static_cast<std::size_t>(i[2]) * static_cast<std::size_t>(counts_[1]) +
          static_cast<std::size_t>(i[1])) *
             static_cast<std::size_t>(counts_[0]) +
         static_cast<std::size_t>(i[0]);
}

CoverGrid::Index CoverGrid::index_of(const Vector3d& p) const {
  Index out{};
  for (std::size_t k = 0; k < 3; ++k) {
    const double cells = (p[static_cast<Eigen::Index>(k)] - origin_[static_cast<Eigen::Index>(k)]) / side_;
    out[k] = std::clamp(static_cast<int>(std::floor(cells)), 0, counts_[k] - 1);
  }
  return out;
}

Vector3d CoverGrid::centre(std::size_t cell) const {
  const auto nx = static_cast<std::size_t>(counts_[0]), ny = static_cast<std::size_t>(counts_[1]);
  const std::size_t row = cell / nx, layer = row / ny;
  const Vector3d cells(static_cast<double>(cell % nx), static_cast<double>(row % ny),
                       static_cast<double>(layer));
  return origin_ + (cells.array() + 0.5).matrix() * side_;
}

CellKind CoverGrid::kind(const Vector3d& p) const {
  const Vector3d far = origin_ + side_ * Vector3d(counts_[0], counts_[1], counts_[2]);
  if ((p - origin_).minCoeff() < 0 || (far - p).minCoeff() < 0) return CellKind::outside;
  return kinds_[cell_of(index_of(p))];
}

// Cells whose centre is within half a side of the triangle, along each axis from its nearest point: no step
// from a cell to the next one crosses the surface beside them.
void CoverGrid::mark(const Triangle3& t) {
  const Vector3d low = t.a.cwiseMin(t.b).cwiseMin(t.c), high = t.a.cwiseMax(t.b).cwiseMax(t.c);
  if ((high - low).maxCoeff() > kSplitCells * side_) {
    for (const Triangle3& part : halves(t)) mark(part);
    return;
  }
  const Vector3d half = Vector3d::Constant(side_ / 2);
  const Vector3d middle = origin_ + side_ * Vector3d(counts_[0], counts_[1], counts_[2]) / 2;
  const auto keep_nearest = [](Nearest& nearest, const Vector3d& place, const Vector3d& p) {
    const auto distance = static_cast<float>((p - place).norm());
    if (distance < nearest.distance) nearest = {distance, p.cast<float>()};
  };
  const Index first = index_of(low - half), last = index_of(high + half);
  for (int z = first[2]; z <= last[2]; ++z) {
    for (int y = first[1]; y <= last[1]; ++y) {
      for (int x = first[0]; x <= last[0]; ++x) {
        const std::size_t cell = cell_of({x, y, z});
        const Vector3d c = origin_ + side_ * Vector3d(x + 0.5, y + 0.5, z + 0.5);
        const Vector3d p = nearest_point(t, c);
        if ((p - c).cwiseAbs().maxCoeff() > side_ * 0.5000001) continue;
        kinds_[cell] = CellKind::surface;
        const Vector3d outward = (c - middle).cwiseSign() * (side_ / 2);
        keep_nearest(nearest_[cell][0], c, p);
        keep_nearest(nearest_[cell][1], c + outward, nearest_point(t, c + outward));
      }
    }
  }
}

void CoverGrid::flood() {
  std::vector<Index> waiting{{0, 0, 0}};
  kinds_[0] = CellKind::outside;
  while (!waiting.empty()) {
    const Index cell = waiting.back();
    waiting.pop_back();
    for (std::size_t k = 0; k < 3; ++k) {
      for (const int step : {-1, 1}) {
        Index next = cell;
        next[k] += step;
        if (next[k] < 0 || next[k] >= counts_[k]) continue;
        CellKind& kind = kinds_[cell_of(next)];
        if (kind != CellKind::inside) continue;
        kind = CellKind::outside;
        waiting.push_back(next);
      }
    }
  }
}

void CoverGrid::measure_depths() {
  depths_.resize(kinds_.size());
  for (std::size_t i = 0; i < kinds_.size(); ++i)
    depths_[i] = kinds_[i] == CellKind::outside ? 0.0F : kVeryDeep;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto n = static_cast<std::size_t>(counts_[axis]);
    const std::size_t step =
        axis == 0   ? 1
        : axis == 1 ? static_cast<std::size_t>(counts_[0])
                    : static_cast<std::size_t>(counts_[0]) * static_cast<std::size_t>(counts_[1]);
    std::vector<float> line(n), begins(n), out(n);
    std::vector<int> parabola(n);
    for (std::size_t start = 0; start < depths_.size(); ++start) {
      if (start / step % n != 0) continue;
      for (std::size_t i = 0; i < n; ++i) line[i] = depths_[start + i * step];
      transform_line(line, parabola, begins, out);
      for (std::size_t i = 0; i < n; ++i) depths_[start + i * step] = line[i];
    }
  }
}

bool CoverGrid::beside_outside(std::size_t cell) const {
  return depths_[cell] <= 3.0F;
}

void CoverGrid::take_samples() {
  for (std::size_t cell = 0; cell < kinds_.size(); ++cell) {
    if (kinds_[cell] != CellKind::surface || !beside_outside(cell)) continue;
    for (const Nearest& nearest : nearest_[cell]) samples_.push_back(nearest.point.cast<double>());
  }
}

std::vector<std::size_t> CoverGrid::deepest_cells(int block) const {
  std::vector<std::size_t> out;
  Index corner{};
  for (corner[2] = 0; corner[2] < counts_[2]; corner[2] += block) {
    for (corner[1] = 0; corner[1] < counts_[1]; corner[1] += block) {
      for (corner[0] = 0; corner[0] < counts_[0]; corner[0] += block) {
        std::size_t deepest = 0;
        for (int z = corner[2]; z < std::min(corner[2] + block, counts_[2]); ++z) {
          for (int y = corner[1]; y < std::min(corner[1] + block, counts_[1]); ++y) {
            for (int x = corner[0]; x < std::min(corner[0] + block, counts_[0]); ++x) {
              const std::size_t cell = cell_of({x, y, z});
              if (depths_[cell] > depths_[deepest]) deepest = cell;
            }
          }
        }
        if (depths_[deepest] > 0) out.push_back(deepest);
      }
    }
  }
  return out;
}

}  // namespace doppel
