#include "doppel/robot/collision/link_shapes.h"

#include <fmt/format.h>

#include <algorithm>

#include "doppel/description/meshes/mesh.h"
#include "doppel/description/meshes/shape_mesh.h"
#include "doppel/robot/collision/detail/contact_friction.h"
#include "doppel/robot/collision/detail/mesh_parts.h"
#include "doppel/robot/collision/size_limits.h"

namespace doppel {
namespace {

// A plane collides as a slab below it.
constexpr double kPlaneSide = 100.0, kPlaneDepth = 1.0;  // m, at least

}  // namespace

CollisionShape collision_shape(const Geometry& geometry, const CollisionMesh* mesh, const Pose& X_LG,
                               const Friction& friction) {
  CollisionShape out{Box{}, X_LG, friction};
  if (mesh != nullptr) {
    if (mesh->hull != nullptr) {
      out.geometry = mesh->hull;
    } else {
      out.geometry = Box{mesh->box_size};
      out.X_LS = X_LG * mesh->X_GB;
    }
  } else if (const auto* plane = std::get_if<Plane>(&geometry)) {
    const Eigen::Vector2d sides = plane->size.cwiseMax(kPlaneSide).cwiseMin(kMaxShapeSize);
    out.geometry = Box{{sides.x(), sides.y(), kPlaneDepth}};
    out.X_LS = X_LG * Pose(rotation_from_z(plane->normal)) * Eigen::Translation3d(0, 0, -kPlaneDepth / 2);
  } else {
    std::visit(
        [&](const auto& primitive) {
          if constexpr (requires { out.geometry = primitive; }) {
            out.geometry = primitive;
          } else if (const auto convex = convex_surface(geometry)) {
            out.geometry = std::make_shared<const CollisionHull>(CollisionHull{convex->vertices});
          }
        },
        geometry);
  }
  return out;
}

namespace {

class ShapeReader {
 public:
  ShapeReader(const RobotDescription& robot, const Model& model, MeshUse use, CollisionMeshes& meshes,
              Diagnostics& diagnostics)
      : robot_(robot), model_(model), use_(use), meshes_(meshes), diagnostics_(diagnostics) {}

  std::vector<CollisionShape> shapes_of(int index, const Link& link) {
    const ContactSurface of_link = surface_of(robot_, link.name);
    const bool as_described = !contact_shape_of(robot_, link).empty();
    std::vector<CollisionShape> out;
    for (std::size_t k = 0; k < link.collisions.size(); ++k) {
      const Collision& collision = link.collisions[k];
      if (!has_size(collision.geometry)) {
        diagnostics_.warning(
            "physics.empty_shape", collision.source,
            fmt::format("a collision shape of link '{}' has no size and collides with nothing", link.name),
            "write positive sizes, m");
        continue;
      }
      if (size_span(collision.geometry).most > kMaxShapeSize || is_scaled_badly(collision.geometry))
        check_sizes(collision.geometry, "physics.size", collision.source, diagnostics_);
      const ContactSurface surface = overlaid(of_link, collision.surface);
      const Friction friction = friction_of(surface, model_, collision, diagnostics_);
      const std::optional<double> restitution = restitution_of(surface, collision, diagnostics_);
      const std::size_t first = out.size();
      add_shapes(link, collision, friction, out);
      for (std::size_t i = first; i < out.size(); ++i) {
        check_mesh_size(collision, out[i]);
        out[i].restitution = restitution;
        out[i].id = {index, static_cast<int>(k), static_cast<int>(i - first)};
        out[i].source = collision.source;
        out[i].as_described = as_described;
      }
    }
    return out;
  }

 private:
  void add_shapes(const Link& link, const Collision& collision, const Friction& friction,
                  std::vector<CollisionShape>& out) {
    const CollisionMesh* mesh = nullptr;
    if (const auto* map = std::get_if<Heightmap>(&collision.geometry)) {
      add_terrain(link, collision, *map, friction, out);
      return;
    }
    if (const auto* geometry = std::get_if<MeshGeometry>(&collision.geometry)) {
      if (use_ != MeshUse::hull) {
        add_parts(link, collision, *geometry, friction, out);
        return;
      }
      mesh = mesh_of(link, collision, *geometry);
      if (mesh == nullptr) return;
    }
    out.push_back(collision_shape(collision.geometry, mesh, collision.origin.pose(), friction));
  }

  static bool is_scaled_badly(const Geometry& geometry) {
    const auto* const mesh = std::get_if<MeshGeometry>(&geometry);
    return mesh != nullptr && !(mesh->scale.cwiseAbs().maxCoeff() <= kMaxShapeSize);
  }

