#include "doppel/physics/contract/model_instance.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "doppel/base/math/mass_properties.h"
#include "doppel/physics/contract/described_servo.h"
#include "doppel/robot/collision/size_limits.h"

namespace doppel {
namespace {

constexpr const char* kObjectLink = "link";
// Engines reject bodies of about 1e-15 kg, and no measured quantity distinguishes a smaller mass from zero.
constexpr double kMinMass = 1e-9;  // kg

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
  out.servos = options.servos.empty() ? choose_servos(*description, *model, {},
                                                      options.X_WR.linear().transpose() * options.gravity)
                                      : options.servos;
  if (out.q0.size() != model->nq || out.servos.size() != model->joints.size())
    throw std::invalid_argument("InstanceOptions: q0 or servos has the wrong size");
  out.self_collision = options.self_collision;
  out.set_on_ground = options.set_on_ground;
  out.passive = options.passive;
  out.X_BO = options.X_BO;
  const MeshUse use = !options.passive ? MeshUse::hull : model->nv == 0 ? MeshUse::still : MeshUse::moving;
  Diagnostics found;
  out.shapes = link_shapes(*description, *model, use, meshes, found);
  for (const Diagnostic& diagnostic : found.all()) {
    if (diagnostic.severity != Severity::error) diagnostics.add(diagnostic);
  }
  found.throw_if_errors();
  out.rolling = fit_rolling_parts(*model, out.q0, out.shapes);
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
    CollisionShape shape =
        collision_shape(object.shape, mesh, object.X_OS, uniform_friction(object.friction));
    shape.restitution = object.restitution;
    shape.id.link = out.base_link();
    shape.source = object.source;
    out.shapes.back().push_back(std::move(shape));
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
