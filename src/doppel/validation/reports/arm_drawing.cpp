#include "doppel/validation/reports/detail/arm_drawing.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "doppel/description/meshes/convex_hull.h"
#include "doppel/validation/reports/detail/report_parts.h"

namespace doppel {
namespace {

constexpr int kDrawingWidth = 640, kDrawingHeight = 480, kRaster = 96;
constexpr double kFill = 0.94;  // of the height, by the sphere around the arm
constexpr std::array<const char*, 4> kOutlineDashes = {"", "9 4", "3 3", "12 3 3 3"};

class Projection {
 public:
  explicit Projection(const ArmView& view) : axes_(axes_of(view)), view_(view) {}

  // In the units of the sphere's radius.
  [[nodiscard]] Eigen::Vector3d operator()(const Eigen::Vector3d& p_W) const {
    const Eigen::Vector3d p = (p_W - view_.centre) / view_.radius;
    return {axes_.right.dot(p), axes_.up.dot(p), axes_.eye.dot(p)};
  }
  [[nodiscard]] Eigen::Vector3d on_drawing(const Eigen::Vector3d& p_W) const {
    const Eigen::Vector3d p = (*this)(p_W);
    const double scale = 0.5 * kFill * kDrawingHeight;
    return {0.5 * kDrawingWidth + scale * p.x(), 0.5 * kDrawingHeight - scale * p.y(), p.z()};
  }

 private:
  ViewAxes axes_;
  ArmView view_;
};

struct DrawnTriangle {
  double depth = 0;
  std::array<Eigen::Vector3d, 3> corners;
  std::string colour;
};

std::string hex_colour(const Eigen::Vector3d& colour) {
  std::string out = "#";
  for (int i = 0; i < 3; ++i)
    out += fmt::format("{:x}", static_cast<int>(std::lround(15 * std::clamp(colour[i], 0.0, 1.0))));
  return out;
}

// The rank among the named links, -1: it is not named.
int rank_of(const ArmPose& pose, std::size_t surface) {
  const auto found = std::ranges::find(pose.named, static_cast<int>(surface));
  return found == pose.named.end() ? -1 : static_cast<int>(found - pose.named.begin());
}

Eigen::Vector3d base_colour(const LinkSurface& surface, const ArmPose& pose, std::size_t index) {
  const int rank = rank_of(pose, index);
  if (rank >= 0) {
    const auto& colour = kNamedColours[static_cast<std::size_t>(rank) % kNamedColours.size()];
    return {colour[0], colour[1], colour[2]};
  }
  const Eigen::Vector3d own_colour = surface.colour.cast<double>();
  // Beside named links the others are light, so that they differ from them also in grey.
  return pose.named.empty() ? own_colour
                            : Eigen::Vector3d(0.25 * own_colour + Eigen::Vector3d::Constant(0.6));
}

std::vector<DrawnTriangle> drawn_triangles(const std::vector<LinkSurface>& surfaces, const ArmPose& pose) {
  const Projection projection(pose.view);
  const ViewAxes axes = axes_of(pose.view);
  const Eigen::Vector3d light = (axes.eye + 0.7 * axes.up - 0.4 * axes.right).normalized();
  std::vector<DrawnTriangle> out;
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    const Eigen::Vector3d colour = base_colour(surfaces[i], pose, i);
    for (const auto& triangle : surfaces[i].triangles) {
      std::array<Eigen::Vector3d, 3> p_W;
      for (std::size_t k = 0; k < 3; ++k)
        p_W[k] = pose.X_WL[i] * surfaces[i].vertices[triangle[k]].cast<double>();
      const Eigen::Vector3d normal = (p_W[1] - p_W[0]).cross(p_W[2] - p_W[0]).normalized();
      if (!(normal.dot(axes.eye) > 0)) continue;
      DrawnTriangle one;
      for (std::size_t k = 0; k < 3; ++k) {
        one.corners[k] = projection.on_drawing(p_W[k]);
        one.depth += one.corners[k].z() / 3;
      }
      one.colour = hex_colour((0.4 + 0.6 * std::max(0.0, normal.dot(light))) * colour);
      out.push_back(std::move(one));
    }
  }
  std::ranges::sort(out, {}, &DrawnTriangle::depth);
  return out;
}

// Neighbours of one colour are one path.
std::string triangle_paths(const std::vector<DrawnTriangle>& triangles) {
  std::string out = "<g stroke-width='.7' stroke-linejoin='round'>";
  std::string path;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const auto& [a, b, c] = triangles[i].corners;
    const auto whole = [](double value) { return static_cast<int>(std::lround(value)); };
    path += fmt::format("M{} {}L{} {} {} {}z", whole(a.x()), whole(a.y()), whole(b.x()), whole(b.y()),
                        whole(c.x()), whole(c.y()));
    if (i + 1 < triangles.size() && triangles[i + 1].colour == triangles[i].colour) continue;
    out += fmt::format("<path fill='{0}' stroke='{0}' d='{1}'/>", triangles[i].colour, path);
    path.clear();
  }
  return out + "</g>\n";
}

