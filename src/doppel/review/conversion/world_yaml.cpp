#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "doppel/base/core/overloaded.h"
#include "doppel/base/core/unique_name.h"
#include "doppel/base/math/decimals.h"
#include "doppel/review/conversion/detail/world_lost.h"
#include "doppel/review/conversion/world_documents.h"
#include "doppel/robot/kinematics/link_solid.h"

namespace doppel {
namespace {

constexpr double kSameMoment = 0.02;  // of the moments of a uniform shape
constexpr double kSamePlace = 1e-6;   // m
constexpr double kSameNumber = 1e-12;

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + '"';
}

std::string list_of(const Eigen::Vector3d& v) {
  return fmt::format("[{}, {}, {}]", decimal(v.x()), decimal(v.y()), decimal(v.z()));
}

class WorldYaml {
 public:
  WorldYaml(const SdfWorld& world, MeshFiles& meshes, Diagnostics& diagnostics)
      : world_(world),
        meshes_(meshes),
        diagnostics_(diagnostics),
        losses_("a world file in YAML", diagnostics) {}

  std::string write() {
    const WorldSettings& s = world_.settings;
    std::string out = fmt::format("name: {}\ngravity: {}\nstep: {}\n", quoted(s.name), list_of(s.gravity),
                                  decimal(to_seconds(s.step)));
    const std::string bounce =
        s.ground_restitution ? ", restitution: " + decimal(*s.ground_restitution) : std::string();
    out += s.ground ? fmt::format("ground: {{friction: {}{}}}\n", decimal(s.ground_friction), bounce)
                    : "ground: false\n";
    out += fmt::format("friction_rule: {}\n", s.friction_rule == FrictionRule::smaller ? "min" : "max");
    for (const SdfModel& model : world_.models) add(model);
    if (!objects_.empty()) out += "objects:\n" + objects_;
    losses_.lose_lights(world_);
    losses_.lose_environment(world_);
    losses_.lose_plugins(world_);
    return out;
  }

 private:
  void lose(const SourceLocation& where, const std::string& what, const std::string& fix = "") {
    losses_.lose(where, what, fix);
  }

  void add(const SdfModel& model) {
    const RobotDescription& robot = *model.description;
    losses_.lose_sensors_and_plugins(model);
    if (robot.links.size() != 1) {
      return lose(model.source,
                  fmt::format("the model '{}', which has {} links,", model.name, robot.links.size()),
                  "keep the SDF file, or spawn the model");
    }
    const Link& link = robot.links.front();
    const bool fixed = model.base == BaseKind::fixed;
    if (link.collisions.empty() && link.visuals.empty()) return;  // the ground, which is written above
    if (link.collisions.empty())
      return lose(model.source, fmt::format("the model '{}', which collides with nothing,", model.name));
    if (!fixed && link.collisions.size() > 1) {
      return lose(model.source,
                  fmt::format("the model '{}', which moves and has {} collision shapes,", model.name,
                              link.collisions.size()),
                  "keep the SDF file, or spawn the model");
    }
    for (const Collision& collision : link.collisions) {
      const bool alone = link.collisions.size() == 1;
      add_shape(model, link, collision, alone ? model.name : model.name + "/" + collision.name);
    }
  }

  // "box: [1, 1, 1]"; nullopt: not a shape of such files.
  std::optional<std::string> shape_text(const Geometry& geometry) {
    using Text = std::optional<std::string>;
    return std::visit(
        Overloaded{
            [](const Box& b) -> Text { return "box: " + list_of(b.size); },
            [](const Sphere& s) -> Text { return fmt::format("sphere: {{radius: {}}}", decimal(s.radius)); },
            [](const Cylinder& c) -> Text {
              return fmt::format("cylinder: {{radius: {}, length: {}}}", decimal(c.radius),
                                 decimal(c.length));
            },
            [](const Capsule& c) -> Text {
              return fmt::format("capsule: {{radius: {}, length: {}}}", decimal(c.radius), decimal(c.length));
            },
            [this](const MeshGeometry& m) -> Text {
              if (m.path.empty() || !m.submesh.empty()) return std::nullopt;
              return fmt::format("mesh: {{uri: {}, scale: {}}}", quoted(meshes_.reference(m)),
                                 list_of(m.scale));
            },
            [](const auto&) -> Text { return std::nullopt; }},
        geometry);
  }

