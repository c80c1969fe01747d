#include "doppel/physics/contract/detail/terrain_contacts.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace doppel {
namespace {

constexpr double kDeepest = 1.0;  // m: what is deeper is below the terrain
constexpr double kRidge = 1e-9;   // of the difference of two normals: less is a plane
constexpr int kBisections = 30;
constexpr int kMaxCandidates = 128;

struct Cell {
  int column = 0, row = 0;
};

class TerrainContactFinder {
 public:
  TerrainContactFinder(const TerrainView& field, const ConvexOnTerrain& shape, double margin)
      : field_(field), shape_(shape), margin_(margin) {}

  TerrainContacts find() {
    if (!choose_range()) return {};
    for (int i = 0; i < shape_.corners(); ++i) add_corner(shape_.corner(i));
    for (int row = first_.row; row <= last_.row; ++row) {
      for (int column = first_.column; column <= last_.column; ++column) search_around({column, row});
    }
    return spread();
  }

 private:
  // The points of the terrain below the shape; false: there are none.
  bool choose_range() {
    const auto along = [this](int axis, double sign) {
      return shape_.support(sign * Eigen::Vector3d::Unit(axis))[axis];
    };
    lowest_ = along(2, -1) - margin_;
    const Eigen::Vector2d step(field_.size.x() / (field_.columns - 1), field_.size.y() / (field_.rows - 1));
    const Eigen::Vector2i most(field_.columns - 1, field_.rows - 1);
    Eigen::Vector2i from, to;
    for (int axis = 0; axis < 2; ++axis) {
      const double low = (along(axis, -1) - margin_) / field_.size[axis] + 0.5;
      const double high = (along(axis, 1) + margin_) / field_.size[axis] + 0.5;
      if (!(high >= 0) || !(low <= 1)) return false;
      from[axis] = static_cast<int>(std::floor(std::clamp(low, 0.0, 1.0) * most[axis]));
      to[axis] = static_cast<int>(std::ceil(std::clamp(high, 0.0, 1.0) * most[axis]));
    }
    first_ = {from.x(), from.y()};
    last_ = {to.x(), to.y()};
    return true;
  }

  [[nodiscard]] Eigen::Vector3d point(Cell at) const { return field_.point(at.column, at.row); }
  [[nodiscard]] bool has_cell(Cell at) const {
    return at.column >= 0 && at.row >= 0 && at.column + 1 < field_.columns && at.row + 1 < field_.rows;
  }
  // Of the two triangles of a cell: that of greater x, or that of greater y. Out of the terrain, unit.
  [[nodiscard]] Eigen::Vector3d normal(Cell at, bool greater_x) const {
    const double low = field_.at(at.column, at.row), high = field_.at(at.column + 1, at.row + 1);
    const double between = greater_x ? field_.at(at.column + 1, at.row) : field_.at(at.column, at.row + 1);
    const double dx = field_.size.x() / (field_.columns - 1), dy = field_.size.y() / (field_.rows - 1);
    const Eigen::Vector2d slope = greater_x ? Eigen::Vector2d((between - low) / dx, (high - between) / dy)
                                            : Eigen::Vector2d((high - between) / dx, (between - low) / dy);
    return Eigen::Vector3d(-slope.x(), -slope.y(), 1).normalized();
  }

  void add(const Eigen::Vector3d& p, const Eigen::Vector3d& n, double distance) {
    if (!(distance < margin_) || distance < -kDeepest) return;
    const TerrainContact found{p - 0.5 * distance * n, n, distance};
    if (count_ < kMaxCandidates) {
      candidates_[static_cast<std::size_t>(count_++)] = found;
      return;
    }
    const auto shallowest = std::ranges::max_element(candidates_, {}, &TerrainContact::distance);
    if (found.distance < shallowest->distance) *shallowest = found;
  }

  void add_corner(const Eigen::Vector3d& p) {
    const double u = (p.x() / field_.size.x() + 0.5) * (field_.columns - 1);
    const double v = (p.y() / field_.size.y() + 0.5) * (field_.rows - 1);
    if (!(u >= 0 && v >= 0 && u <= field_.columns - 1 && v <= field_.rows - 1)) return;
    const Cell at{std::min(static_cast<int>(u), field_.columns - 2),
                  std::min(static_cast<int>(v), field_.rows - 2)};
    const Eigen::Vector3d n = normal(at, u - at.column >= v - at.row);
    add(p, n, n.dot(p - point(at)));
  }

  // Triangles and edges from a point towards greater x and y, and the point.
  void search_around(Cell at) {
    const bool right = at.column + 1 < field_.columns, above = at.row + 1 < field_.rows;
    if (right && above && reaches(at, {at.column + 1, at.row + 1})) {
      if (shape_.round()) {
        for (const bool greater_x : {true, false}) add_face(at, greater_x);
      }
      add_edge(at, {at.column + 1, at.row + 1}, normal(at, false), normal(at, true));
    }
    const Cell below{at.column, at.row - 1}, left{at.column - 1, at.row};
    if (right && has_cell(at) && has_cell(below))
      add_edge(at, {at.column + 1, at.row}, normal(at, true), normal(below, false));
    if (above && has_cell(at) && has_cell(left))
      add_edge(at, {at.column, at.row + 1}, normal(left, true), normal(at, false));
    add_peak(at);
  }

  [[nodiscard]] bool reaches(Cell a, Cell b) const {
    return std::max({field_.at(a.column, a.row), field_.at(b.column, b.row), field_.at(a.column, b.row),
                     field_.at(b.column, a.row)}) >= lowest_;
  }

