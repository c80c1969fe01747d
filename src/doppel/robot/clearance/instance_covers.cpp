#include "doppel/robot/clearance/instance_covers.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <mutex>

#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/overloaded.h"
#include "doppel/description/meshes/mesh_cache.h"
#include "doppel/robot/clearance/detail/triangle_tree.h"

namespace doppel {

// A mesh is given by its file, so that a cover from the cache reads none; else the shape.
struct ShapeSurface::Source {
  std::optional<MeshGeometry> mesh;
  CoverGeometry geometry = {};  // of a shape that is no mesh
  std::once_flag once = {};
  TriangleTree tree = {};
  double rounding = 0;
  bool readable = true;

  [[nodiscard]] const TriangleTree& triangles() {
    std::call_once(once, [this] { read(); });
    return tree;
  }

 private:
  void read() {
    if (mesh) {
      try {
        geometry = cover_geometry(load_mesh(*mesh));
      } catch (const InputError&) {
        readable = false;
        return;
      }
    }
    std::vector<Triangle3> out;
    const auto& points = geometry.core.empty() ? geometry.vertices : geometry.core;
    if (geometry.core.empty()) {
      for (const auto& t : geometry.triangles) out.push_back({points[t[0]], points[t[1]], points[t[2]]});
    } else {
      out.push_back({points[0], points[1], points[2]});
    }
    rounding = geometry.rounding;
    tree = TriangleTree(std::move(out));
    geometry = {};
  }
};

ShapeSurface::ShapeSurface(std::unique_ptr<Source> source) : source_(std::move(source)) {}
ShapeSurface::~ShapeSurface() = default;

double ShapeSurface::distance(const ShapeSurface& other, const Pose& X_AB, double far, double enough) const {
  const TriangleTree &mine = source_->triangles(), &theirs = other.source_->triangles();
  if (!source_->readable || !other.source_->readable) return 0;
  const double rounding = source_->rounding + other.source_->rounding;
  return std::min(mine.distance(theirs, X_AB, far + rounding, enough + rounding) - rounding, far);
}

namespace {

constexpr double kMinShape = 1e-6;  // m

// One shape of a link: what the scene judges, and its frame.
struct JudgedShape {
  std::optional<MeshGeometry> mesh;  // a file, and not its hull
  CollisionShape shape;
  Pose X_LG = Pose::Identity();
  double weight = 0;  // m: its share of the spheres

