#include "doppel/robot/collision/collision_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <stdexcept>

#include "doppel/base/core/overloaded.h"
#include "doppel/base/core/plugin_module.h"
#include "doppel/description/meshes/mesh.h"
#include "doppel/description/meshes/shape_mesh.h"
#include "doppel/robot/collision/detail/field_distance.h"
#include "doppel/robot/collision/detail/scene_bodies.h"
#include "doppel/robot/collision/detail/surface.h"
#include "doppel/robot/collision/link_pairs.h"

namespace doppel {
namespace {

ConvexPoints points_of(const std::vector<Eigen::Vector3f>& vertices) {
  ConvexPoints out;
  out.vertices.resize(3, static_cast<Eigen::Index>(vertices.size()));
  for (std::size_t i = 0; i < vertices.size(); ++i)
    out.vertices.col(static_cast<Eigen::Index>(i)) = vertices[i].cast<double>();
  return out;
}

ConvexPoints bounds_of(const HeightField& field) {
  const auto [low, high] = std::ranges::minmax(field.heights);
  ConvexPoints out;
  out.vertices.resize(3, 8);
  for (int i = 0; i < 8; ++i) {
    out.vertices.col(i) << (i & 1 ? 0.5 : -0.5) * field.size.x(), (i & 2 ? 0.5 : -0.5) * field.size.y(),
        i & 4 ? high : low - kSolidBelow;
  }
  return out;
}

ConvexShape convex_shape(const CollisionShape& shape) {
  return std::visit(
      Overloaded{[](const SharedHull& hull) -> ConvexShape { return points_of(hull->vertices); },
                 [](const SharedField& field) -> ConvexShape { return bounds_of(*field); },
                 [](const auto& primitive) -> ConvexShape { return primitive; }},
      shape.geometry);
}

// The sphere around a mesh, which a reduced hull does not give, and its vertices.
void bound_by_mesh(const TriangleMesh& mesh, SolidShape& shape) {
  ConvexPoints whole = points_of(mesh.vertices);
  whole.vertices = shape.X_SG * whole.vertices;
  shape.vertices = std::make_shared<const Eigen::Array<float, Eigen::Dynamic, 3>>(
      whole.vertices.transpose().cast<float>());
  const ConvexSolid bounded(std::move(whole));
  shape.solid.centre = bounded.centre;
  shape.solid.radius = bounded.radius;
}

// The surface of a shape whose geometry is in a frame G of the link. `triangles`: of a mesh, and of what FCL
// has no primitive for.
void set_surface(const Geometry& geometry, const TriangleMesh* triangles, bool is_mesh, const Pose& X_LG,
                 SolidShape& shape) {
  shape.is_mesh = is_mesh;
  shape.X_SG = shape.X_LS.inverse(Eigen::Isometry) * X_LG;
  if (is_mesh) bound_by_mesh(*triangles, shape);
  const SurfaceFunctions& functions = surface_functions();
  shape.surface = {functions.make(geometry, triangles), functions.discard};
}

// The surface of a description's shape.
void add_described_surface(const RobotDescription& robot, const std::string& link, SolidShape& shape) {
  const Collision& collision =
      robot.find_link(link)->collisions.at(static_cast<std::size_t>(shape.id.collision));
  if (std::holds_alternative<Plane>(collision.geometry)) return;  // it collides as a slab
  const auto* const mesh = std::get_if<MeshGeometry>(&collision.geometry);
  const std::optional<TriangleMesh> triangles =
      mesh != nullptr ? std::optional(load_mesh(*mesh)) : convex_surface(collision.geometry);
  set_surface(collision.geometry, triangles ? &*triangles : nullptr, mesh != nullptr, collision.origin.pose(),
              shape);
}

// The surface of a shape that has its triangles with it, or is a primitive. Hulls stay hulls.
void add_own_surface(const CollisionShape& source, SolidShape& shape) {
  if (source.triangles != nullptr)
    return set_surface(MeshGeometry{}, source.triangles.get(), true, source.X_LG, shape);
  std::visit(Overloaded{[](const SharedHull&) {}, [](const SharedField&) {}, [](const Ellipsoid&) {},
                        [&shape](const auto& primitive) {
                          set_surface(primitive, nullptr, false, shape.X_LS, shape);
                        }},
             source.geometry);
}

// The sphere around all shapes of a body, for the first test of a pair: about the centre of the box that
// contains the shapes' spheres.
void bound(CollidingBody& body) {
  Eigen::AlignedBox3d box;
  for (const SolidShape& shape : body.shapes) {
    const Eigen::Vector3d centre = shape.X_LS * shape.solid.centre;
    box.extend(Eigen::Vector3d(centre.array() - shape.solid.radius));
    box.extend(Eigen::Vector3d(centre.array() + shape.solid.radius));
  }
  body.centre = box.center();
  for (const SolidShape& shape : body.shapes) {
    const double reach = (shape.X_LS * shape.solid.centre - body.centre).norm() + shape.solid.radius;
    body.radius = std::max(body.radius, reach);
  }
}

// Tested pairs that are among `pairs` become allowed ones.
void allow_pairs(CollisionScene::Impl& scene, const std::vector<AllowedPair>& pairs) {
  std::map<std::pair<BodyId, BodyId>, const std::string*> reasons;
  for (const AllowedPair& pair : pairs) reasons.try_emplace(std::minmax(pair.a, pair.b), &pair.reason);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < scene.tested.size(); ++i) {
    const auto& [a, b] = scene.tested[i];
    if (const auto found = reasons.find({a, b}); found != reasons.end()) {
      scene.allowed.push_back({a, b, *found->second});
      continue;
    }
    scene.tested[kept] = scene.tested[i];
    scene.tested_bodies[kept++] = scene.tested_bodies[i];
  }
  scene.tested.resize(kept);
  scene.tested_bodies.resize(kept);
  std::ranges::sort(scene.allowed, {}, [](const AllowedPair& pair) { return std::pair(pair.a, pair.b); });
}

class SceneBuilder {
 public:
  SceneBuilder(std::vector<SceneInstance> instances, const SceneOptions& options) : options_(options) {
    out_.instances = std::move(instances);
  }

