// The drawing of a reach map.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "doppel/base/core/overloaded.h"
#include "doppel/base/xml/xml.h"
#include "doppel/description/meshes/convex_hull.h"
#include "doppel/robot/kinematics/kinematics.h"
#include "doppel/robot/reach/reach_files.h"

namespace doppel {
namespace {

constexpr double kPanelSize = 420, kPanelGap = 74, kDrawingTop = 94, kDrawingLeft = 64, kLabelRoom = 24;
constexpr int kRoundPoints = 80;  // of a ball or the rim of a cylinder

using Point2 = Eigen::Vector2d;

// Points of a shape's surface in its own frame, whose hull is nearly the shape.
std::vector<Eigen::Vector3d> surface_points(const CollisionShape& shape) {
  std::vector<Eigen::Vector3d> out;
  const auto corners = [&out](const Eigen::Vector3d& half) {
    for (int i = 0; i < 8; ++i)
      out.emplace_back((i & 1) != 0 ? half.x() : -half.x(), (i & 2) != 0 ? half.y() : -half.y(),
                       (i & 4) != 0 ? half.z() : -half.z());
  };
  const auto balls = [&out](const Eigen::Vector3d& radii, double half_length) {
    for (const Eigen::Vector3d& d : even_directions(kRoundPoints))
      out.emplace_back(radii.cwiseProduct(d) + Eigen::Vector3d(0, 0, d.z() < 0 ? -half_length : half_length));
  };
  std::visit(Overloaded{[&](const Box& s) { corners(0.5 * s.size); },
                        [&](const Cylinder& s) {
                          for (int i = 0; i < kRoundPoints; ++i) {
                            const double a = 2 * M_PI * i / kRoundPoints;
                            for (const double side : {-0.5, 0.5})
                              out.emplace_back(s.radius * std::cos(a), s.radius * std::sin(a),
                                               side * s.length);
                          }
                        },
                        [&](const Capsule& s) { balls(Eigen::Vector3d::Constant(s.radius), 0.5 * s.length); },
                        [&](const Sphere& s) { balls(Eigen::Vector3d::Constant(s.radius), 0); },
                        [&](const Ellipsoid& s) { balls(s.radii, 0); },
                        [&](const SharedHull& s) {
                          for (const Eigen::Vector3f& v : s->vertices) out.emplace_back(v.cast<double>());
                        },
                        [](const SharedField&) {}},
             shape.geometry);
  return out;
}

double value_of(const ReachCell& cell, ReachValue value) {
  switch (value) {
    case ReachValue::share:
      return cell.share;
    case ReachValue::manipulability:
      return cell.manipulability;
    case ReachValue::limit_distance:
      break;
  }
  return cell.limit_distance;
}

const char* label_of(ReachValue value) {
  switch (value) {
    case ReachValue::share:
      return "share of directions";
    case ReachValue::manipulability:
      return "manipulability";
    case ReachValue::limit_distance:
      break;
  }
  return "distance from limits";
}

// A round step of which at most seven fit.
double tick_step(double range) {
  double step = std::pow(10, std::floor(std::log10(range)));
  for (const double factor : {0.1, 0.2, 0.5, 1.0}) {
    if (range / (factor * step) <= 7) return factor * step;
  }
  return step;
}

class ReachDrawing {
 public:
  ReachDrawing(const ReachMap& map, ReachValue value, std::size_t slices) : map_(map), value_(value) {
    for (const ReachCell& cell : map.cells) {
      if (cell.in_reach) largest_ = std::max(largest_, value_of(cell, value));
    }
    // The scale ends at a round number above the largest value.
    const double step = value == ReachValue::manipulability
                            ? std::pow(10, std::floor(std::log10(std::max(largest_, 1e-9))))
                            : 0.1;
    largest_ = largest_ > 0 ? std::ceil(largest_ / step - 1e-6) * step : 1;
    const double width = kDrawingLeft + static_cast<double>(slices) * (kPanelSize + kPanelGap);
    out_ = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" viewBox=\"0 0 "
        "{0:.0f} "
        "{1:.0f}\" font-family=\"Helvetica, Arial, sans-serif\">\n<rect width=\"100%\" height=\"100%\" "
        "fill=\"#fff\"/>\n",
        width, kDrawingTop + kPanelSize + 96);
    frame();
  }

  void heading(const std::string& title) {
    text(kDrawingLeft, 34, title, "start", 18, "#222");
    text(kDrawingLeft, 56,
         fmt::format("{} in cells of {:.3g} mm{}", label_of(value_), map_.cell * 1e3,
                     map_.directions > 1 ? fmt::format(", {} directions of the tool", map_.directions) : ""),
         "start", 13, "#555");
  }

