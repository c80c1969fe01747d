#include "doppel/robot/clearance/sphere_cover.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

#include "doppel/description/meshes/convex_hull.h"
#include "doppel/robot/clearance/detail/cover_grid.h"

namespace doppel {
namespace {

using Eigen::Vector3d;

// The size of a search for one sphere of the fine level, within the limits: cells of the grid, samples and
// balls.
constexpr int kCellsEach = 3000, kSamplesEach = 120, kBallsEach = 40;
constexpr int kMinSearchSpheres = 8, kMaxSearchSpheres = 50;
constexpr double kWiderMargin = 1.5;  // between two trials
constexpr int kNarrowingSteps = 3;
constexpr int kDirections = 256;
// The exact test of the prover needs this beyond touching.
constexpr double kOverlap = 1e-9;  // m

template <class T>
void thin_out(std::vector<T>& values, std::size_t most) {
  if (values.size() <= most) return;
  for (std::size_t i = 0; i < most; ++i) values[i] = values[i * values.size() / most];
  values.resize(most);
}

// Source of the centre: Badoiu and Clarkson, "Smaller core-sets for balls", 2003.
CoverSphere bounding_sphere(const std::vector<Vector3d>& samples, const std::vector<Vector3d>& points) {
  CoverSphere out;
  out.centre = samples.empty() ? points[0] : samples[0];
  const auto& around = samples.empty() ? points : samples;
  for (int step = 1; step < 300; ++step) {
    const auto farthest = std::ranges::max_element(
        around, {}, [&](const Vector3d& p) { return (p - out.centre).squaredNorm(); });
    out.centre += (*farthest - out.centre) / (step + 1.0);
  }
  for (const Vector3d& p : points) out.radius = std::max(out.radius, (p - out.centre).norm());
  out.radius += kOverlap;
  return out;
}

// The size for kMinSearchSpheres to kMaxSearchSpheres spheres.
std::size_t effort(int each, const CoverBudget& budget) {
  return static_cast<std::size_t>(each * std::clamp(budget.fine, kMinSearchSpheres, kMaxSearchSpheres));
}

// Balls and the samples that they cover, as bits.
class BallSearch {
 public:
  BallSearch(const CoverGrid& grid, std::vector<Vector3d> samples, std::size_t most_balls)
      : samples_(std::move(samples)) {
    std::vector<std::size_t> cells;
    for (int block = 1; block < 20; ++block) {
      cells = grid.deepest_cells(block);
      if (cells.size() <= most_balls) break;
    }
    thin_out(cells, most_balls);
    Eigen::Array3Xf points(3, static_cast<Eigen::Index>(samples_.size()));
    for (std::size_t i = 0; i < samples_.size(); ++i)
      points.col(static_cast<Eigen::Index>(i)) = samples_[i].cast<float>();
    const Eigen::ArrayXf x = points.row(0), y = points.row(1), z = points.row(2);
    squared_.resize(x.size(), static_cast<Eigen::Index>(cells.size()));
    for (std::size_t i = 0; i < cells.size(); ++i) {
      centres_.push_back(grid.centre(cells[i]));
      const Eigen::Vector3f c = centres_.back().cast<float>();
      const auto column = static_cast<Eigen::Index>(i);
      squared_.col(column) = (x - c.x()).square() + (y - c.y()).square() + (z - c.z()).square();
      clearances_.push_back(std::sqrt(static_cast<double>(squared_.col(column).minCoeff())));
    }
  }