  [[nodiscard]] CoverGeometry geometry() const {
    return mesh ? cover_geometry(load_mesh(*mesh)) : cover_geometry(shape);
  }
};

double extent_of(const CollisionShape& shape) {
  Eigen::AlignedBox3d box;
  if (const auto* hull = std::get_if<SharedHull>(&shape.geometry)) {
    for (const Eigen::Vector3f& p : (*hull)->vertices) box.extend(p.cast<double>());
  } else {
    const CoverGeometry geometry = cover_geometry(shape);
    for (const Eigen::Vector3d& p : geometry.vertices) box.extend(p);
    if (geometry.ball) return kMinShape;
  }
  const Eigen::Vector3d s = box.sizes().cwiseMax(kMinShape);
  return std::sqrt(s.x() * s.y() + s.y() * s.z() + s.z() * s.x());
}

std::vector<JudgedShape> judged_shapes(const SceneInstance& instance, std::size_t link,
                                       CollisionDetail detail) {
  std::vector<JudgedShape> out;
  for (const CollisionShape& shape : instance.shapes.at(link)) {
    JudgedShape judged{std::nullopt, shape, shape.X_LS};
    if (detail == CollisionDetail::triangles && instance.description != nullptr &&
        instance.model != nullptr && !std::holds_alternative<SharedField>(shape.geometry)) {
      const Link* const source = instance.description->find_link(instance.model->links[link].name);
      const Collision& collision = source->collisions.at(static_cast<std::size_t>(shape.id.collision));
      if (const auto* mesh = std::get_if<MeshGeometry>(&collision.geometry)) {
        judged.mesh = *mesh;
        judged.X_LG = collision.origin.pose();
      }
    }
    judged.weight = extent_of(shape);
    out.push_back(std::move(judged));
  }
  return out;
}

std::optional<CollisionShape> formula_of(const CollisionShape& shape) {
  return std::visit(Overloaded{[](const Ellipsoid&) { return std::optional<CollisionShape>(); },
                               [](const SharedHull&) { return std::optional<CollisionShape>(); },
                               [](const SharedField& field) -> std::optional<CollisionShape> {
                                 const CoverGeometry box = cover_geometry(CollisionShape{field});
                                 const Eigen::Vector3d low = box.vertices.front(), high = box.vertices.back();
                                 CollisionShape out{Box{high - low}};
                                 out.X_LS.translation() = (low + high) / 2;
                                 return out;
                               },
                               [&](const auto& primitive) -> std::optional<CollisionShape> {
                                 return CollisionShape{primitive};
                               }},
                    shape.geometry);
}

std::string bytes_of_cover(const SphereCover& cover) {
  std::string out;
  const auto put = [&](double number) { out.append(reinterpret_cast<const char*>(&number), sizeof number); };
  put(cover.closed ? 1 : 0);
  for (std::size_t level = 0; level < cover.levels.size(); ++level) {
    put(cover.excess[level]);
    put(static_cast<double>(cover.levels[level].size()));
    for (const CoverSphere& s : cover.levels[level]) {
      for (const double number : {s.centre.x(), s.centre.y(), s.centre.z(), s.radius}) put(number);
    }
  }
  return out;
}

std::optional<SphereCover> cover_of_bytes(std::string_view bytes) {
  std::vector<double> numbers(bytes.size() / sizeof(double));
  std::memcpy(numbers.data(), bytes.data(), numbers.size() * sizeof(double));
  std::size_t place = 0;
  const auto next = [&] { return place < numbers.size() ? numbers[place++] : 0; };
  SphereCover out;
  out.closed = next() != 0;
  for (std::size_t level = 0; level < out.levels.size(); ++level) {
    out.excess[level] = next();
    const double count = next();
    if (!(count >= 0) || count * 4 > static_cast<double>(numbers.size() - place)) return std::nullopt;
    for (int i = 0; i < static_cast<int>(count); ++i) {
      const double x = next(), y = next(), z = next();
      out.levels[level].push_back({{x, y, z}, next()});
    }
  }
  return place == numbers.size() ? std::optional(std::move(out)) : std::nullopt;
}

// A file has that of mesh_cache.h, another shape a hash of its numbers.
std::string fingerprint_of(const JudgedShape& judged, const CoverGeometry* geometry) {
  if (judged.mesh) return mesh_fingerprint(judged.mesh->path);
  std::uint64_t hash = 0xcbf29ce484222325ULL;  // FNV-1a, 64 bits
  for (const Eigen::Vector3d& p : geometry->vertices) {
    for (const double number : p) hash = (hash ^ std::bit_cast<std::uint64_t>(number)) * 0x100000001b3ULL;
  }
  return fmt::format("shape {} {:016x}\n", geometry->vertices.size(), hash);
}

SphereCover cover_of(const JudgedShape& judged, const CoverBudget& budget, bool cache) {
  if (!cache) return make_cover(judged.geometry(), budget);
  std::optional<CoverGeometry> geometry;
  if (!judged.mesh) {
    geometry = judged.geometry();
    if (geometry->ball) return make_cover(*geometry, budget);
  }
  const MeshGeometry mesh = judged.mesh.value_or(MeshGeometry{});
  const std::string fingerprint = fingerprint_of(judged, geometry ? &*geometry : nullptr);
  const std::string kind =
      fmt::format("doppel sphere cover 1\n{} {} {}\n{} {}\n{} {}\n", mesh.scale.x(), mesh.scale.y(),
                  mesh.scale.z(), mesh.submesh, mesh.center_submesh, budget.coarse, budget.fine);
  if (const auto stored = cached_result(fingerprint, kind)) {
    if (auto cover = cover_of_bytes(*stored)) return std::move(*cover);
  }
  SphereCover cover = make_cover(geometry ? *geometry : judged.geometry(), budget);
  cache_result(fingerprint, kind, bytes_of_cover(cover));
  return cover;
}

// The sphere around something that needs no others.
SphereCover bound_of(const CoverGeometry& geometry) {
  SphereCover out;
  if (geometry.ball) {
    out.levels[0] = {*geometry.ball};
    return out;
  }
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& p : geometry.vertices) box.extend(p);
  out.levels[0] = {{box.center(), box.sizes().norm() / 2}};
  return out;
}

}  // namespace

std::shared_ptr<const InstanceCovers> make_covers(const SceneInstance& instance,
                                                  const CoverOptions& options) {
  std::vector<std::vector<JudgedShape>> shapes;
  double sum = 0;
  for (std::size_t link = 0; link < instance.shapes.size(); ++link) {
    shapes.push_back(judged_shapes(instance, link, options.detail));
    for (const JudgedShape& judged : shapes.back()) sum += judged.weight;
  }
  auto out = std::make_shared<InstanceCovers>();
  for (const auto& of_link : shapes) {
    out->emplace_back();
    for (const JudgedShape& judged : of_link) {
      ShapeCover result;
      result.X_LG = judged.X_LG;
      if (!judged.mesh) result.formula = formula_of(judged.shape);
      const auto share = [&](int all) { return std::max(1, static_cast<int>(all * judged.weight / sum)); };
      result.cover =
          result.formula && options.still
              ? bound_of(cover_geometry(judged.shape))
              : cover_of(judged, {share(options.budget.coarse), share(options.budget.fine)}, options.cache);
      auto source = std::make_unique<ShapeSurface::Source>();
      if (judged.mesh) {
        source->mesh = judged.mesh;
      } else {
        source->geometry = cover_geometry(judged.shape);
      }
      result.surface = std::make_shared<const ShapeSurface>(std::move(source));
      out->back().push_back(std::move(result));
    }
  }
  return out;
}

std::vector<PlacedGeometry> link_geometry(const SceneInstance& instance, int link, CollisionDetail detail) {
  std::vector<PlacedGeometry> out;
  for (const JudgedShape& judged : judged_shapes(instance, static_cast<std::size_t>(link), detail))
    out.push_back({judged.geometry(), judged.X_LG});
  return out;
}

}  // namespace doppel