  void add_shape(const SdfModel& model, const Link& link, const Collision& collision,
                 const std::string& wanted) {
    const auto shape = shape_text(collision.geometry);
    if (!shape) {
      return lose(collision.source, fmt::format("the shape '{}' of '{}'", collision.name, model.name),
                  "a world file has boxes, spheres, cylinders, capsules and whole meshes");
    }
    const std::string name = unique_name(wanted, taken_);
    if (name != wanted)
      diagnostics_.note("world.renamed", collision.source,
                        fmt::format("'{}' is written as '{}'", wanted, name));
    const Pose X_WS = model.X_WR * collision.origin.pose();
    objects_ += fmt::format("  - name: {}\n    {}\n    xyz: {}\n    rpy: {}\n", quoted(name), *shape,
                            list_of(X_WS.translation()), list_of(rpy_from_rotation(X_WS.linear())));
    if (model.base != BaseKind::fixed) add_mass(model, link, collision);
    add_friction(model, collision);
    add_colour(link);
    if (std::holds_alternative<MeshGeometry>(collision.geometry) && model.is_static)
      lose(collision.source,
           fmt::format("the surface of the static mesh '{}', which is written as its hull,", name));
  }

  void add_mass(const SdfModel& model, const Link& link, const Collision& collision) {
    const double mass = link.inertial ? link.inertial->mass : 1.0;
    objects_ += fmt::format("    mass: {}\n", decimal(mass));
    if (!link.inertial || !link.inertial->tensor_written) return;
    Link uniform = link;
    uniform.visuals.clear();
    const MassProperties solid = link_solid(uniform);
    const Eigen::Matrix3d R_LC = link.inertial->origin.pose().linear();
    const Eigen::Matrix3d own = R_LC * link.inertial->tensor() * R_LC.transpose();
    const Eigen::Matrix3d expected = solid.I * (mass / std::max(solid.mass, kMinSolidMass));
    const bool same_place = (link.inertial->origin.xyz - solid.com).norm() < kSamePlace;
    if (!same_place || (own - expected).norm() > kSameMoment * expected.norm()) {
      lose(collision.source,
           fmt::format("the inertia of '{}', which is not that of a uniform shape,", model.name),
           "the object is written with the mass alone");
    }
  }

  void add_friction(const SdfModel& model, const Collision& collision) {
    const ContactSurface& surface = collision.surface;
    objects_ += fmt::format("    friction: {}\n", decimal(surface.mu.value_or(kDefaultFriction)));
    if (surface.restitution && *surface.restitution >= 0 && *surface.restitution <= 1)
      objects_ += fmt::format("    restitution: {}\n", decimal(*surface.restitution));
    const bool directed =
        surface.fdir1 && std::abs(surface.mu2.value_or(*surface.mu) - *surface.mu) > kSameNumber;
    if (directed || surface.slip1.value_or(0) > 0 || surface.slip2.value_or(0) > 0 ||
        surface.patch_radius.value_or(0) > 0) {
      lose(collision.source,
           fmt::format("the direction, slip or torsion of the surface of '{}'", model.name));
    }
  }

  void add_colour(const Link& link) {
    const auto coloured = std::ranges::find_if(
        link.visuals, [](const Visual& visual) { return visual.material && visual.material->rgba; });
    if (coloured == link.visuals.end()) return;
    const Eigen::Vector4d rgba = coloured->material->rgba->cwiseMax(0).cwiseMin(1);
    objects_ += fmt::format("    color: [{}, {}, {}, {}]\n", decimal(rgba[0]), decimal(rgba[1]),
                            decimal(rgba[2]), decimal(rgba[3]));
  }

  const SdfWorld& world_;
  MeshFiles& meshes_;
  Diagnostics& diagnostics_;
  WorldLosses losses_;
  std::vector<std::string> taken_{"ground"};
  std::string objects_;
};

}  // namespace

std::string to_world_yaml(const SdfWorld& world, MeshFiles& meshes, Diagnostics& diagnostics) {
  return WorldYaml(world, meshes, diagnostics).write();
}

}  // namespace doppel
