#include "doppel/description/overlay/detail/convex_parts.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "doppel/description/meshes/convex_hull.h"

namespace doppel::overlay_detail {
namespace {

constexpr int kEvenCuts = 7, kFlatCuts = 4;  // candidates per axis
constexpr double kConvexEnough = 0.01;       // concavity
constexpr double kSamePlace = 1e-8;          // m: end points of one outline
constexpr std::size_t kSamples = 400;        // faces for the concavity

struct Cut {
  int axis = 0;
  double at = 0;
};

struct Part {
  std::vector<Triangle> surface;
  double volume = 0;  // of the hull
  Cut best;
  double gain = 0;  // m^3 that the best cut saves
};

std::vector<Eigen::Vector3f> points_of(const std::vector<Triangle>& surface) {
  std::vector<Eigen::Vector3f> out;
  out.reserve(surface.size() * 3);
  for (const Triangle& t : surface) {
    for (const Eigen::Vector3d& p : t) out.push_back(p.cast<float>());
  }
  return out;
}

double hull_volume(const std::vector<Triangle>& surface) {
  return convex_hull(points_of(surface)).volume;
}

using Segment = std::pair<Eigen::Vector3d, Eigen::Vector3d>;
using Cell = std::array<long, 3>;

Cell cell_of(const Eigen::Vector3d& p) {
  return {std::lround(p.x() / kSamePlace), std::lround(p.y() / kSamePlace), std::lround(p.z() / kSamePlace)};
}

// Closes the cut: every outline by a fan from one of its own points. A fan covers at least the outline's
// inside, and nothing outside of its hull.
void close(const std::vector<Segment>& outline, std::vector<Triangle>& out) {
  std::map<Cell, Cell> above;  // union-find over end points
  const auto top = [&](Cell cell) {
    for (auto found = above.find(cell); found != above.end(); found = above.find(cell)) cell = found->second;
    return cell;
  };
  for (const auto& [p, q] : outline) {
    const Cell a = top(cell_of(p)), b = top(cell_of(q));
    if (a != b) above[a] = b;
  }
  std::map<Cell, Eigen::Vector3d> hubs;
  for (const auto& [p, q] : outline) {
    const Eigen::Vector3d hub = hubs.emplace(top(cell_of(p)), p).first->second;
    out.push_back({hub, p, q});
  }
}

// The part on one side (sign +1: above) of the plane, closed again.
std::vector<Triangle> clipped(const std::vector<Triangle>& surface, const Cut& cut, double sign) {
  std::vector<Triangle> out;
  std::vector<Segment> outline;
  const auto height = [&](const Eigen::Vector3d& p) { return sign * (p[cut.axis] - cut.at); };
  for (const Triangle& t : surface) {
    std::vector<Eigen::Vector3d> kept, on_plane;
    // A face in the plane belongs to the other side.
    if (std::none_of(t.begin(), t.end(), [&](const auto& p) { return height(p) > 0; })) continue;
    for (std::size_t i = 0; i < 3; ++i) {
      const Eigen::Vector3d &a = t[i], &b = t[(i + 1) % 3];
      const double da = height(a), db = height(b);
      if (da >= 0) kept.push_back(a);
      if (da == 0) on_plane.push_back(a);
      if ((da > 0 && db < 0) || (da < 0 && db > 0)) {
        kept.push_back(a + (b - a) * (da / (da - db)));
        kept.back()[cut.axis] = cut.at;
        on_plane.push_back(kept.back());
      }
    }
    for (std::size_t i = 2; i < kept.size(); ++i) out.push_back({kept[0], kept[i - 1], kept[i]});
    if (on_plane.size() == 2) outline.emplace_back(on_plane[0], on_plane[1]);
  }
  close(outline, out);
  return out;
}

// Evenly through the part, and along its largest flat faces, where the corners of machined parts are.
std::vector<double> candidates(const std::vector<Triangle>& surface, int axis) {
  Eigen::AlignedBox3d box;
  std::map<double, double> faces;  // place -> area
  for (const Triangle& t : surface) {
    for (const Eigen::Vector3d& p : t) box.extend(p);
    const Eigen::Vector3d across = (t[1] - t[0]).cross(t[2] - t[0]);
    if (std::abs(across[axis]) > 0.999 * across.norm()) faces[t[0][axis]] += across.norm();
  }
  std::vector<double> out;
  const double lower = box.min()[axis], size = box.sizes()[axis];
  for (int i = 1; i <= kEvenCuts; ++i) out.push_back(lower + size * i / (kEvenCuts + 1));
  std::vector<std::pair<double, double>> by_area;
  for (const auto& [place, area] : faces) {
    if (place > lower + 0.01 * size && place < lower + 0.99 * size) by_area.emplace_back(-area, place);
  }
  std::sort(by_area.begin(), by_area.end());
  for (std::size_t i = 0; i < by_area.size() && i < kFlatCuts; ++i) out.push_back(by_area[i].second);
  return out;
}

// The largest depth of the surface below its hull, relative to its size. Measured at faces, not at corners,
// because the corners of a hole through a plate are on the hull.
double concavity(const std::vector<Triangle>& surface) {
  const std::vector<Eigen::Vector3f> points = points_of(surface);
  const ConvexHull hull = convex_hull(points);
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& p : points) box.extend(p);
  const std::size_t step = surface.size() / kSamples + 1;
  double deepest = 0;
  for (std::size_t i = 0; i < surface.size(); i += step) {
    const Eigen::Vector3d middle = (surface[i][0] + surface[i][1] + surface[i][2]) / 3;
    double depth = std::numeric_limits<double>::max();
    for (const auto& [a, b, c] : hull.triangles) {
      const Eigen::Vector3d normal =
          (points[b] - points[a]).cross(points[c] - points[a]).cast<double>().normalized();
      depth = std::min(depth, normal.dot(points[a].cast<double>() - middle));
    }
    if (!hull.triangles.empty()) deepest = std::max(deepest, depth);
  }
  return box.isEmpty() || box.diagonal().norm() <= 0 ? 0.0 : deepest / box.diagonal().norm();
}

// The part with its best cut, if a single cut reduces the volume.
Part searched(std::vector<Triangle> surface) {
  Part part;
  part.surface = std::move(surface);
  part.volume = hull_volume(part.surface);
  if (concavity(part.surface) < kConvexEnough) return part;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double at : candidates(part.surface, axis)) {
      const Cut cut{axis, at};
      const double halves =
          hull_volume(clipped(part.surface, cut, 1)) + hull_volume(clipped(part.surface, cut, -1));
      if (part.volume - halves <= part.gain) continue;
      part.gain = part.volume - halves;
      part.best = cut;
    }
  }
  return part;
}

