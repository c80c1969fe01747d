// The spheres of a semantic description (SRDF) against the collision shapes that they stand for.
#include <algorithm>
#include <cmath>
#include <optional>

#include "doppel/review/audit/detail/description_facts.h"
#include "doppel/review/audit/detail/ros_rules.h"
#include "doppel/robot/clearance/instance_covers.h"

namespace doppel::audit_rules {
namespace {

// An audit takes milliseconds: beyond these a cover is not judged.
constexpr std::size_t kMaxCoverTriangles = 60000;  // of all links of one SRDF
constexpr std::size_t kMaxCoverSpheres = 400;      // of a link
constexpr double kMaxCoverExtent = 10;             // m, of a link
constexpr double kCoverTolerance = 1e-4;           // m: less is rounding of the text
constexpr std::size_t kMaxCoverFindings = 20;      // in one SRDF

// A point of the shapes that is in no sphere.
struct Gap {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  // m, in the link's frame
  double distance = 0;                              // m, to the nearest sphere; infinite: there is none
};

class CoverCheck {
 public:
  CoverCheck(const AuditInput& input, const SrdfDescription& srdf, Findings& out)
      : input_(input), srdf_(srdf), out_(out), robot_(described_robot(input.robot, *input.model)) {}

  void check() {
    std::vector<std::string> seen;
    for (const SrdfSpheres& one : srdf_.spheres) {
      if (std::ranges::count(seen, one.link) != 0 || findings_ == kMaxCoverFindings) continue;
      seen.push_back(one.link);
      const int link = input_.model->find_link(one.link);
      if (link >= 0 && !robot_.shapes[static_cast<std::size_t>(link)].empty()) check_link(one, link);
    }
  }

 private:
  // All elements of a link together; a sphere of radius 0 covers nothing.
  [[nodiscard]] std::vector<CoverSphere> spheres_of(const std::string& link) const {
    std::vector<CoverSphere> out;
    for (const SrdfSpheres& one : srdf_.spheres) {
      if (one.link != link) continue;
      for (const SrdfSphere& s : one.spheres) {
        if (s.radius > 0) out.push_back({s.center, s.radius});
      }
    }
    return out;
  }

  void check_link(const SrdfSpheres& element, int link) {
    const std::vector<CoverSphere> spheres = spheres_of(element.link);
    const std::size_t triangles = collision_triangles(*input_.robot.find_link(element.link));
    if (triangles > triangles_left_ || spheres.size() > kMaxCoverSpheres) {
      skip(element, fmt::format("{} spheres, {} triangles", spheres.size(), triangles));
      return;
    }
    triangles_left_ -= triangles;
    std::vector<PlacedGeometry> shapes;
    try {
      shapes = link_geometry(robot_, link);
    } catch (const InputError& error) {
      report_skipped(error, out_);
      return;
    }
    if (const double extent = extent_of(shapes); extent > kMaxCoverExtent) {
      skip(element, fmt::format("shapes of {:.3g} m", extent));
      return;
    }
    if (const auto gap = find_gap(spheres, shapes)) report(element, *gap, spheres.size());
  }

  void skip(const SrdfSpheres& element, const std::string& size) {
    out_.add(
        "audit.skipped", subject(element), element.source,
        fmt::format("whether they cover the link is not checked, because it would take too long: {}", size));
  }

  [[nodiscard]] static double extent_of(const std::vector<PlacedGeometry>& shapes) {
    Eigen::AlignedBox3d box;
    double ball = 0;
    for (const PlacedGeometry& placed : shapes) {
      for (const Eigen::Vector3d& p : placed.geometry.vertices) box.extend(placed.X_LG * p);
      if (placed.geometry.ball) ball = std::max(ball, 2 * placed.geometry.ball->radius);
    }
    return std::max(ball, box.isEmpty() ? 0.0 : box.sizes().maxCoeff());
  }

  [[nodiscard]] static std::optional<Gap> find_gap(const std::vector<CoverSphere>& spheres,
                                                   const std::vector<PlacedGeometry>& shapes) {
    std::vector<CoverSphere> enlarged = spheres;
    for (CoverSphere& s : enlarged) s.radius += kCoverTolerance;
    const auto hole = find_hole(enlarged, shapes);
    if (!hole) return std::nullopt;
    const auto distance = [&](const Eigen::Vector3d& p) {
      double out = kFarAway;
      for (const CoverSphere& s : spheres) out = std::min(out, (p - s.centre).norm() - s.radius);
      return out;
    };
    // The farthest corner says more than the first hole.
    Gap out{hole->point, distance(hole->point)};
    for (const PlacedGeometry& placed : shapes) {
      for (const Eigen::Vector3d& p : placed.geometry.vertices) {
        const Eigen::Vector3d p_L = placed.X_LG * p;
        if (const double d = distance(p_L); d > out.distance) out = {p_L, d};
      }
    }
    return out;
  }

  static std::string subject(const SrdfSpheres& element) {
    return fmt::format("spheres of link '{}'", element.link);
  }

  void report(const SrdfSpheres& element, const Gap& gap, std::size_t count) {
    ++findings_;
    const Eigen::Vector3d p = gap.point.unaryExpr([](double x) { return std::round(x * 1e4) / 1e4 + 0.0; });
    const std::string where = fmt::format("({:g}, {:g}, {:g}) m", p.x(), p.y(), p.z());
    out_.add("srdf.sphere_cover", subject(element), element.source,
             count == 0 ? fmt::format("there is no sphere with a radius, and the link has collision shapes, "
                                      "for example at {}",
                                      where)
                        : fmt::format("the point {} of its collision shapes is {:.1f} mm outside of the "
                                      "nearest sphere",
                                      where, 1e3 * std::max(gap.distance, kCoverTolerance)),
             "enlarge or add spheres, or find them again with: doppel convert FILE --to srdf --spheres");
  }

  const AuditInput& input_;
  const SrdfDescription& srdf_;
  Findings& out_;
  SceneInstance robot_;
  std::size_t triangles_left_ = kMaxCoverTriangles, findings_ = 0;
};

}  // namespace

void check_srdf_covers(const AuditInput& input, const SrdfDescription& srdf, Findings& out) {
  if (!srdf.spheres.empty()) CoverCheck(input, srdf, out).check();
}

}  // namespace doppel::audit_rules