  void panel(std::size_t index, const ReachSlice& slice, const ReachBodies& bodies) {
    left_ = kDrawingLeft + static_cast<double>(index) * (kPanelSize + kPanelGap);
    across_ = slice.axis;
    right_axis_ = slice.axis == 0 ? 1 : 0;
    up_axis_ = slice.axis == 2 ? 1 : 2;
    const int layer =
        std::clamp(static_cast<int>(std::lround((slice.where - map_.origin[across_]) / map_.cell)), 0,
                   size(across_) - 1);
    text(left_, kDrawingTop - 9,
         fmt::format("{} = {:.3f} m", "xyz"[across_], map_.origin[across_] + layer * map_.cell + 0.0),
         "start", 13, "#222");
    out_ +=
        fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"#f4f4f2\"/>\n",
                    left_, kDrawingTop, kPanelSize, kPanelSize);
    out_ += fmt::format(
        "<clipPath id=\"panel{0}\"><rect x=\"{1:.1f}\" y=\"{2:.1f}\" width=\"{3:.1f}\" height=\"{3:.1f}\"/>"
        "</clipPath>\n<g clip-path=\"url(#panel{0})\">\n",
        index, left_, kDrawingTop, kPanelSize);
    cells(layer);
    for (const ReachBody& body : bodies) silhouette(body);
    out_ += "</g>\n";
    axes();
  }

  void scale() {
    const double y = kDrawingTop + kPanelSize + 52;
    for (int i = 0; i < 64; ++i) {
      const MapColour c = map_colour((i + 0.5) / 64);
      out_ += fmt::format(
          "<rect x=\"{:.2f}\" y=\"{:.1f}\" width=\"4.1\" height=\"12\" fill=\"#{:02x}{:02x}{:02x}\"/>\n",
          kDrawingLeft + i * 4, y, c.r, c.g, c.b);
    }
    text(kDrawingLeft, y + 26, "0", "start", 11, "#555");
    text(kDrawingLeft + 256, y + 26, fmt::format("{:.3g}", largest_), "end", 11, "#555");
    text(kDrawingLeft + 128, y + 26, label_of(value_), "middle", 11, "#555");
  }

  [[nodiscard]] std::string finished() const { return out_ + "</svg>\n"; }

 private:
  [[nodiscard]] int size(int axis) const { return axis == 0 ? map_.nx : axis == 1 ? map_.ny : map_.nz; }

  // The square around all that can be reached, the same for all panels.
  void frame() {
    Eigen::Vector3d low = Eigen::Vector3d::Constant(1e9), high = -low;
    for (int z = 0; z < map_.nz; ++z) {
      for (int y = 0; y < map_.ny; ++y) {
        for (int x = 0; x < map_.nx; ++x) {
          if (!map_.at(x, y, z).in_reach) continue;
          low = low.cwiseMin(map_.center(x, y, z));
          high = high.cwiseMax(map_.center(x, y, z));
        }
      }
    }
    if (low.x() > high.x()) low = high = map_.center(map_.nx / 2, map_.ny / 2, map_.nz / 2);
    middle_ = 0.5 * (low + high);
    range_ = (high - low).maxCoeff() + 4 * map_.cell;
  }
  [[nodiscard]] double px(double value) const {
    return left_ + ((value - middle_[right_axis_]) / range_ + 0.5) * kPanelSize;
  }
  [[nodiscard]] double py(double value) const {
    return kDrawingTop + (0.5 - (value - middle_[up_axis_]) / range_) * kPanelSize;
  }

  // Neighbours of one colour are one rectangle.
  void cells(int layer) {
    const double side = map_.cell / range_ * kPanelSize;
    for (int v = 0; v < size(up_axis_); ++v) {
      for (int u = 0; u < size(right_axis_);) {
        const int colour = step_at(layer, u, v);
        int end = u + 1;
        while (end < size(right_axis_) && step_at(layer, end, v) == colour) ++end;
        if (colour >= 0) {
          const MapColour c = map_colour(colour / 63.0);
          out_ += fmt::format(
              "<rect shape-rendering=\"crispEdges\" x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" "
              "height=\"{:.2f}\" "
              "fill=\"#{:02x}{:02x}{:02x}\"/>\n",
              px(map_.origin[right_axis_] + u * map_.cell) - side / 2,
              py(map_.origin[up_axis_] + v * map_.cell) - side / 2, side * (end - u) + 0.1, side + 0.1, c.r,
              c.g, c.b);
        }
        u = end;
      }
    }
  }
  // 0 to 63; -1: out of reach.
  [[nodiscard]] int step_at(int layer, int u, int v) const {
    int index[3];
    index[across_] = layer;
    index[right_axis_] = u;
    index[up_axis_] = v;
    const ReachCell& cell = map_.at(index[0], index[1], index[2]);
    return cell.in_reach
               ? static_cast<int>(std::lround(std::min(1.0, value_of(cell, value_) / largest_) * 63))
               : -1;
  }