// For a ring the first cut gains nothing, but the following ones do: the cut through its middle is rated by
// the gain of the next ones.
Part examined(std::vector<Triangle> surface, double least) {
  Part part = searched(std::move(surface));
  if (part.gain > least || concavity(part.surface) < kConvexEnough) return part;
  Eigen::AlignedBox3d box;
  for (const Triangle& t : part.surface) {
    for (const Eigen::Vector3d& p : t) box.extend(p);
  }
  for (int axis = 0; axis < 3; ++axis) {
    const Cut cut{axis, box.center()[axis]};
    const Part above = searched(clipped(part.surface, cut, 1)),
               below = searched(clipped(part.surface, cut, -1));
    const double gain = part.volume - (above.volume - above.gain) - (below.volume - below.gain);
    if (gain <= part.gain) continue;
    part.gain = gain;
    part.best = cut;
  }
  return part;
}

}  // namespace

std::vector<std::vector<Eigen::Vector3d>> convex_parts(const std::vector<Triangle>& surface) {
  const double least = kMinGain * hull_volume(surface);
  std::vector<Part> parts{examined(surface, least)};
  while (parts.size() < kMaxParts) {
    const auto widest = std::max_element(parts.begin(), parts.end(),
                                         [](const Part& a, const Part& b) { return a.gain < b.gain; });
    if (widest->gain <= least) break;
    const Part part = std::move(*widest);
    *widest = examined(clipped(part.surface, part.best, 1), least);
    parts.push_back(examined(clipped(part.surface, part.best, -1), least));
  }
  std::vector<std::vector<Eigen::Vector3d>> out;
  for (const Part& part : parts) {
    const std::vector<Eigen::Vector3f> points = points_of(part.surface);
    const ConvexHull hull = convex_hull(points);
    if (hull.triangles.empty()) continue;
    auto& corners = out.emplace_back();
    for (const std::uint32_t i : hull.vertices) corners.push_back(points[i].cast<double>());
  }
  return out;
}

}  // namespace doppel::overlay_detail