  void add_face(Cell at, bool greater_x) {
    const Eigen::Vector3d n = normal(at, greater_x), p = shape_.support(-n);
    const double distance = n.dot(p - point(at));
    const Eigen::Vector3d below = p - point(at) - distance * n;
    const double u = below.x() * (field_.columns - 1) / field_.size.x();
    const double v = below.y() * (field_.rows - 1) / field_.size.y();
    const bool inside = greater_x ? u <= 1 && v >= 0 && u >= v : v <= 1 && u >= 0 && v > u;
    if (inside) add(p, n, distance);
  }

  // A ridge: `left` and `right` are the normals of the triangles beside it, seen from a to b. Between them there is
  // a normal along which the shape's farthest point changes from one side of the ridge to the other.
  void add_edge(Cell a, Cell b, const Eigen::Vector3d& left, const Eigen::Vector3d& right) {
    const Eigen::Vector3d at = point(a), along = point(b) - at;
    if (std::max(at.z(), at.z() + along.z()) < lowest_) return;
    const Eigen::Vector3d across = Eigen::Vector3d(along.y(), -along.x(), 0).normalized();  // to the right
    if ((right - left).dot(across) <= kRidge) return;
    const Eigen::Vector3d middle = (left + right).normalized();
    if (middle.dot(shape_.support(-middle) - at) >= margin_) return;
    struct Side {
      Eigen::Vector3d n, p;
      double place = 0;  // m to the right of the ridge, along the plane that has the normal
    };
    const auto side_of = [&](const Eigen::Vector3d& n) {
      Side out{n, shape_.support(-n)};
      const Eigen::Vector3d from = out.p - at;
      out.place = across.dot(from - n.dot(from) * n);
      return out;
    };
    Side of_left = side_of(left), of_right = side_of(right);
    if (of_left.place <= 0 || of_right.place >= 0) return;
    for (int i = 0; i < kBisections; ++i) {
      const Side middle_one = side_of((of_left.n + of_right.n).normalized());
      (middle_one.place > 0 ? of_left : of_right) = middle_one;
    }
    const double share = of_left.place / (of_left.place - of_right.place);
    const Eigen::Vector3d p = of_left.p + share * (of_right.p - of_left.p), n = of_left.n;
    const double distance = n.dot(p - at);
    const double t = along.dot(p - at - distance * n) / along.squaredNorm();
    if (t >= 0 && t <= 1) add(p, n, distance);
  }

  // A point that is higher than the plane through its neighbours.
  void add_peak(Cell at) {
    const Eigen::Vector3d v = point(at);
    if (v.z() < lowest_) return;
    if (!shape_.round()) {
      if (const auto contact = is_peak(at) ? shape_.with_point(v) : std::nullopt)
        add(contact->p_F + 0.5 * contact->distance * contact->normal_F, contact->normal_F, contact->distance);
      return;
    }
    const Eigen::Vector3d n = (shape_.centre() - v).normalized();
    if (!(n.z() > 0) || !in_cone(at, n)) return;
    const Eigen::Vector3d p = shape_.support(-n);
    const double distance = n.dot(p - v);
    if ((p - v - distance * n).norm() <= std::abs(distance) + margin_) add(p, n, distance);
  }

  template <class Each>
  bool every_neighbour(Cell at, const Each& holds) const {
    constexpr std::array<Cell, 6> kAround{{{1, 0}, {1, 1}, {0, 1}, {-1, 0}, {-1, -1}, {0, -1}}};
    return std::ranges::all_of(kAround, [&](const Cell& by) {
      const Cell to{at.column + by.column, at.row + by.row};
      const bool there = to.column >= 0 && to.row >= 0 && to.column < field_.columns && to.row < field_.rows;
      return !there || holds(Eigen::Vector3d(point(to) - point(at)));
    });
  }
  [[nodiscard]] bool is_peak(Cell at) const {
    return every_neighbour(at, [](const Eigen::Vector3d& to) { return to.z() <= 0; });
  }
  [[nodiscard]] bool in_cone(Cell at, const Eigen::Vector3d& n) const {
    return every_neighbour(at, [&n](const Eigen::Vector3d& to) { return n.dot(to) < 0; });
  }

  [[nodiscard]] TerrainContacts spread() {
    TerrainContacts out;
    if (count_ == 0) return out;
    std::array<double, kMaxCandidates> far{};
    far.fill(std::numeric_limits<double>::infinity());
    const auto begin = candidates_.begin();
    auto next = std::min_element(begin, begin + count_, [](const TerrainContact& a, const TerrainContact& b) {
      return a.distance < b.distance;
    });
    constexpr double kSamePoint = 1e-9;  // m^2
    while (out.count < kMaxTerrainContacts) {
      out.points[static_cast<std::size_t>(out.count++)] = *next;
      const Eigen::Vector3d chosen = next->p_F;
      for (int i = 0; i < count_; ++i) {
        const auto k = static_cast<std::size_t>(i);
        far[k] = std::min(far[k], (candidates_[k].p_F - chosen).squaredNorm());
      }
      const auto farthest = std::max_element(far.begin(), far.begin() + count_);
      if (!(*farthest > kSamePoint)) break;
      next = begin + (farthest - far.begin());
    }
    return out;
  }

  const TerrainView& field_;
  const ConvexOnTerrain& shape_;
  const double margin_;
  double lowest_ = 0;  // m, of the shape less the margin
  Cell first_, last_;  // points of the terrain
  std::array<TerrainContact, kMaxCandidates> candidates_;
  int count_ = 0;
};

}  // namespace

TerrainContacts terrain_contacts(const TerrainView& field, const ConvexOnTerrain& shape, double margin) {
  return TerrainContactFinder(field, shape, margin).find();
}

}  // namespace doppel