  CollisionScene::Impl build() {
    if (options_.ground) {
      out_.ground = 0;
      out_.bodies.emplace_back();
    }
    // Bodies first, because a held object names links of an instance before it.
    for (std::size_t i = 0; i < out_.instances.size(); ++i) add_bodies(static_cast<int>(i));
    for (std::size_t i = 0; i < out_.instances.size(); ++i) allow_pairs_of(static_cast<int>(i));
    divide_pairs();
    allow_pairs(out_, options_.allowed);
    return std::move(out_);
  }

 private:
  void add_bodies(int index) {
    const SceneInstance& instance = out_.instances[static_cast<std::size_t>(index)];
    const std::size_t links = instance.model == nullptr ? 1 : instance.model->links.size();
    if (instance.shapes.size() != links)
      throw std::invalid_argument(fmt::format("the shapes of '{}' are of {} links; it has {}", instance.name,
                                              instance.shapes.size(), links));
    if (instance.held && !(instance.held->holder.instance < index))
      throw std::invalid_argument(
          fmt::format("'{}' is held by an instance that is not before it", instance.name));
    groups_.push_back(instance.model == nullptr ? std::vector<int>{0} : rigid_groups(*instance.model));
    out_.body_of.emplace_back(links, -1);
    for (std::size_t link = 0; link < links; ++link) {
      if (instance.shapes[link].empty()) continue;
      CollidingBody body;
      body.id = {index, static_cast<int>(link)};
      body.index = out_.bodies.size();
      body.first_shape = out_.shapes;
      for (const CollisionShape& shape : instance.shapes[link])
        body.shapes.push_back(solid_of(instance, shape));
      bound(body);
      out_.shapes += body.shapes.size();
      out_.body_of.back()[link] = static_cast<int>(body.index);
      out_.bodies.push_back(std::move(body));
    }
  }

  [[nodiscard]] SolidShape solid_of(const SceneInstance& instance, const CollisionShape& shape) const {
    SolidShape out{shape.id, shape.X_LS, ConvexSolid(convex_shape(shape))};
    if (const auto* field = std::get_if<SharedField>(&shape.geometry)) out.field = *field;
    if (options_.detail != CollisionDetail::triangles || out.field != nullptr) return out;
    if (instance.description != nullptr && instance.model != nullptr) {
      const auto link = static_cast<std::size_t>(shape.id.link);
      add_described_surface(*instance.description, instance.model->links.at(link).name, out);
    } else {
      add_own_surface(shape, out);
    }
    return out;
  }

  void allow(BodyId a, BodyId b, const std::string& reason) {
    allowed_.try_emplace(std::minmax(a, b), reason);
  }

  void allow_pairs_of(int index) {
    const SceneInstance& instance = out_.instances[static_cast<std::size_t>(index)];
    if (instance.model != nullptr) {
      for (const LinkPair& pair : link_pairs(*instance.model, instance.shapes, instance.self_collision)) {
        if (!pair.reason.empty()) allow({index, pair.a}, {index, pair.b}, pair.reason);
      }
    }
    // A held object may touch the link that holds it, all links that are fixed to that one, and the named
    // touch links.
    if (!instance.held) return;
    const BodyId holder = instance.held->holder;
    const std::vector<int>& groups = groups_.at(static_cast<std::size_t>(holder.instance));
    const std::vector<int>& touch = instance.held->touch_links;
    for (int link = 0; link < static_cast<int>(groups.size()); ++link) {
      const bool joined =
          groups[static_cast<std::size_t>(link)] == groups.at(static_cast<std::size_t>(holder.link));
      if (!joined && std::ranges::find(touch, link) == touch.end()) continue;
      for (std::size_t shape = 0; shape < instance.shapes.size(); ++shape) {
        allow({index, static_cast<int>(shape)}, {holder.instance, link},
              joined ? fmt::format("held by {}", name_of(holder)) : "a touch link");
      }
    }
  }