  // Balls that are `margin` (m) larger than the shape has room for, which cover all samples; empty: more than
  // `most` would do so.
  [[nodiscard]] std::vector<CoverSphere> choose(double margin, std::size_t most) {
    words_ = (samples_.size() + 63) / 64;
    covered_.assign(words_ * centres_.size(), 0);
    std::vector<std::size_t> gain(centres_.size());
    for (std::size_t i = 0; i < centres_.size(); ++i) gain[i] = cover(i, margin);
    std::vector<std::uint64_t> done(words_, 0);
    std::size_t left = samples_.size();
    std::vector<CoverSphere> out;
    // Gains only shrink, so that a ball whose gain is up to date and the largest is the best one.
    std::vector<std::size_t> queue(centres_.size());
    std::iota(queue.begin(), queue.end(), std::size_t{0});
    const auto less = [&](std::size_t a, std::size_t b) {
      return gain[a] != gain[b] ? gain[a] < gain[b] : a > b;
    };
    std::ranges::make_heap(queue, less);
    while (left > 0) {
      std::ranges::pop_heap(queue, less);
      const std::size_t best = queue.back();
      const std::size_t now = uncovered(best, done);
      if (gain[best] == 0 || (now == gain[best] && out.size() == most)) return {};
      if (now < gain[best]) {
        gain[best] = now;
        std::ranges::push_heap(queue, less);
        continue;
      }
      queue.pop_back();
      out.push_back({centres_[best], clearances_[best] + margin});
      for (std::size_t w = 0; w < words_; ++w) done[w] |= covered_[best * words_ + w];
      left -= now;
    }
    return out;
  }

 private:
  std::size_t cover(std::size_t ball, double margin) {
    const double radius = clearances_[ball] + margin;
    const auto limit = static_cast<float>(radius * radius);
    const auto column = squared_.col(static_cast<Eigen::Index>(ball));
    std::size_t count = 0;
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      const std::uint64_t bit = column[static_cast<Eigen::Index>(i)] <= limit ? 1 : 0;
      covered_[ball * words_ + i / 64] |= bit << i % 64;
      count += bit;
    }
    return count;
  }
  [[nodiscard]] std::size_t uncovered(std::size_t ball, const std::vector<std::uint64_t>& done) const {
    std::size_t count = 0;
    for (std::size_t w = 0; w < words_; ++w)
      count += static_cast<std::size_t>(std::popcount(covered_[ball * words_ + w] & ~done[w]));
    return count;
  }

  std::vector<Vector3d> samples_, centres_;
  std::vector<double> clearances_;  // m, of the centres from the samples
  Eigen::ArrayXXf squared_;         // [samples, balls] m^2
  std::size_t words_ = 0;
  std::vector<std::uint64_t> covered_;
};

// Enlarges spheres until they contain every triangle.
class Enlarger {
 public:
  Enlarger(std::vector<CoverSphere>& spheres, double least) : spheres_(spheres), least_(least) {}

  void contain(const Triangle3& t) {
    if (reach(last_, t) <= spheres_[last_].radius) return;
    std::size_t best = 0;
    double more = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < spheres_.size(); ++i) {
      const double needed = reach(i, t) - spheres_[i].radius;
      if (needed < more) {
        more = needed;
        best = i;
      }
      if (needed <= 0) break;
    }
    last_ = best;
    if (more <= 0) return;
    if (longest_side(t) < least_) {
      spheres_[best].radius += more + kOverlap;
      return;
    }
    for (const Triangle3& part : halves(t)) contain(part);
  }

 private:
  [[nodiscard]] double reach(std::size_t i, const Triangle3& t) const {
    const Vector3d& c = spheres_[i].centre;
    return std::sqrt(std::max({(t.a - c).squaredNorm(), (t.b - c).squaredNorm(), (t.c - c).squaredNorm()}));
  }

  std::vector<CoverSphere>& spheres_;
  double least_;  // m, of a part that is not split any more
  std::size_t last_ = 0;
};

