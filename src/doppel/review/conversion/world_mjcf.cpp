#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>

#include "doppel/base/math/decimals.h"
#include "doppel/base/xml/element.h"
#include "doppel/physics/mjcf/mjcf.h"
#include "doppel/review/conversion/detail/world_lost.h"
#include "doppel/review/conversion/mjcf_export.h"
#include "doppel/review/conversion/world_documents.h"

namespace doppel {
namespace {

// Attributes whose value is a name of the same document.
constexpr std::array<std::string_view, 8> kNames{"name",   "mesh",   "material", "joint",
                                                 "joint1", "joint2", "body1",    "body2"};

void put_before_names(XmlNode& node, const std::string& prefix) {
  for (auto& attribute : node.attributes) {
    const bool is_name = std::ranges::find(kNames, attribute.name) != kNames.end();
    if (is_name && attribute.value != "world") attribute.value = prefix + attribute.value;
  }
  for (XmlNode& child : node.children) put_before_names(child, prefix);
}

XmlNode& section(XmlNode& root, const char* name) {
  const auto found =
      std::ranges::find_if(root.children, [&](const XmlNode& child) { return child.is(name); });
  if (found != root.children.end()) return *found;
  root.children.push_back(element(name));
  return root.children.back();
}

// The poses of the bodies at the top of a model's document, in its root link: of the root, or of the links next to the
// world.
std::vector<Pose> top_poses(const Model& model) {
  if (model.links.front().name != "world") return {Pose::Identity()};
  std::vector<Pose> out;
  for (const ModelJoint& joint : model.joints) {
    if (joint.parent_link == 0) out.push_back(joint.X_PJ);
  }
  return out;
}

// The shapes of a model that is part of the world body, and its bodies, are at the model's pose. Its bodies stay at the
// top, where MuJoCo requires those that move freely.
void add_bodies(const XmlNode& from, const SdfModel& model, const Model& compiled, XmlNode& worldbody) {
  XmlNode fixed = element("body", {{"name", model.name}});
  mjcf_place(fixed, model.X_WR);
  const std::vector<Pose> X_RB = top_poses(compiled);
  std::size_t bodies = 0;
  for (const XmlNode& child : from.children) {
    if (!child.is("body")) {
      fixed.children.push_back(child);
      continue;
    }
    XmlNode body = child;
    std::erase_if(body.attributes, [](const XmlAttribute& attribute) {
      return attribute.name == "pos" || attribute.name == "quat";
    });
    mjcf_place(body, model.X_WR * X_RB.at(bodies++));
    worldbody.children.push_back(std::move(body));
  }
  if (!fixed.children.empty()) worldbody.children.push_back(std::move(fixed));
}

XmlNode light_element(const Light& light) {
  XmlNode out = element("light", {{"name", light.name},
                                  {"directional", truth(light.kind == LightKind::directional)},
                                  {"pos", decimals(light.X_WL.translation())},
                                  {"dir", decimals(light.direction_W)},
                                  {"diffuse", decimals(Eigen::Vector3d(light.diffuse.head<3>()))},
                                  {"specular", decimals(Eigen::Vector3d(light.specular.head<3>()))},
                                  {"active", truth(light.on)},
                                  {"castshadow", truth(light.cast_shadows)}});
  if (light.kind == LightKind::spot)
    add_attribute(out, "cutoff", decimal(light.outer_angle * 90 / std::acos(0.0)));
  return out;
}

SourceLocation place_of(const SdfWorld& world) {
  SourceLocation where;
  where.file = std::make_shared<const std::string>(world.files.empty() ? "" : world.files.front().string());
  return where;
}

void note_friction(const SdfWorld& world, Diagnostics& diagnostics) {
  std::set<double> coefficients;
  if (world.settings.ground) coefficients.insert(world.settings.ground_friction);
  for (const SdfModel& model : world.models) {
    for (const Link& link : model.description->links) {
      for (const Collision& collision : link.collisions)
        coefficients.insert(collision.surface.mu.value_or(kDefaultFriction));
    }
  }
  if (coefficients.size() < 2) return;
  diagnostics.note("world.friction_rule", place_of(world),
                   "of two shapes that touch MuJoCo takes the larger friction and SDF the smaller; the "
                   "coefficients differ",
                   "write <pair> elements for contacts whose friction matters");
}

void lose_restitution(const SdfWorld& world, WorldLosses& losses) {
  if (world.settings.ground && world.settings.ground_restitution.value_or(0.0) > 0)
    losses.lose(place_of(world), "the restitution of the ground");
  for (const SdfModel& model : world.models) {
    for (const Link& link : model.description->links) {
      const auto bounces = std::ranges::find_if(link.collisions, [](const Collision& collision) {
        return collision.surface.restitution.value_or(0.0) > 0;
      });
      if (bounces == link.collisions.end()) continue;
      losses.lose(link.source, fmt::format("the restitution of '{}' of '{}'", link.name, model.name));
    }
  }
}

}  // namespace

std::string to_world_mjcf(const SdfWorld& world, MeshFiles& meshes, Diagnostics& diagnostics) {
  const WorldSettings& settings = world.settings;
  XmlNode root = element("mujoco", {{"model", settings.name}});
  root.children.push_back(element("compiler", {{"angle", "radian"}, {"inertiafromgeom", "false"}}));
  root.children.push_back(element("option", {{"timestep", decimal(to_seconds(settings.step))},
                                             {"gravity", decimals(settings.gravity)},
                                             {"integrator", "implicit"},
                                             {"cone", "elliptic"},
                                             {"impratio", "100"}}));
  root.children.push_back(mjcf_defaults(to_seconds(settings.step)));
  for (const char* name : {"asset", "worldbody", "contact", "equality"}) section(root, name);
  XmlNode& worldbody = section(root, "worldbody");
  for (const Light& light : settings.lights) worldbody.children.push_back(light_element(light));
  if (settings.ground) {
    worldbody.children.push_back(
        element("geom", {{"name", "ground"},
                         {"type", "plane"},
                         {"size", "0 0 1"},
                         {"friction", decimal(settings.ground_friction) + " 0.005 0.0001"}}));
  }
  WorldLosses losses("MJCF", diagnostics);
  losses.lose_plugins(world);
  losses.lose_environment(world);
  lose_restitution(world, losses);
  for (const SdfModel& model : world.models) {
    losses.lose_sensors_and_plugins(model);
    const Model compiled = compile_model(*model.description, model.base, diagnostics);
    XmlNode document = parse_xml(to_mjcf(*model.description, compiled, meshes, diagnostics), model.name);
    put_before_names(document, model.name + "/");
    add_bodies(section(document, "worldbody"), model, compiled, section(root, "worldbody"));
    for (const char* name :
         {"asset", "contact", "equality"}) {  // actuators would hold joints that move freely
      for (XmlNode& child : section(document, name).children)
        section(root, name).children.push_back(std::move(child));
    }
  }
  std::erase_if(root.children,
                [](const XmlNode& child) { return child.children.empty() && child.attributes.empty(); });
  note_friction(world, diagnostics);
  return to_xml(root);
}

}  // namespace doppel
