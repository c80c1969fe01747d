#include <algorithm>

#include "doppel/base/core/unique_name.h"
#include "doppel/base/math/decimals.h"
#include "doppel/base/xml/element.h"
#include "doppel/review/conversion/detail/world_lost.h"
#include "doppel/review/conversion/sdf.h"
#include "doppel/review/conversion/world_documents.h"

namespace doppel {
namespace {

XmlNode sdf_ground(const SdfWorld& world) {
  std::vector<std::string> taken{"ground"};
  for (const SdfModel& model : world.models) taken.push_back(model.name);
  const std::string mu = decimal(world.settings.ground_friction);
  XmlNode surface = element(
      "surface", {},
      {element("friction", {}, {element("ode", {}, {text_element("mu", mu), text_element("mu2", mu)})})});
  if (world.settings.ground_restitution) {
    surface.children.push_back(
        element("bounce", {},
                {text_element("restitution_coefficient", decimal(*world.settings.ground_restitution))}));
  }
  XmlNode collision =
      element("collision", {{"name", "collision"}},
              {element("geometry", {}, {element("plane", {}, {text_element("normal", "0 0 1")})}),
               std::move(surface)});
  return element(
      "model", {{"name", unique_name("ground_plane", taken)}},
      {text_element("static", "true"), element("link", {{"name", "link"}}, {std::move(collision)})});
}

std::string world_pose(const Pose& X) {
  return decimals(X.translation()) + " " + decimals(rpy_from_rotation(X.linear()));
}

std::string colour_text(const Eigen::Vector4d& rgba) {
  return decimals(rgba.head<3>()) + " " + decimal(rgba.w());
}

XmlNode sdf_scene(const Environment& environment) {
  XmlNode out = element("scene", {},
                        {text_element("ambient", colour_text(environment.ambient)),
                         text_element("background", colour_text(environment.background)),
                         text_element("shadows", truth(environment.shadows))});
  if (environment.sky) {
    out.children.push_back(element("sky", {},
                                   {text_element("time", decimal(environment.sky->time)),
                                    text_element("sunrise", decimal(environment.sky->sunrise)),
                                    text_element("sunset", decimal(environment.sky->sunset))}));
  }
  return out;
}

XmlNode sdf_light(const Light& light) {
  const auto number = [](const char* name, double value) { return text_element(name, decimal(value)); };
  XmlNode out = element(
      "light", {{"name", light.name}, {"type", name_of(light.kind)}},
      {text_element("pose", world_pose(light.X_WL)), text_element("cast_shadows", truth(light.cast_shadows)),
       text_element("light_on", truth(light.on)), number("intensity", light.intensity),
       text_element("diffuse", colour_text(light.diffuse)),
       text_element("specular", colour_text(light.specular)),
       element(
           "attenuation", {},
           {number("range", light.range), number("constant", light.attenuation_constant),
            number("linear", light.attenuation_linear), number("quadratic", light.attenuation_quadratic)}),
       text_element("direction",
                    decimals(Eigen::Vector3d(light.X_WL.linear().transpose() * light.direction_W)))});
  if (light.kind == LightKind::spot) {
    out.children.push_back(
        element("spot", {},
                {number("inner_angle", light.inner_angle), number("outer_angle", light.outer_angle),
                 number("falloff", light.falloff)}));
  }
  return out;
}

// The sensors of an SDF model into their links, with resolved poses.
void add_sensors(const SdfModel& model, XmlNode& out, WorldLosses& losses) {
  for (const SdfSensor& sensor : model.sensors) {
    const auto link = std::ranges::find_if(out.children, [&sensor](const XmlNode& child) {
      const XmlAttribute* const name = child.find("name");
      return child.is("link") && name != nullptr && name->value == sensor.link;
    });
    if (link == out.children.end()) {
      losses.lose_sensor(model, sensor);
      continue;
    }
    XmlNode node = sensor.node;
    std::erase_if(node.children, [](const XmlNode& child) { return child.is("pose"); });
    node.children.insert(node.children.begin(), text_element("pose", world_pose(sensor.X_LS)));
    link->children.push_back(std::move(node));
  }
}

}  // namespace

std::string to_world_sdf(const SdfWorld& world, MeshFiles& meshes, Diagnostics& diagnostics) {
  const WorldSettings& settings = world.settings;
  XmlNode out = element("world", {{"name", settings.name}});
  out.children.push_back(text_element("gravity", decimals(settings.gravity)));
  out.children.push_back(element("physics", {{"type", "ode"}, {"name", "default"}},
                                 {text_element("max_step_size", decimal(to_seconds(settings.step)))}));
  if (settings.environment) out.children.push_back(sdf_scene(*settings.environment));
  for (const Light& light : settings.lights) out.children.push_back(sdf_light(light));
  for (const GazeboPlugin& plugin : world.plugins)
    out.children.push_back(parse_xml(plugin.xml, settings.name));
  if (settings.ground) out.children.push_back(sdf_ground(world));
  WorldLosses losses("SDF", diagnostics);
  for (const SdfModel& model : world.models) {
    const Model compiled = compile_model(*model.description, BaseKind::fixed, diagnostics);
    XmlNode root = parse_xml(to_sdf(*model.description, compiled, meshes, diagnostics), model.name);
    for (XmlNode& child : root.children) {
      if (!child.is("model")) continue;
      for (auto& attribute : child.attributes) {
        if (attribute.name == "name") attribute.value = model.name;
      }
      add_sensors(model, child, losses);
      child.children.insert(child.children.begin(), text_element("pose", world_pose(model.X_WR)));
      if (model.is_static) child.children.insert(child.children.begin(), text_element("static", "true"));
      out.children.push_back(std::move(child));
    }
  }
  return to_xml(element("sdf", {{"version", "1.11"}}, {std::move(out)}));
}

}  // namespace doppel