  // Objects, which may be larger than the arm, hide nothing.
  void silhouette(const ReachBody& body) {
    std::vector<Point2> points;
    points.reserve(body.points.size());
    for (const Eigen::Vector3d& p : body.points) points.emplace_back(px(p[right_axis_]), py(p[up_axis_]));
    if (points.size() < 3) return;
    out_ +=
        body.of_robot
            ? "<polygon fill=\"#fff\" fill-opacity=\"0.55\" stroke=\"#333\" stroke-width=\"0.8\" points=\""
            : "<polygon fill=\"none\" stroke=\"#c0392b\" stroke-dasharray=\"5 3\" points=\"";
    for (const Point2& p : convex_outline(std::move(points)))
      out_ += fmt::format("{:.1f},{:.1f} ", p.x(), p.y());
    out_ += "\"/>\n";
  }

  void axes() {
    const double bottom = kDrawingTop + kPanelSize, step = tick_step(range_);
    const auto ticks = [&](int axis, auto draw) {
      const double first = std::ceil((middle_[axis] - range_ / 2) / step) * step;
      const auto count = static_cast<int>(std::floor((middle_[axis] + range_ / 2 - first) / step)) + 1;
      for (int i = 0; i < count; ++i) draw(std::round(first / step + i) * step + 0.0);
    };
    ticks(right_axis_, [&](double value) {
      line(px(value), bottom, px(value), bottom + 5);
      text(px(value), bottom + 18, fmt::format("{:.3g}", value), "middle", 11, "#555");
    });
    ticks(up_axis_, [&](double value) {
      line(left_ - 5, py(value), left_, py(value));
      if (py(value) < kDrawingTop + kLabelRoom) return;  // the axis' name stands there
      text(left_ - 8, py(value) + 4, fmt::format("{:.3g}", value), "end", 11, "#555");
    });
    text(left_ + kPanelSize / 2, bottom + 36, fmt::format("{}, m", "xyz"[right_axis_]), "middle", 12, "#222");
    text(left_ - 8, kDrawingTop + 12, fmt::format("{}, m", "xyz"[up_axis_]), "end", 12, "#222");
  }

  void text(double x, double y, const std::string& words, const char* anchor, int font_size,
            const char* colour) {
    out_ += fmt::format(
        "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\" font-size=\"{}\" fill=\"{}\">{}</text>\n", x, y,
        anchor, font_size, colour, escape_xml(words, false));
  }
  void line(double x1, double y1, double x2, double y2) {
    out_ += fmt::format("<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"#888\"/>\n",
                        x1, y1, x2, y2);
  }

  const ReachMap& map_;
  ReachValue value_;
  double largest_ = 0, left_ = 0, range_ = 1;
  int across_ = 1, right_axis_ = 0, up_axis_ = 2;
  Eigen::Vector3d middle_ = Eigen::Vector3d::Zero();
  std::string out_;
};

}  // namespace

ReachBodies scene_bodies(const CollisionScene& scene, const Eigen::VectorXd& q) {
  constexpr double kLargest = 10;  // m: planes and grounds hide everything else
  ReachBodies out;
  const auto add = [&out](const CollisionShape& shape, const Pose& X_WL, bool of_robot) {
    std::vector<Eigen::Vector3d> points = surface_points(shape);
    Eigen::AlignedBox3d box;
    for (Eigen::Vector3d& p : points) {
      p = X_WL * (shape.X_LS * p);
      box.extend(p);
    }
    if (box.isEmpty() || box.sizes().maxCoeff() < kLargest) out.push_back({std::move(points), of_robot});
  };
  const SceneInstance& robot = scene.instances().front();
  Data data(*robot.model);
  forward_kinematics(*robot.model, data, q);
  for (std::size_t link = 0; link < robot.shapes.size(); ++link) {
    for (const CollisionShape& shape : robot.shapes[link]) add(shape, data.X_WL[link], true);
  }
  for (const SceneInstance& object : scene.instances()) {
    if (object.model != nullptr) continue;
    for (const CollisionShape& shape : object.shapes.front()) add(shape, object.X_WR, false);
  }
  return out;
}

std::string reach_svg(const ReachMap& map, const std::vector<ReachSlice>& slices, ReachValue value,
                      const ReachBodies& bodies, const std::string& title) {
  ReachDrawing drawing(map, value, slices.size());
  drawing.heading(title);
  for (std::size_t i = 0; i < slices.size(); ++i) drawing.panel(i, slices[i], bodies);
  drawing.scale();
  return drawing.finished();
}

}  // namespace doppel