bool cell_covered(const std::vector<CoverSphere>& spheres, const Vector3d& centre, double side, int splits) {
  const double reach = side * std::sqrt(3.0) / 2;
  for (const CoverSphere& s : spheres) {
    if ((s.centre - centre).norm() + reach <= s.radius) return true;
  }
  if (splits == 0) return false;
  for (int i = 0; i < 8; ++i) {
    const Vector3d corner(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
    if (!cell_covered(spheres, centre + corner * (side / 4), side / 2, splits - 1)) return false;
  }
  return true;
}

// Adds spheres, the deepest first, until every cell inside is in one.
void fill(std::vector<CoverSphere>& spheres, const CoverGrid& grid) {
  std::vector<std::size_t> empty;
  for (std::size_t cell = 0; cell < grid.size(); ++cell) {
    if (grid.kind(cell) == CellKind::inside && !cell_covered(spheres, grid.centre(cell), grid.side(), 2))
      empty.push_back(cell);
  }
  std::ranges::stable_sort(empty,
                           [&](std::size_t a, std::size_t b) { return grid.depth(a) > grid.depth(b); });
  for (const std::size_t cell : empty) {
    if (cell_covered(spheres, grid.centre(cell), grid.side(), 2)) continue;
    spheres.push_back({grid.centre(cell), std::max(grid.depth(cell), grid.side())});
  }
}

class CoverMaker {
 public:
  CoverMaker(const CoverGeometry& shape, const CoverBudget& budget)
      : grid_(shape, static_cast<double>(effort(kCellsEach, budget))) {
    for (const auto& t : shape.triangles)
      triangles_.push_back({shape.vertices[t[0]], shape.vertices[t[1]], shape.vertices[t[2]]});
    std::vector<Vector3d> samples = grid_.samples();
    thin_out(samples, effort(kSamplesEach, budget));
    std::vector<Vector3d> corners;
    for (const auto& t : shape.triangles) {
      for (const std::uint32_t corner : t) corners.push_back(shape.vertices[corner]);
    }
    out_.closed = shape.closed;
    out_.levels[0] = {bounding_sphere(samples, corners)};
    BallSearch search(grid_, std::move(samples), effort(kBallsEach, budget));
    // The coarse level last: its margin is not less than that of the fine one.
    double margin = kFineCover / 2;
    out_.levels[2] = spheres(search, budget.fine, margin, margin);
    out_.levels[1] = spheres(search, budget.coarse, margin, margin);
  }

  SphereCover take() {
    const TriangleTree tree(std::move(triangles_));
    const std::vector<Vector3d> directions = even_directions(kDirections);
    for (std::size_t level = 0; level < 3; ++level) {
      for (const CoverSphere& s : out_.levels[level]) {
        for (const Vector3d& d : directions) {
          const Vector3d p = s.centre + s.radius * d;
          if (grid_.kind(p) == CellKind::outside && out_.excess[level] < farthest(p))
            out_.excess[level] = std::max(out_.excess[level], tree.distance(p));
        }
      }
    }
    return std::move(out_);
  }

 private:
  // An upper bound of the distance of p from the shape.
  [[nodiscard]] double farthest(const Vector3d& p) const {
    return (p - out_.levels[0][0].centre).norm() + out_.levels[0][0].radius;
  }

  // The last margin is that of the result.
  std::vector<CoverSphere> spheres(BallSearch& search, int most, double first, double& margin) {
    std::vector<CoverSphere> out;
    const double last = 2 * out_.levels[0][0].radius;
    const auto budget = static_cast<std::size_t>(std::max(most, 1));
    margin = first;
    while (out.empty() && margin < last) {
      out = search.choose(margin, budget);
      margin *= kWiderMargin;
    }
    if (out.empty()) return out_.levels[0];
    // Between the last two trials.
    margin /= kWiderMargin;
    double low = margin / kWiderMargin;
    for (int step = 0; step < kNarrowingSteps && low >= first; ++step) {
      const double middle = std::sqrt(low * margin);
      auto tighter = search.choose(middle, budget);
      (tighter.empty() ? low : margin) = middle;
      if (!tighter.empty()) out = std::move(tighter);
    }
    Enlarger enlarger(out, std::max(grid_.side() / 4, 4 * kProofLength));
    for (const Triangle3& t : triangles_) enlarger.contain(t);
    fill(out, grid_);
    return out;
  }

  CoverGrid grid_;
  std::vector<Triangle3> triangles_;
  SphereCover out_;
};

}  // namespace

SphereCover make_cover(const CoverGeometry& shape, const CoverBudget& budget) {
  if (shape.ball) {
    SphereCover out;
    out.levels.fill({*shape.ball});
    out.closed = true;
    return out;
  }
  if (shape.triangles.empty()) return {};
  return CoverMaker(shape, budget).take();
}

}  // namespace doppel
