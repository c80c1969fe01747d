#include "doppel/robot/collision/collision_shape.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <numbers>

#include "doppel/description/meshes/mesh.h"
#include "doppel/description/meshes/mesh_report.h"

namespace doppel {
namespace {

constexpr double kFlatness = 1e-4;     // of the largest extent
constexpr double kThinnest = 1e-5;     // m
constexpr double kThickenedTo = 1e-3;  // m

using Vertices = std::vector<Eigen::Vector3f>;

// Even directions on the sphere: the golden-angle spiral.
Vertices support_directions() {
  Vertices directions;
  const double golden = std::numbers::pi * (3.0 - std::sqrt(5.0));
  for (int i = 0; i < kSupportDirections; ++i) {
    const double z = 1.0 - 2.0 * (i + 0.5) / kSupportDirections;
    const double r = std::sqrt(1.0 - z * z);
    directions.emplace_back(r * std::cos(golden * i), r * std::sin(golden * i), z);
  }
  for (int axis = 0; axis < 3; ++axis) {
    directions.push_back(Eigen::Vector3f::Unit(axis));
    directions.push_back(-Eigen::Vector3f::Unit(axis));
  }
  return directions;
}

// STL files repeat every vertex about six times. An open-addressed table of indices finds the repetitions.
Vertices distinct_vertices(const Vertices& vertices) {
  std::size_t slots = 16;
  while (slots < 2 * vertices.size()) slots *= 2;
  std::vector<std::uint32_t> table(slots, 0);  // 1 + index into out; 0: free
  Vertices out;
  for (const Eigen::Vector3f& p : vertices) {
    std::array<std::uint32_t, 3> bits{};
    std::memcpy(bits.data(), p.data(), sizeof bits);
    std::uint64_t hash =
        (bits[0] * 0x9E3779B97F4A7C15u) ^ (bits[1] * 0xC2B2AE3D27D4EB4Fu) ^ (bits[2] * 0x165667B19E3779F9u);
    std::size_t slot = (hash ^ (hash >> 32)) & (slots - 1);
    while (table[slot] != 0 && out[table[slot] - 1] != p) slot = (slot + 1) & (slots - 1);
    if (table[slot] != 0) continue;
    out.push_back(p);
    table[slot] = static_cast<std::uint32_t>(out.size());
  }
  return out;
}

Vertices extreme_vertices(const Vertices& vertices) {
  const auto count = static_cast<Eigen::Index>(vertices.size());
  // One coordinate after the other lets the compiler take several vertices at once.
  const Eigen::Array<float, Eigen::Dynamic, 3> points =
      Eigen::Map<const Eigen::Array3Xf>(vertices[0].data(), 3, count).transpose();
  std::vector<Eigen::Index> kept;
  Eigen::ArrayXf heights(count);
  for (const Eigen::Vector3f& direction : support_directions()) {
    heights = direction.x() * points.col(0) + direction.y() * points.col(1) + direction.z() * points.col(2);
    Eigen::Index top = 0;
    heights.maxCoeff(&top);
    kept.push_back(top);
  }
  std::sort(kept.begin(), kept.end());
  kept.erase(std::unique(kept.begin(), kept.end()), kept.end());
  Vertices out;
  for (const Eigen::Index i : kept) out.push_back(vertices[static_cast<std::size_t>(i)]);
  return out;
}

// The distance by which a shape reaches below its centre, m; up: the outer frame's z in the shape's axes.
struct ReachBelow {
  Eigen::Vector3d up;  // unit
  [[nodiscard]] double across() const { return std::hypot(up.x(), up.y()); }
  double operator()(const Sphere& sphere) const { return sphere.radius; }
  double operator()(const Ellipsoid& e) const { return e.radii.cwiseProduct(up).norm(); }
  double operator()(const Box& box) const { return 0.5 * up.cwiseAbs().dot(box.size); }
  double operator()(const Capsule& c) const { return c.radius + 0.5 * std::abs(up.z()) * c.length; }
  double operator()(const Cylinder& c) const {
    return across() * c.radius + 0.5 * std::abs(up.z()) * c.length;
  }
  double operator()(const SharedHull& hull) const {
    double lowest = kNoHeight;
    for (const Eigen::Vector3f& p : hull->vertices) lowest = std::min(lowest, up.dot(p.cast<double>()));
    return -lowest;
  }
  double operator()(const SharedField& field) const {
    double lowest = kNoHeight;
    for (int r = 0; r < field->rows; ++r) {
      for (int c = 0; c < field->columns; ++c) lowest = std::min(lowest, up.dot(field->point(c, r)));
    }
    return -lowest;
  }
  static constexpr double kNoHeight = std::numeric_limits<double>::infinity();
};

Vertices load_vertices(const MeshGeometry& mesh, MeshSource source, const SourceLocation& where) {
  // A report is of the whole file.
  if (source == MeshSource::file || !mesh.submesh.empty()) return load_mesh(mesh).vertices;
  const MeshReport& report = cached_mesh_report(mesh.path);
  if (!report.problem.empty()) throw InputError(report.rule, where, report.problem);
  Vertices out;
  for (const Eigen::Vector3f& p : report.hull)
    out.emplace_back(p.cast<double>().cwiseProduct(mesh.scale).cast<float>());
  return out;
}

}  // namespace

bool has_size(const Geometry& geometry) {
  if (const auto* box = std::get_if<Box>(&geometry)) return box->size.minCoeff() > 0;
  if (const auto* c = std::get_if<Cylinder>(&geometry)) return c->radius > 0 && c->length > 0;
  if (const auto* c = std::get_if<Capsule>(&geometry)) return c->radius > 0 && c->length > 0;
  if (const auto* s = std::get_if<Sphere>(&geometry)) return s->radius > 0;
  if (const auto* e = std::get_if<Ellipsoid>(&geometry)) return e->radii.minCoeff() > 0;
  if (const auto* c = std::get_if<Cone>(&geometry)) return c->radius > 0 && c->length > 0;
  if (const auto* e = std::get_if<Extrusion>(&geometry)) return e->outline.size() >= 3 && e->height > 0;
  return true;
}

double lowest_point(const CollisionShape& shape, const Pose& X_FS) {
  const Eigen::Vector3d up = X_FS.linear().transpose() * Eigen::Vector3d::UnitZ();
  return X_FS.translation().z() - std::visit(ReachBelow{up}, shape.geometry);
}

CollisionMesh make_collision_mesh(const Vertices& all) {
  CollisionMesh out;
  if (all.empty()) return out;
  const Vertices vertices = distinct_vertices(all);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& p : vertices) mean += p.cast<double>();
  mean /= static_cast<double>(vertices.size());
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const auto& p : vertices) {
    const Eigen::Vector3d d = p.cast<double>() - mean;
    covariance += d * d.transpose();
  }
  Eigen::Matrix3d axes = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvectors();
  if (axes.determinant() < 0) axes.col(0) *= -1;
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e30), high = -low;
  for (const auto& p : vertices) {
    const Eigen::Vector3d d = axes.transpose() * (p.cast<double>() - mean);
    low = low.cwiseMin(d);
    high = high.cwiseMax(d);
  }
  const Eigen::Vector3d extent = high - low;
  if (extent.minCoeff() > std::max(kFlatness * extent.maxCoeff(), kThinnest)) {
    out.hull = std::make_shared<const CollisionHull>(
        CollisionHull{vertices.size() > kMaxHullVertices ? extreme_vertices(vertices) : vertices});
    return out;
  }
  out.box_size = extent.cwiseMax(kThickenedTo);
  out.X_GB.linear() = axes;
  out.X_GB.translation() = mean + axes * (0.5 * (low + high));
  return out;
}

const CollisionMesh* CollisionMeshes::find(const MeshGeometry& mesh, const std::string& owner,
                                           const SourceLocation& where, Diagnostics& diagnostics) {
  if (mesh.path.empty()) return nullptr;
  const std::string key = fmt::format("{} {} {} {} {} {}", mesh.path, mesh.scale.x(), mesh.scale.y(),
                                      mesh.scale.z(), mesh.submesh, mesh.center_submesh);
  const auto found = loaded_.find(key);
  if (found != loaded_.end()) return &found->second;
  CollisionMesh made = make_collision_mesh(load_vertices(mesh, source_, where));
  if (made.hull == nullptr) {
    diagnostics.warning(
        "physics.flat_mesh", where,
        fmt::format(
            "the mesh '{}' of {} is flat; a box of {:.3g} x {:.3g} x {:.3g} m is used for collisions instead",
            mesh.uri.empty() ? mesh.path : mesh.uri, owner, made.box_size.x(), made.box_size.y(),
            made.box_size.z()),
        "give the collision mesh a thickness, or write a <box>");
  }
  return &loaded_.emplace(key, std::move(made)).first->second;
}

}  // namespace doppel