  // A mesh gives its hull, or the box that replaces a flat one.
  void check_mesh_size(const Collision& collision, const CollisionShape& shape) {
    if (!std::holds_alternative<MeshGeometry>(collision.geometry)) return;
    double distance = shape.X_LS.translation().cwiseAbs().maxCoeff();
    if (const auto* const box = std::get_if<Box>(&shape.geometry)) {
      distance = std::max(distance, box->size.maxCoeff());
    } else if (const auto* const hull = std::get_if<SharedHull>(&shape.geometry); hull != nullptr && *hull) {
      for (const Eigen::Vector3f& p : (*hull)->vertices)
        distance = std::max(distance, static_cast<double>(p.cwiseAbs().maxCoeff()));
    }
    check_range("distance of a vertex from the mesh's origin", distance, 0, kMaxShapeSize, "m",
                "physics.size", collision.source, diagnostics_);
  }

  // A terrain without heights was reported when it was read.
  void add_terrain(const Link& link, const Collision& collision, const Heightmap& map,
                   const Friction& friction, std::vector<CollisionShape>& out) {
    if (map.field == nullptr) return;
    if (use_ == MeshUse::still) {
      out.push_back({map.field, collision.origin.pose(), friction});
      return;
    }
    diagnostics_.warning(
        "physics.moving_heightmap", collision.source,
        fmt::format("the heightmap of link '{}' collides with nothing, because its model may move",
                    link.name),
        "write <static>true</static>");
  }

  void add_parts(const Link& link, const Collision& collision, const MeshGeometry& geometry,
                 const Friction& friction, std::vector<CollisionShape>& out) {
    if (geometry.path.empty()) return;
    MeshParts decomposition;
    try {
      const TriangleMesh mesh = load_mesh(geometry);
      decomposition = use_ == MeshUse::still ? static_parts(mesh) : moving_parts(mesh);
    } catch (const InputError& error) {
      return leave_out(link, collision, error);
    }
    for (const std::vector<Eigen::Vector3f>& part : decomposition.parts) {
      const CollisionMesh solid = make_collision_mesh(part);
      out.push_back(collision_shape(geometry, &solid, collision.origin.pose(), friction));
    }
    if (decomposition.filled > 0 && use_ == MeshUse::still) {
      diagnostics_.note(
          "physics.filled_mesh", collision.source,
          fmt::format("{} of the {} parts of the mesh '{}' of link '{}' have more than {} triangles and are "
                      "not convex; they collide as their convex hulls",
                      decomposition.filled, decomposition.parts.size(), geometry.uri, link.name,
                      kMaxShellTriangles),
          "give the collision a simpler mesh, or boxes");
    }
    if (decomposition.joined > 0) {
      diagnostics_.note(
          "physics.filled_mesh", collision.source,
          fmt::format("the mesh '{}' of link '{}', which moves, has {} connected surfaces, more "
                      "than {}; it collides as one convex hull",
                      geometry.uri, link.name, decomposition.joined, kMaxMovingParts),
          "give the collision a simpler mesh, or boxes");
    }
  }

  // A shape that cannot be read collides with nothing.
  void leave_out(const Link& link, const Collision& collision, const InputError& error) {
    for (Diagnostic diagnostic : error.diagnostics()) {
      diagnostic.severity = Severity::warning;
      diagnostic.message += fmt::format("; this shape of link '{}' collides with nothing", link.name);
      if (!diagnostic.where.known()) diagnostic.where = collision.source;
      diagnostics_.add(std::move(diagnostic));
    }
  }

  const CollisionMesh* mesh_of(const Link& link, const Collision& collision, const MeshGeometry& geometry) {
    try {
      return meshes_.find(geometry, fmt::format("link '{}'", link.name), collision.source, diagnostics_);
    } catch (const InputError& error) {
      leave_out(link, collision, error);
      return nullptr;
    }
  }

  const RobotDescription& robot_;
  const Model& model_;
  MeshUse use_;
  CollisionMeshes& meshes_;
  Diagnostics& diagnostics_;
};

}  // namespace

LinkShapes link_shapes(const RobotDescription& robot, const Model& model, MeshUse use,
                       CollisionMeshes& meshes, Diagnostics& diagnostics) {
  LinkShapes out(model.links.size());
  ShapeReader reader(robot, model, use, meshes, diagnostics);
  for (std::size_t i = 0; i < model.links.size(); ++i) {
    const Link* const link = robot.find_link(model.links[i].name);
    // A floating base was given a link "world", which the description does not have.
    if (link != nullptr) out[i] = reader.shapes_of(static_cast<int>(i), *link);
  }
  return out;
}

}  // namespace doppel
