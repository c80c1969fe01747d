#include "doppel/physics/contract/model_instance.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "doppel/base/math/mass_properties.h"
#include "doppel/description/meshes/mesh.h"
#include "doppel/description/meshes/shape_mesh.h"
#include "doppel/physics/contract/detail/contact_friction.h"
#include "doppel/physics/contract/detail/mesh_parts.h"
#include "doppel/physics/contract/size_limits.h"

namespace doppel {
namespace {

constexpr const char* kObjectLink = "link";
// Engines reject bodies of about 1e-15 kg, and no measured quantity distinguishes a smaller mass from zero.
constexpr double kMinMass = 1e-9;  // kg

// A plane collides as a slab below it.
constexpr double kPlaneSide = 100.0, kPlaneDepth = 1.0;  // m, at least

// Of a primitive, or of a mesh that was loaded.
CollisionShape shape_of(const Geometry& geometry, const CollisionMesh* mesh, const Pose& X_LG,
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

// What of a mesh collides: the hull of a robot's link, the triangles of what stands still in a world, or the hulls of
// the connected surfaces of what moves in it.
enum class MeshUse { hull, still, moving };

class ShapeReader {
 public:
  ShapeReader(CollisionMeshes& meshes, Diagnostics& diagnostics)
      : meshes_(meshes), diagnostics_(diagnostics) {}

  std::vector<CollisionShape> shapes_of(const RobotDescription& robot, const Model& model, const Link& link,
                                        MeshUse use) {
    const ContactSurface of_link = surface_of(robot, link.name);
    std::vector<CollisionShape> out;
    for (const Collision& collision : link.collisions) {
      if (!has_size(collision.geometry)) {
        diagnostics_.warning(
            "physics.empty_shape", collision.source,
            fmt::format("a collision shape of link '{}' has no size and collides with nothing", link.name),
            "write positive sizes, m");
        continue;
      }
      if (size_span(collision.geometry).most > kMaxShapeSize || is_scaled_badly(collision.geometry))
        check_sizes(collision.geometry, "physics.size", collision.source, errors_);
      const Friction friction =
          friction_of(overlaid(of_link, collision.surface), model, collision, diagnostics_);
      const std::optional<double> restitution =
          restitution_of(overlaid(of_link, collision.surface), collision, diagnostics_);
      const std::size_t first = out.size();
      add_shapes(link, collision, friction, use, out);
      for (std::size_t i = first; i < out.size(); ++i) {
        check_mesh_size(collision, out[i]);
        out[i].restitution = restitution;
      }
    }
    return out;
  }

  // Throws InputError with all sizes that are too large.
  void throw_if_errors() { errors_.throw_if_errors(); }

 private:
  void add_shapes(const Link& link, const Collision& collision, const Friction& friction, MeshUse use,
                  std::vector<CollisionShape>& out) {
    const CollisionMesh* mesh = nullptr;
    if (const auto* map = std::get_if<Heightmap>(&collision.geometry)) {
      add_terrain(link, collision, *map, friction, use, out);
      return;
    }
    if (const auto* geometry = std::get_if<MeshGeometry>(&collision.geometry)) {
      if (use != MeshUse::hull) {
        add_parts(link, collision, *geometry, friction, use, out);
        return;
      }
      mesh = mesh_of(link, collision, *geometry);
      if (mesh == nullptr) return;
    }
    out.push_back(shape_of(collision.geometry, mesh, collision.origin.pose(), friction));
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
                "physics.size", collision.source, errors_);
  }

  // A terrain without heights was reported when it was read.
  void add_terrain(const Link& link, const Collision& collision, const Heightmap& map,
                   const Friction& friction, MeshUse use, std::vector<CollisionShape>& out) {
    if (map.field == nullptr) return;
    if (use == MeshUse::still) {
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
                 const Friction& friction, MeshUse use, std::vector<CollisionShape>& out) {
    if (geometry.path.empty()) return;
    MeshParts made;
    try {
      const TriangleMesh mesh = load_mesh(geometry);
      made = use == MeshUse::still ? static_parts(mesh) : moving_parts(mesh);
    } catch (const InputError& error) {
      return leave_out(link, collision, error);
    }
    for (const std::vector<Eigen::Vector3f>& part : made.parts) {
      const CollisionMesh solid = make_collision_mesh(part);
      out.push_back(shape_of(geometry, &solid, collision.origin.pose(), friction));
    }
    if (made.filled > 0 && use == MeshUse::still) {
      diagnostics_.note(
          "physics.filled_mesh", collision.source,
          fmt::format("{} of the {} parts of the mesh '{}' of link '{}' have more than {} triangles and are "
                      "not convex; they collide as their convex hulls",
                      made.filled, made.parts.size(), geometry.uri, link.name, kMaxShellTriangles),
          "give the collision a simpler mesh, or boxes");
    }
    if (made.joined > 0) {
      diagnostics_.note(
          "physics.filled_mesh", collision.source,
          fmt::format("the mesh '{}' of link '{}', which moves, has {} connected surfaces, more "
                      "than {}; it collides as one convex hull",
                      geometry.uri, link.name, made.joined, kMaxMovingParts),
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

  CollisionMeshes& meshes_;
  Diagnostics& diagnostics_;
  Diagnostics errors_;
};

// Side lengths of the box with about the same inertia, and its centre.
struct SolidBox {
  Eigen::Vector3d size = Eigen::Vector3d::Ones(), centre = Eigen::Vector3d::Zero();
};

SolidBox solid_box(const Geometry& shape, const CollisionMesh* mesh) {
  SolidBox out;
  if (const auto* box = std::get_if<Box>(&shape)) {
    out.size = box->size;
  } else if (const auto* c = std::get_if<Cylinder>(&shape)) {
    out.size = {std::sqrt(3.0) * c->radius, std::sqrt(3.0) * c->radius, c->length};
  } else if (const auto* k = std::get_if<Capsule>(&shape)) {
    out.size = {std::sqrt(3.0) * k->radius, std::sqrt(3.0) * k->radius, k->length + 4.0 / 3.0 * k->radius};
  } else if (const auto* s = std::get_if<Sphere>(&shape)) {
    out.size = Eigen::Vector3d::Constant(std::sqrt(2.4) * s->radius);
  } else if (mesh != nullptr && mesh->hull == nullptr) {
    out.size = mesh->box_size;
  } else if (mesh != nullptr) {
    Eigen::AlignedBox3f bounds;
    for (const Eigen::Vector3f& p : mesh->hull->vertices) bounds.extend(p);
    out.size = bounds.sizes().cast<double>();
    out.centre = bounds.center().cast<double>();
  }
  return out;
}

MassProperties object_inertia(const WorldObject& object, const CollisionMesh* mesh) {
  const SolidBox box = solid_box(object.shape, mesh);
  MassProperties body{object.mass, box.centre, Eigen::Matrix3d::Zero()};
  const Eigen::Vector3d squares = box.size.cwiseAbs2() * (object.mass / 12.0);
  body.I.diagonal() << squares.y() + squares.z(), squares.x() + squares.z(), squares.x() + squares.y();
  return transformed(body, object.X_OS);
}

void check(const WorldObject& object) {
  if (!has_size(object.shape)) {
    throw InputError("world.size", object.source, fmt::format("object '{}' has no size", object.name),
                     "write positive sizes, m");
  }
  if (object.mass != 0 && !(object.mass >= kMinMass) && std::isfinite(object.mass)) {
    throw InputError(
        "world.mass", object.source,
        fmt::format("object '{}' has a mass of {:g} kg, which cannot be simulated", object.name, object.mass),
        "write its mass in kg, or 0 to fix it to the world");
  }
  if (!object.X_WO.matrix().allFinite() || !object.X_OS.matrix().allFinite() || !std::isfinite(object.mass) ||
      !std::isfinite(object.friction) || !std::isfinite(object.restitution.value_or(0.0))) {
    throw InputError(
        "world.not_finite", object.source,
        fmt::format("the pose, mass, friction or restitution of object '{}' is not a finite number",
                    object.name));
  }
}

RobotDescription description_of(const WorldObject& object) {
  Link link;
  link.name = kObjectLink;
  Origin origin;
  origin.xyz = object.X_OS.translation();
  origin.rpy = rpy_from_rotation(object.X_OS.linear());
  Material material;
  material.rgba = object.rgba;
  link.visuals.push_back({"", origin, object.shape, material, object.source});
  link.collisions.push_back({"", origin, object.shape, object.source});
  link.source = object.source;
  RobotDescription out;
  out.name = object.name;
  out.links.push_back(std::move(link));
  out.source = object.source;
  return out;
}

Model model_of(const WorldObject& object, const CollisionMesh* mesh) {
  Model model;
  model.name = object.name;
  model.total_mass = object.mass;
  ModelLink body{kObjectLink, -1, std::nullopt, false};
  if (object.mass > 0) {
    body.joint = 0;
    body.inertia = object_inertia(object, mesh);
    ModelJoint joint;
    joint.name = object.name + "_floating";
    joint.type = JointType::floating;
    joint.parent_link = 0;
    joint.child_link = 1;
    joint.q = joint.v = 0;
    joint.nq = model.nq = 7;
    joint.nv = model.nv = 6;
    model.joints.push_back(joint);
    model.links.push_back({"world", -1, std::nullopt, false});
  }
  model.links.push_back(body);
  return model;
}

}  // namespace

bool ModelInstance::floating() const {
  return !model->joints.empty() && model->joints.front().type == JointType::floating &&
         model->joints.front().parent_link == 0;
}

int ModelInstance::base_link() const {
  return floating() ? 1 : 0;
}

bool ModelInstance::is_object() const {
  return passive || model->links.size() == (floating() ? 2u : 1u);
}

namespace {

// Light links are common in descriptions, as frames with a mass that other tools ask for; heavy ones are
// mistakes.
void refuse_extremes(const RobotDescription& description, const ModelInstance& instance) {
  Diagnostics errors;
  for (const ModelLink& link : instance.model->links) {
    const Link* const source = description.find_link(link.name);
    if (!link.inertia || source == nullptr || link.inertia->mass <= kMaxBodyMass) continue;
    check_mass(link.inertia->mass, "physics.mass",
               source->inertial ? source->inertial->source : source->source, errors);
  }
  check_distance(instance.X_WR, "physics.distance", description.source, errors);
  errors.throw_if_errors();
}

}  // namespace

ModelInstance make_instance(std::shared_ptr<const RobotDescription> description,
                            std::shared_ptr<const Model> model, const InstanceOptions& options,
                            CollisionMeshes& meshes, Diagnostics& diagnostics) {
  ModelInstance out;
  out.name = options.name.empty() ? description->name : options.name;
  out.X_WR = options.X_WR;
  out.q0 = options.q0.size() > 0 ? options.q0 : model->neutral();
  out.servos = options.servos.empty()
                   ? choose_servos(*model, {}, options.X_WR.linear().transpose() * options.gravity)
                   : options.servos;
  if (out.q0.size() != model->nq || out.servos.size() != model->joints.size())
    throw std::invalid_argument("InstanceOptions: q0 or servos has the wrong size");
  out.self_collision = options.self_collision;
  out.set_on_ground = options.set_on_ground;
  out.passive = options.passive;
  out.X_BO = options.X_BO;
  ShapeReader reader(meshes, diagnostics);
  std::vector<std::string> keep;  // links whose shapes collide as they are described
  out.shapes.resize(model->links.size());
  const MeshUse use = !options.passive ? MeshUse::hull : model->nv == 0 ? MeshUse::still : MeshUse::moving;
  for (std::size_t i = 0; i < model->links.size(); ++i) {
    const Link* const link = description->find_link(model->links[i].name);
    if (link == nullptr) continue;  // the world that a floating base was given
    out.shapes[i] = reader.shapes_of(*description, *model, *link, use);
    if (!contact_shape_of(*description, *link).empty()) keep.push_back(link->name);
  }
  reader.throw_if_errors();
  out.rolling = fit_rolling_parts(*model, out.q0, keep, out.shapes);
  out.description = std::move(description);
  out.model = std::move(model);
  refuse_extremes(*out.description, out);
  return out;
}

ModelInstance make_instance(const WorldObject& object, CollisionMeshes& meshes, Diagnostics& diagnostics) {
  check(object);
  const CollisionMesh* mesh = nullptr;
  if (const auto* geometry = std::get_if<MeshGeometry>(&object.shape))
    mesh = meshes.find(*geometry, fmt::format("object '{}'", object.name), object.source, diagnostics);
  ModelInstance out;
  out.name = object.name;
  out.description = std::make_shared<const RobotDescription>(description_of(object));
  out.model = std::make_shared<const Model>(model_of(object, mesh));
  out.servos.resize(out.model->joints.size());
  out.shapes.resize(out.model->links.size());
  const bool shaped = mesh != nullptr || !std::holds_alternative<MeshGeometry>(object.shape);
  if (shaped) {
    out.shapes.back().push_back(shape_of(object.shape, mesh, object.X_OS, uniform_friction(object.friction)));
    out.shapes.back().back().restitution = object.restitution;
  }
  out.q0 = out.model->neutral();
  if (object.mass > 0) {
    out.q0.head<3>() = object.X_WO.translation();
    out.q0.tail<4>() = Eigen::Quaterniond(object.X_WO.linear()).coeffs();  // x y z w
  } else {
    out.X_WR = object.X_WO;
  }
  return out;
}

int find_instance(std::span<const ModelInstance> instances, std::string_view name) {
  const auto found = std::ranges::find(instances, name, &ModelInstance::name);
  return found == instances.end() ? -1 : static_cast<int>(found - instances.begin());
}

}  // namespace doppel