  [[nodiscard]] const std::string& name_of(BodyId body) const {
    const SceneInstance& instance = out_.instances[static_cast<std::size_t>(body.instance)];
    return instance.model == nullptr ? instance.name
                                     : instance.model->links[static_cast<std::size_t>(body.link)].name;
  }

  // The ground is fixed, too.
  [[nodiscard]] bool fixed(BodyId body) const {
    if (body.is_ground()) return true;
    const auto index = static_cast<std::size_t>(body.instance);
    return !out_.instances[index].moves && !out_.instances[index].held &&
           groups_[index][static_cast<std::size_t>(body.link)] == 0;
  }

  void divide_pairs() {
    // Every pair of bodies is either tested or has the reason why it is not.
    for (std::size_t i = 0; i < out_.bodies.size(); ++i) {
      for (std::size_t k = i + 1; k < out_.bodies.size(); ++k) {
        const std::pair<BodyId, BodyId> pair{out_.bodies[i].id, out_.bodies[k].id};
        if (const auto found = allowed_.find(pair); found != allowed_.end()) {
          out_.allowed.push_back({pair.first, pair.second, found->second});
        } else if (fixed(pair.first) && fixed(pair.second)) {
          out_.allowed.push_back({pair.first, pair.second, "both fixed to the world"});
        } else {
          out_.tested.push_back(pair);
          out_.tested_bodies.emplace_back(static_cast<int>(i), static_cast<int>(k));
        }
      }
    }
  }

  const SceneOptions& options_;
  CollisionScene::Impl out_;
  std::vector<std::vector<int>> groups_;  // [instances][links]
  std::map<std::pair<BodyId, BodyId>, std::string> allowed_;
};

}  // namespace

double SolidShape::extent(const Eigen::Vector3d& d) const {
  const double of_solid = solid.support(d).dot(d) + solid.rounding;
  if (vertices == nullptr || vertices->rows() == 0) return of_solid;
  const Eigen::Vector3f n = d.cast<float>();
  // Products and sums of single precision are wrong by less than 6e-7 of a coordinate.
  const float most =
      (n.x() * vertices->col(0) + n.y() * vertices->col(1) + n.z() * vertices->col(2)).maxCoeff();
  return std::max(of_solid, static_cast<double>(most)) + 6e-7 * (solid.centre.norm() + solid.radius);
}

const SurfaceFunctions& surface_functions() {
  using Entry = const SurfaceFunctions* (*)();
  static const SurfaceFunctions* const functions =
      reinterpret_cast<Entry>(plugin_symbol(kSurfaceModule, kSurfaceEntry))();
  return *functions;
}

SceneInstance described_robot(const RobotDescription& robot, const Model& model) {
  CollisionMeshes meshes(MeshSource::report);
  Diagnostics ignored;  // `check` has rules for shapes
  SceneInstance out;
  out.name = robot.name;
  out.model = std::make_shared<const Model>(model);
  out.shapes = link_shapes(robot, model, MeshUse::hull, meshes, ignored);
  out.description = &robot;
  return out;
}

CollisionScene::CollisionScene(std::vector<SceneInstance> instances, SceneOptions options)
    : impl_(std::make_unique<const Impl>(SceneBuilder(std::move(instances), options).build())) {}

CollisionScene::CollisionScene(Impl impl) : impl_(std::make_unique<const Impl>(std::move(impl))) {}

CollisionScene::~CollisionScene() = default;

std::shared_ptr<const CollisionScene> CollisionScene::allowing(const std::vector<AllowedPair>& pairs) const {
  Impl copy = *impl_;
  allow_pairs(copy, pairs);
  return std::make_shared<const CollisionScene>(std::move(copy));
}

const std::vector<SceneInstance>& CollisionScene::instances() const {
  return impl_->instances;
}

bool CollisionScene::has_shape(BodyId body) const {
  return impl_->find(body) >= 0;
}

const std::vector<std::pair<BodyId, BodyId>>& CollisionScene::tested_pairs() const {
  return impl_->tested;
}

const std::vector<AllowedPair>& CollisionScene::allowed_pairs() const {
  return impl_->allowed;
}

}  // namespace doppel