// 1, 2 or 5 times a power of ten, about a fifth of the radius.
double grid_step(double radius) {
  const double raw = radius / 5, power = std::pow(10, std::floor(std::log10(raw)));
  return power * (raw < 2 * power ? 1 : raw < 5 * power ? 2 : 5);
}

// The plane of the root's x and y.
std::string grid_path(const ArmView& view) {
  const Projection projection(view);
  const double step = grid_step(view.radius);
  const int count = static_cast<int>(std::ceil(view.radius / step));
  const double middle_x = step * std::round(view.centre.x() / step),
               middle_y = step * std::round(view.centre.y() / step);
  std::string path;
  const auto line = [&](double x0, double y0, double x1, double y1) {
    const Eigen::Vector3d a = projection.on_drawing({x0, y0, 0}), b = projection.on_drawing({x1, y1, 0});
    path += fmt::format("M{:.0f} {:.0f}L{:.0f} {:.0f}", a.x(), a.y(), b.x(), b.y());
  };
  const double half = step * count;
  for (int i = -count; i <= count; ++i) {
    const double shift = step * i;
    line(middle_x + shift, middle_y - half, middle_x + shift, middle_y + half);
    line(middle_x - half, middle_y + shift, middle_x + half, middle_y + shift);
  }
  return fmt::format("<path d='{}' stroke='#d5dae0' fill='none'/>\n", path);
}

struct NamedLink {
  std::string name;
  std::vector<Eigen::Vector2d> outline;
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  int rank = 0;
};

std::vector<NamedLink> named_links(const std::vector<LinkSurface>& surfaces, const ArmPose& pose) {
  const Projection projection(pose.view);
  std::vector<NamedLink> out;
  for (std::size_t rank = 0; rank < pose.named.size(); ++rank) {
    const auto index = static_cast<std::size_t>(pose.named[rank]);
    NamedLink one{.name = surfaces[index].name, .outline = {}, .rank = static_cast<int>(rank)};
    std::vector<Eigen::Vector2d> points;
    for (const Eigen::Vector3f& v : surfaces[index].vertices)
      points.emplace_back(projection.on_drawing(pose.X_WL[index] * v.cast<double>()).head<2>());
    one.outline = convex_outline(std::move(points));
    for (const Eigen::Vector2d& p : one.outline) one.middle += p / static_cast<double>(one.outline.size());
    out.push_back(std::move(one));
  }
  return out;
}

// Outlines, and the names at the sides with a line to their link.
std::string name_marks(std::vector<NamedLink> links) {
  std::string out;
  for (const NamedLink& link : links) {
    std::string points;
    for (const Eigen::Vector2d& p : link.outline) points += fmt::format("{:.0f},{:.0f} ", p.x(), p.y());
    out += fmt::format(
        "<polygon points='{}' fill='none' stroke='#111' stroke-width='2' stroke-dasharray='{}'/>\n", points,
        kOutlineDashes[static_cast<std::size_t>(link.rank) % kOutlineDashes.size()]);
  }
  std::ranges::sort(links, {}, [](const NamedLink& link) { return link.middle.x(); });
  for (std::size_t i = 0; i < links.size(); ++i) {
    const bool left = 2 * i < links.size();
    const double x = left ? 10 : kDrawingWidth - 10,
                 y = 26.0 + 26.0 * static_cast<double>(left ? i : links.size() - 1 - i);
    out += fmt::format(
        "<path d='M{:.0f} {:.0f}L{:.0f} {:.0f}' stroke='#111'/><circle cx='{:.0f}' cy='{:.0f}' r='4' "
        "fill='#111' "
        "stroke='#fff'/><text x='{:.0f}' y='{:.0f}' text-anchor='{}' font-size='17' font-weight='600' "
        "fill='#111' "
        "stroke='#fff' stroke-width='4' paint-order='stroke'>{}</text>\n",
        left ? x + 4 : x - 4, y + 5, links[i].middle.x(), links[i].middle.y(), links[i].middle.x(),
        links[i].middle.y(), x, y, left ? "start" : "end", markup(links[i].name));
  }
  return out;
}

double edge_side(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double x, double y) {
  return (b.x() - a.x()) * (y - a.y()) - (b.y() - a.y()) * (x - a.x());
}

// Writes the nearest surface of each pixel.
class DepthRaster {
 public:
  void triangle(const std::array<Eigen::Vector3d, 3>& p, bool is_named) {
    const auto pixel = [](double value) {
      return std::clamp(static_cast<int>(std::lround((value + 1) * 0.5 * kRaster)), 0, kRaster - 1);
    };
    const auto [left, right] = std::minmax({pixel(p[0].x()), pixel(p[1].x()), pixel(p[2].x())});
    const auto [low, high] = std::minmax({pixel(p[0].y()), pixel(p[1].y()), pixel(p[2].y())});
    const double depth = (p[0].z() + p[1].z() + p[2].z()) / 3;
    for (int row = low; row <= high; ++row) {
      for (int column = left; column <= right; ++column) {
        const double x = 2.0 * column / kRaster - 1, y = 2.0 * row / kRaster - 1;
        const double a = edge_side(p[0], p[1], x, y), b = edge_side(p[1], p[2], x, y),
                     c = edge_side(p[2], p[0], x, y);
        if (!((a >= 0 && b >= 0 && c >= 0) || (a <= 0 && b <= 0 && c <= 0))) continue;
        const auto i = static_cast<std::size_t>(row * kRaster + column);
        if (depth <= depth_[i]) continue;
        depth_[i] = depth;
        named_[i] = is_named;
      }
    }
  }
  [[nodiscard]] double share() const {
    return static_cast<double>(std::ranges::count(named_, true)) / (kRaster * kRaster);
  }

 private:
  std::vector<double> depth_ = std::vector<double>(std::size_t{kRaster} * kRaster, -1e9);
  std::vector<bool> named_ = std::vector<bool>(std::size_t{kRaster} * kRaster, false);
};

}  // namespace

ViewAxes axes_of(const ArmView& view) {
  const double cy = std::cos(view.yaw), sy = std::sin(view.yaw), cp = std::cos(view.pitch),
               sp = std::sin(view.pitch);
  return {{-sy, cy, 0}, {-sp * cy, -sp * sy, cp}, {cp * cy, cp * sy, sp}};
}

double visible_share(const std::vector<LinkSurface>& surfaces, const ArmPose& pose, const ArmView& view) {
  const Projection projection(view);
  DepthRaster raster;
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    const bool is_named = rank_of(pose, i) >= 0;
    std::vector<Eigen::Vector3d> points;
    for (const Eigen::Vector3f& v : surfaces[i].vertices)
      points.push_back(projection(pose.X_WL[i] * v.cast<double>()));
    for (const auto& [a, b, c] : surfaces[i].triangles)
      raster.triangle({points[a], points[b], points[c]}, is_named);
  }
  return raster.share();
}

std::string arm_drawing(const std::vector<LinkSurface>& surfaces, const ArmPose& pose,
                        const std::string& caption) {
  std::string out = fmt::format(
      "<svg viewBox='0 0 {} {}' role='img' aria-label='{}' font-family='system-ui, sans-serif'>\n",
      kDrawingWidth, kDrawingHeight, markup(caption));
  out += grid_path(pose.view);
  out += triangle_paths(drawn_triangles(surfaces, pose));
  out += name_marks(named_links(surfaces, pose));
  return out + "</svg>\n";
}

}  // namespace doppel
